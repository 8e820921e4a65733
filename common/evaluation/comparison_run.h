// SPDX-License-Identifier: Apache-2.0
// All schemes on all axes of a record under every protocol, and under the paper's procedure. The
// record is read twice: for its labels, then for the unsmoothed compensated streams.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/comparison/compared_scheme.h"
#include "common/comparison/paper_procedure.h"
#include "common/comparison/residual_stream.h"
#include "common/comparison/test_then_train.h"
#include "common/evaluation/progress.h"
#include "common/measurement/plausibility.h"
#include "common/record/record_reader.h"

namespace zerodrift::evaluation {

struct ComparisonRequest {
  record::RecordInput record;
  compensation::CompensationOptions options;
  std::vector<std::string> schemes;
  std::vector<double> delays_s;
  bool only_labels = false;  // no streams, not the paper's procedure: labels are judged alone
  std::optional<double> train_until_s;  // of the frozen judgement; else the last leg is found
};

struct SchemeOutcome {
  std::string name;
  std::vector<std::optional<comparison::PredictedPoint>> predicted;  // by point
  comparison::ResidualStatistics statistics;
  comparison::StreamReport stream;
  double seconds = 0.0;  // to predict and to learn all points
};

struct ProtocolOutcome {
  comparison::Protocol protocol;
  std::vector<SchemeOutcome> schemes;
  comparison::StreamReport raw;  // of the same samples
};

struct PaperOutcome {
  std::string name;
  std::vector<double> residual_radps;  // by prepared point
  comparison::Moments moments;
  std::optional<comparison::PaperCoefficients> coefficients;
  double seconds = 0.0;  // temperature rate, prediction and learning of all points
};

struct AxisComparison {
  core::Axis axis = core::Axis::kX;
  std::vector<comparison::LabelledPoint> points;
  std::size_t initial_labels = 0;  // that train the batch schemes; judged is what comes after
  std::vector<ProtocolOutcome> protocols;
  double paper_interval_s = 0.0;
  std::vector<double> paper_radps;  // the prepared rate itself
  std::vector<PaperOutcome> paper;  // none: a warning says why
};

struct ComparisonResult {
  std::string record;
  std::string no_model;  // why no model ever comes into force, and then no axis; else empty
  std::vector<measurement::Doubt> doubts;
  std::vector<std::string> warnings;  // of the record, and what could not be judged and why
  bool is_paper_like = false;         // a record of the shipped model and profile
  std::vector<double> delays_s;       // as requested, judged or not
  std::vector<AxisComparison> axes;
};

// Every axis with labels enough. Throws files::FileError, std::invalid_argument with one line: what
// is wrong with the request, or what the record lacks.
[[nodiscard]] ComparisonResult run_comparison(const ComparisonRequest& requested,
                                              const Progress& progress);

}  // namespace zerodrift::evaluation
