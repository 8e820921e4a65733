// SPDX-License-Identifier: Apache-2.0
// What a record suggests and held-out data speak against.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "common/diagnosis/calibration.h"
#include "common/diagnosis/held_out.h"
#include "common/diagnosis/records_of_axis.h"
#include "common/diagnosis/trial.h"

namespace zerodrift::diagnosis {

// The effects that a trial named, noise apart.
[[nodiscard]] std::vector<NamedEffect> drift_of(const Trial& trial);

// Of formulas the formula, else the kind.
[[nodiscard]] std::vector<std::string> labels_of(const std::vector<NamedEffect>& effects);

// Of the listed effects that got coefficients those that make held-out data less likely, by their
// labels. A comparison each.
[[nodiscard]] std::vector<std::string> refuted_kinds(const twin::Model& given,
                                                     const Calibration& calibration,
                                                     const Split& split, core::Axis axis);

// Of the effects that a trial named beside `known`, those that make held-out data less likely
// beside the others and could have been seen there, by their labels. Noise is not among them. A
// comparison each.
[[nodiscard]] std::vector<std::string> names_spoken_against(const twin::Model& known,
                                                            const Trial& trial, const Split& split,
                                                            core::Axis axis);

// The same of a trial that held-out data speak against as a whole: all, where that is true of none
// alone.
[[nodiscard]] std::vector<std::string> refuted_names(const twin::Model& known, const Trial& trial,
                                                     const Split& split, core::Axis axis);

// Whether something unknown, or the names that were found without what held-out data speak against,
// are likelier than the first ones by the record and held-out data together: what the record speaks
// against more than those against the first is no answer. Both were made from `known`.
[[nodiscard]] bool outweighs(const Trial& second, const Trial& first, const twin::Model& known,
                             const Split& split, core::Axis axis);

// Whether each effect that a trial named beside `known`, noise apart, makes held-out data clearly
// likelier beside the others (kClearNats). A comparison each.
[[nodiscard]] bool each_is_clear(const twin::Model& known, const Trial& trial, const Split& split,
                                 core::Axis axis);

// Whether held-out data would show what a trial named beside `known`, if it is true. Noise always
// shows.
[[nodiscard]] bool would_show(const twin::Model& known, const Trial& trial, const Split& split,
                              core::Axis axis);

// Blocks of a record for a trial that those kept back would not show: of the blocks between its
// ends the second and the fourth by how much they would, so that as much is fitted as judged. Of no
// kind where they wouldn't either. Eight comparisons.
[[nodiscard]] Split blocks_that_show(const twin::Model& known, const Trial& trial,
                                     const PlayedRecord& record,
                                     const std::vector<std::uint8_t>& sound, core::Axis axis);

// Of the catalogue, in its order: with none of them noise alone can be named.
[[nodiscard]] std::vector<std::string> all_drift_labels();

// Whether a trial says what a record suggests: a name, something unknown or other parameters of
// what the model lists. Another bias or another size of the noise says nothing of a shape.
[[nodiscard]] bool answers(const Trial& trial);

// What is significant in the record and was named, and is not that by held-out data; noise beside
// nothing else alone. Nothing where a trial named nothing.
[[nodiscard]] std::optional<UnknownEffect> unknown_like(const Trial& trial);

// The same of a trial that gave the model other parameters alone, where what the model leaves of
// the record stands out of the noise; nothing where it doesn't, or where noise or a bias alone
// changed.
[[nodiscard]] std::optional<UnknownEffect> unlike_other_parameters(const Trial& trial,
                                                                   double left_rms_radps,
                                                                   double noise_rms_radps);

}  // namespace zerodrift::diagnosis
