// SPDX-License-Identifier: Apache-2.0
// Saving and restoring an OnlineSvr.
#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>
#include <string>

#include "common/regression/online_svr.h"

namespace zerodrift::regression {

OnlineSvrState OnlineSvr::export_state() const {
  OnlineSvrState state;
  const std::size_t dimension = options_.dimension;
  state.features.resize(slot_count() * dimension);
  for (std::size_t slot = 0; slot < slot_count(); ++slot) {
    for (std::size_t d = 0; d < dimension; ++d)
      state.features[slot * dimension + d] = rows_.feature(slot, d);
    state.arrivals.push_back(window_.arrival(slot));
    state.tiers.push_back(window_.tier(slot));
    if (is_leaving_[slot]) state.forgotten_slots.push_back(slot);
  }
  const auto slots = static_cast<std::ptrdiff_t>(slot_count());
  state.targets.assign(target_.begin(), target_.begin() + slots);
  state.weights.assign(weight_.begin(), weight_.begin() + slots);
  state.thetas.assign(theta_.begin(), theta_.begin() + slots);
  state.residuals.assign(residual_.begin(), residual_.begin() + slots);
  state.sets = set_;
  for (std::size_t p = 0; p < margin_.size(); ++p) state.margin_slots.push_back(margin_.slot(p));
  const auto factor = margin_.packed_factor();
  state.margin_factor.assign(factor.begin(), factor.end());
  state.unsettled_slots = unsettled_;
  state.bias = bias_;
  state.arrival_count = arrival_count_;
  state.refresh_cursor = refresh_cursor_;
  return state;
}

namespace {

void require(bool condition, const char* field, const char* expected) {
  if (condition) return;
  throw std::invalid_argument(std::string("online SVR state: ") + field + ": expected " + expected);
}

// Targets carry a jitter, so the range has some room.
bool are_in_range(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(),
                     [](double v) { return std::fabs(v) <= 2.0 * kLargestMagnitude; });
}

bool lists_exactly(const std::vector<std::size_t>& slots, const std::vector<SampleSet>& sets,
                   SampleSet set) {
  std::vector<char> listed(sets.size(), 0);
  for (const std::size_t slot : slots) {
    if (slot >= sets.size() || sets[slot] != set || listed[slot]) return false;
    listed[slot] = 1;
  }
  return slots.size() == static_cast<std::size_t>(std::count(sets.begin(), sets.end(), set));
}

void check_sizes(const OnlineSvrOptions& options, const OnlineSvrState& state) {
  const std::size_t slots = options.capacity + 1;
  require(state.features.size() == slots * options.dimension, "features",
          "(capacity + 1) x dimension numbers");
  require(state.targets.size() == slots, "targets", "capacity + 1 numbers");
  require(state.weights.size() == slots, "weights", "capacity + 1 numbers");
  require(state.thetas.size() == slots, "thetas", "capacity + 1 numbers");
  require(state.residuals.size() == slots, "residuals", "capacity + 1 numbers");
  require(state.arrivals.size() == slots, "arrivals", "capacity + 1 numbers");
  require(state.sets.size() == slots, "sets", "capacity + 1 entries");
  require(state.tiers.size() == slots, "tiers", "capacity + 1 entries");
}

void check_values(const OnlineSvrOptions& options, const OnlineSvrState& state) {
  require(are_in_range(state.features), "features", "numbers within 2 kLargestMagnitude");
  require(are_in_range(state.targets), "targets", "numbers within 2 kLargestMagnitude");
  require(std::all_of(state.residuals.begin(), state.residuals.end(),
                      [](double h) { return std::fabs(h) <= kLargestSum; }),
          "residuals", "numbers within 1e100");
  require(std::fabs(state.bias) <= kLargestSum, "bias", "a number within 1e100");
  require(state.refresh_cursor < options.capacity + 1, "refresh_cursor", "a slot");
  for (std::size_t slot = 0; slot < state.sets.size(); ++slot) {
    const SampleSet set = state.sets[slot];
    const double theta = std::fabs(state.thetas[slot]);
    const WindowTier tier = state.tiers[slot];
    const bool vacant = set == SampleSet::kVacant;
    require(set <= SampleSet::kUnsettled, "sets", "entries 0 to 4");
    const double weight = state.weights[slot], box = weight * options.box_constraint;
    require(options.is_weight(weight), "weights", "numbers above 0 up to 1");
    require(theta <= box * (1.0 + 1e-9), "thetas", "magnitudes up to weight C");
    require(set != SampleSet::kError || theta == box, "thetas", "weight C in the error set");
    require((!vacant && set != SampleSet::kRemaining) || theta == 0.0, "thetas",
            "0 in the remaining set and in vacant slots");
    require(vacant == (tier == WindowTier::kNone) && tier <= WindowTier::kOld, "tiers",
            "a tier for each sample");
    require(tier != WindowTier::kOld || options.window == WindowPolicy::kTwoTier, "tiers",
            "old samples in a two-tier window only");
    require(vacant || state.arrivals[slot] < state.arrival_count, "arrivals",
            "numbers below arrival_count");
  }
}

void check_lists(const OnlineSvrState& state) {
  require(lists_exactly(state.margin_slots, state.sets, SampleSet::kMargin), "margin_slots",
          "each slot of the margin set once");
  require(lists_exactly(state.unsettled_slots, state.sets, SampleSet::kUnsettled),
          "unsettled_slots", "each unsettled slot once");
  const std::size_t rows = std::max<std::size_t>(state.margin_slots.size(), 1) - 1;
  require(state.margin_factor.size() == rows * (rows + 1) / 2, "margin_factor",
          "one row for each margin sample but the first");
  for (std::size_t i = 0, end = 0; i < rows; ++i) {
    end += i + 1;
    require(state.margin_factor[end - 1] > 0.0, "margin_factor", "a positive diagonal");
  }
  require(std::all_of(state.margin_factor.begin(), state.margin_factor.end(),
                      [](double l) { return std::fabs(l) <= kLargestSum; }),
          "margin_factor", "numbers within 1e100");
  std::vector<char> is_leaving(state.sets.size(), 0);
  for (const std::size_t slot : state.forgotten_slots) {
    require(
        slot < state.sets.size() && state.sets[slot] == SampleSet::kUnsettled && !is_leaving[slot],
        "forgotten_slots", "unsettled slots, each once");
    is_leaving[slot] = 1;
  }
  // One slot more than samples may stay: the next sample needs it.
  const auto vacant = std::count(state.sets.begin(), state.sets.end(), SampleSet::kVacant);
  require(vacant > 0 || !state.forgotten_slots.empty(), "sets", "at most capacity samples to stay");
}

}  // namespace

