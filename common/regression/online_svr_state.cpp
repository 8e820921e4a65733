// SPDX-License-Identifier: Apache-2.0
// The state of an OnlineSvr, both ways. Samples go in the order of their arrival, each with its
// slot; what a sample's set, tier and weight allow is required before any of it is used.
#include <algorithm>
#include <cmath>

#include "common/regression/online_svr.h"

namespace zerodrift::regression {
namespace {

// Targets carry a jitter, so the range has some room.
constexpr double kLargestKept = 2.0 * kLargestMagnitude;

// Whether the slots of the set, and no others, are listed once each.
bool lists_exactly(const std::vector<std::size_t>& slots, const std::vector<SampleSet>& sets,
                   SampleSet set) {
  std::vector<char> listed(sets.size(), 0);
  for (const std::size_t slot : slots) {
    if (slot >= sets.size() || sets[slot] != set || listed[slot]) return false;
    listed[slot] = 1;
  }
  return slots.size() == static_cast<std::size_t>(std::count(sets.begin(), sets.end(), set));
}

}  // namespace

std::vector<std::size_t> OnlineSvr::slots_by_arrival() const {
  std::vector<std::size_t> slots;
  for (std::size_t slot = 0; slot < slot_count(); ++slot) {
    if (set_[slot] != SampleSet::kVacant) slots.push_back(slot);
  }
  std::sort(slots.begin(), slots.end(),
            [&](std::size_t a, std::size_t b) { return arrival(a) < arrival(b); });
  return slots;
}

void OnlineSvr::carry(core::StateArchive& archive) {
  if (archive.reads()) clear();
  archive.sums(bias_);
  archive(arrival_count_, refresh_cursor_);
  archive.require(refresh_cursor_ < slot_count());
  std::vector<std::size_t> slots = slots_by_arrival();
  archive.list(slots, slot_count());
  for (std::size_t i = 0; i < slots.size(); ++i) {
    const std::size_t slot = slots[i];
    archive.require(slot < slot_count() && (!archive.reads() || set_[slot] == SampleSet::kVacant));
    if (!archive.ok()) return;
    carry_sample(archive, slot);
    archive.require(i == 0 || arrival(slots[i - 1]) < arrival(slot));
  }
  if (archive.ok()) carry_sets(archive);
}

void OnlineSvr::carry_sample(core::StateArchive& archive, std::size_t slot) {
  auto x = rows_.sample(slot);
  bool leaves = is_leaving_[slot] != 0;
  SampleSet set = set_[slot];
  WindowTier tier = window_.tier(slot);
  std::uint64_t its_arrival = arrival(slot);
  archive.numbers(x.data(), options_.dimension, kLargestKept);
  archive.numbers(&target_[slot], 1, kLargestKept);
  archive.sums(residual_[slot]);
  archive(weight_[slot], theta_[slot], leaves, set, tier, its_arrival);

  const double theta = std::fabs(theta_[slot]);
  archive.require(options_.is_weight(weight_[slot]) && theta <= box_of(slot) * (1.0 + 1e-9));
  archive.require(set > SampleSet::kVacant && set <= SampleSet::kPending);
  archive.require(set != SampleSet::kError || theta == box_of(slot));
  archive.require(set != SampleSet::kRemaining || theta == 0.0);
  archive.require(!leaves || set == SampleSet::kPending);
  archive.require(tier == WindowTier::kRecent ||
                  (tier == WindowTier::kOld && options_.window == WindowPolicy::kTwoTier));
  archive.require(its_arrival < arrival_count_);
  if (!archive.reads() || !archive.ok()) return;
  rows_.write(slot, {x.data(), options_.dimension});
  is_leaving_[slot] = leaves ? 1 : 0;
  assign_set(slot, set);
  window_.put_back(slot, its_arrival, tier, rows_.columns());
}

// The lists' orders: of the margin by position, of what is pending as it is driven.
void OnlineSvr::carry_sets(core::StateArchive& archive) {
  // The next sample needs a slot.
  archive.require(size() < slot_count() ||
                  std::find(is_leaving_.begin(), is_leaving_.end(), 1) != is_leaving_.end());
  std::vector<std::size_t> margin;
  for (std::size_t p = 0; p < margin_.size(); ++p) margin.push_back(margin_.slot(p));
  std::vector<std::size_t> pending = pending_;
  archive.list(margin, slot_count());
  archive.list(pending, slot_count());
  archive.require(lists_exactly(margin, set_, SampleSet::kMargin) &&
                  lists_exactly(pending, set_, SampleSet::kPending));
  if (!archive.ok()) return;
  if (archive.reads()) {
    for (const std::size_t slot : pending) push_pending(slot);
    for (const std::size_t slot : margin)
      margin_.put_back({slot, rows_.take(slot), rows_.magnitude(slot)});
  }
  margin_.carry_factor(archive);
}

}  // namespace zerodrift::regression
