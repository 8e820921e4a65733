// SPDX-License-Identifier: Apache-2.0
// What was found of an axis, as it is reported: what a trial and the record's faults say, shares of
// the gap, what is taken back, and where "nothing is missing" would say too much.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/record_faults.h"
#include "common/diagnosis/records_of_axis.h"
#include "common/diagnosis/trial.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// What is no larger than the errors by rounding that the record is known to have is theirs.
[[nodiscard]] bool is_of_rounding(double rms_radps, const RecordFaults& faults);
// What held-out data refuted, if anything, says something: it is larger than the record's own
// rounding, or, of what looked like noise, the record has an input that moves: without one it shows
// noise alone.
[[nodiscard]] bool tells(const std::optional<UnknownEffect>& refuted, bool an_input_moves,
                         const RecordFaults& faults);

// An axis's own part of the model of a trial that stands into the repaired one, less the events
// that were added to those of the model as it was given: no repaired model says that they happen
// again. What the trial tells of new parameters is what that model has.
void hand_over(Trial& trial, const TrialInput& input, twin::Model& repaired);

// Noise and events that were found beside an unknown effect describe what that leaves.
void take(AxisDiagnosis& result, const Trial& trial, const RecordFaults& faults);

// One axis of a record, the model as it was given and as it is in the end.
struct ModelsOnRecord {
  const twin::Model& given;
  const twin::Model& final_one;
  PlayedRecord record;
  core::Axis axis;
  const std::vector<std::uint8_t>& sound;  // samples without a fault
  const std::vector<double>& measured;     // drift, rad/s
  const std::vector<double>& before;       // the given model's
};

// Curves and figures of the record beside both models, and where they disagree. The shares of the
// gap are those of the effects' waveforms in what they explain together.
void describe(AxisDiagnosis& result, const ModelsOnRecord& models, const Trial& trial);

// All but the record's own faults, which need no proof by another record.
void take_back(AxisDiagnosis& result);

// Of an axis in which nothing was found: a record that differs from the model by far more than its
// noise makes that undecidable: this one, of whose difference about its mean `left_rms_radps` is
// the size, or those for validation. Not for a model whose coefficients come from the record
// itself, which may not reach as far as theirs.
void doubt_consistency(AxisDiagnosis& result, double left_rms_radps, const Comparison& held_out);

// Of an axis whose model was only recalibrated, in a record whose inputs move: slow noise far
// beyond what the model states may be noise, or an effect whose memory no candidate has. The
// verdict stays.
void doubt_noise(AxisDiagnosis& result);

}  // namespace zerodrift::diagnosis