OnlineSvr OnlineSvr::from_state(const OnlineSvrOptions& options, const OnlineSvrState& state) {
  OnlineSvr svr(options);
  check_sizes(options, state);
  check_values(options, state);
  check_lists(state);
  std::vector<std::size_t> by_arrival;
  for (std::size_t slot = 0; slot < svr.slot_count(); ++slot) {
    svr.rows_.write(slot, {&state.features[slot * options.dimension], options.dimension});
    if (state.sets[slot] != SampleSet::kVacant) by_arrival.push_back(slot);
  }
  std::copy(state.targets.begin(), state.targets.end(), svr.target_.begin());
  std::copy(state.weights.begin(), state.weights.end(), svr.weight_.begin());
  std::copy(state.thetas.begin(), state.thetas.end(), svr.theta_.begin());
  std::copy(state.residuals.begin(), state.residuals.end(), svr.residual_.begin());
  for (const std::size_t slot : state.forgotten_slots) svr.is_leaving_[slot] = 1;
  for (const std::size_t slot : by_arrival) svr.assign_set(slot, state.sets[slot]);
  for (const std::size_t slot : state.unsettled_slots) svr.push_unsettled(slot);
  std::sort(by_arrival.begin(), by_arrival.end(),
            [&](std::size_t a, std::size_t b) { return state.arrivals[a] < state.arrivals[b]; });
  for (const std::size_t slot : by_arrival) {
    svr.window_.restore(slot, state.arrivals[slot], state.tiers[slot], svr.rows_.columns());
  }
  for (const std::size_t slot : state.margin_slots) {
    svr.margin_.restore({slot, svr.rows_.take(slot), svr.rows_.magnitude(slot)});
  }
  svr.margin_.restore_factor(state.margin_factor);
  svr.bias_ = state.bias;
  svr.arrival_count_ = state.arrival_count;
  svr.refresh_cursor_ = state.refresh_cursor;
  return svr;
}

}  // namespace zerodrift::regression
