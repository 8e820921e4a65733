// SPDX-License-Identifier: Apache-2.0
// What takes no part in a fit, and what it says of a repaired model.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/diagnosis/finding.h"
#include "common/diagnosis/measured_series.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/trial.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

inline constexpr double kMeanS = 60.0;  // RMS figures are of means over this
// Two of so many blocks are kept back, with a guard at each of their ends: a quarter of the block,
// so that half of it is judged, but no more than this.
inline constexpr std::size_t kBlocks = 10;
inline constexpr double kLongestGuardS = 300.0;
// Nor less than twice the half window that temperatures are smoothed over, so that no reading takes
// part on both sides. In a shorter record than this nothing can be kept back.
inline constexpr double kShortestGuardS = 90.0;
inline constexpr double kShortestForBlocksS = 4.0 * kShortestGuardS * kBlocks;

inline constexpr double kClearNats = 10.0;  // of held-out data: outweighs the few points of an
                                            // Allan curve, or a mean

struct HeldOutPart {
  const MeasuredSeries* series;
  const Playback* playback;
  std::vector<std::uint8_t> valid;
  bool is_of_fitted_record = false;  // what happened there once happened in this part, too
};

struct Split {
  HeldOut kind = HeldOut::kNothing;
  double share_out_of_reach = 0.0;  // of the other records' samples: left out of `held_out`
  std::vector<std::uint8_t> fitted{};
  std::vector<HeldOutPart> held_out{};
};

[[nodiscard]] std::size_t intervals_in(double duration_s, double interval_s);
[[nodiscard]] double duration_of(const MeasuredSeries& series);
// An RMS of means needs two of them.
[[nodiscard]] bool can_judge(const HeldOutPart& part);

// Where coefficients come from the fitted samples, others can judge them only at temperatures that
// those reached, or a tenth of their range beyond. Leaves out the samples of `part` that are
// elsewhere by any probe that both have; how many. O(samples).
[[nodiscard]] std::size_t keep_in_reach(HeldOutPart& part, const MeasuredSeries& fitted,
                                        std::span<const std::uint8_t> valid);

// Two blocks of the record, by their places, not those at its ends; everything is fitted where they
// can't judge.
[[nodiscard]] Split split_in_blocks(const MeasuredSeries& series, const Playback& playback,
                                    const std::vector<std::uint8_t>& sound,
                                    const std::array<std::size_t, 2>& blocks = {3, 7});

struct Comparison {
  Gap gap;
  // About the mean: what is judged, since the bias of a switch-on is anyone's.
  double shape_before_radps = 0.0;
  double shape_after_radps = 0.0;
  // How much likelier the drift afterwards makes the data about their mean, nats; 0 where the model
  // has no noise to judge by.
  double gain_nats = 0.0;
  double mean_gain_nats = 0.0;  // and the mean of blocks of the fitted record
  // What that would be on average if the drift afterwards were the true one: half the square of how
  // far both are apart, in standard errors.
  double expected_gain_nats = 0.0;
  double noise_gain_nats = 0.0;  // of the noise afterwards, on what the drift afterwards leaves
  AllanDistance allan;
};

[[nodiscard]] Comparison compare_on(const std::vector<HeldOutPart>& parts,
                                    const twin::Model& before, const twin::Model& after,
                                    core::Axis axis);

// How much likelier one model makes data that took no part than another one does, nats: drift and
// noise. Both were made from `base`, in which neither's oscillations are.
[[nodiscard]] double likelier_by_nats(const std::vector<HeldOutPart>& parts,
                                      const twin::Model& base, const twin::Model& one,
                                      const twin::Model& other, core::Axis axis);

// Both are at least two standard errors apart: else the data can't tell one from the other.
[[nodiscard]] bool tells_apart(const Comparison& comparison);

// What changes the drift's shape has to make the data likelier, which tells more than their RMS
// where noise is red; what is noise, too, or bring the Allan curve closer; a bias, the mean.
// Neither may make the others worse, but what is clearly proved of a shape stands beside the mean
// of another switch-on. Blocks of the record itself have its mean but for what slow noise makes of
// theirs: it counts with the shape. The Allan curve speaks of the noise and is no objection to a
// shape that is clearly proved where the noise stays as it was. Of a twin without any noise the
// Allan curve is no figure to judge by, and any noise is likelier than none.
[[nodiscard]] Acceptance judge(const Trial& trial, const Comparison& held_out, HeldOut kind);

// Whether it belongs to the record that shows it (twin/effect.h).
[[nodiscard]] bool happens_once(const twin::EffectSpec& effect);
// Whether the catalogue has the effect as a noise.
[[nodiscard]] bool is_noise(const std::string& kind);
// Whether an effect, or a formula's label, moves the drift about its mean: neither a noise nor a
// bias.
[[nodiscard]] bool has_shape(const std::string& kind);

}  // namespace zerodrift::diagnosis
