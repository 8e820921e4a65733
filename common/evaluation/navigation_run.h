// SPDX-License-Identifier: Apache-2.0
// A record through compensation and navigation filters, with what the filters give back: what the
// services do, without the services.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/evaluation/progress.h"
#include "common/navigation/gyro_navigation.h"
#include "common/record/record_reader.h"

namespace zerodrift::evaluation {

struct NavigationRequest {
  record::RecordInput record;
  compensation::CompensationOptions compensation;
  navigation::GyroNavigationOptions navigation;
  bool gives_references = true;
};

// Every ten seconds, for the picture, for as long as there is a truth.
struct NavigationPoint {
  double time_s = 0.0;
  double raw_error_rad = 0.0;
  double compensated_error_rad = 0.0;
};

struct NavigationResult {
  std::string record;
  bool truth_known = false;
  bool truth_lost = false;                           // before the end: errors are those until then
  std::string truth_note{};                          // why it isn't, or not to the end; else empty
  std::array<navigation::StreamErrors, 2> errors{};  // by navigation::Stream
  std::array<navigation::StreamCounts, 2> streams{};
  std::array<navigation::Attitude, 2> attitudes{};  // at the end
  std::array<double, 2> heading_sigma_rad{};
  navigation::NavigationCounts counts;
  compensation::CompensatorCounts compensation;
  double rest_s = 0.0;
  std::vector<NavigationPoint> points;
  std::vector<std::string> warnings;
};

// A record's reference columns are the truth that the filters are judged by; the compensation does
// not use them unless its options say so. Specific force is taken where the record has all three
// columns. Throws where the record can't be read.
[[nodiscard]] NavigationResult run_navigation(const NavigationRequest& request,
                                              const Progress& progress);

}  // namespace zerodrift::evaluation
