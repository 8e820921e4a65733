// SPDX-License-Identifier: Apache-2.0
#include "common/service/instance_sync.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace zerodrift::service {

InstanceSync::InstanceSync(std::uint32_t instance)
    : instance_(instance % kMostInstances), own_(kRemembered), early_(kEarly) {}

std::uint32_t InstanceSync::stated_answered(std::uint64_t answered) const noexcept {
  constexpr std::uint64_t kMost = std::numeric_limits<std::uint32_t>::max();
  return hangs_ ? 0 : static_cast<std::uint32_t>(std::min(answered, kMost));
}

bool InstanceSync::is_senior(const AnswerMark& a, const AnswerMark& b) noexcept {
  const auto length = [](const AnswerMark& mark) {
    return std::bit_width(mark.answered / kShortLine);
  };
  return length(a) != length(b) ? length(a) > length(b) : a.instance < b.instance;
}

bool InstanceSync::note(const AnswerMark& mine, std::int64_t now_ns) noexcept {
  if (is_alone()) return true;
  if (newest_) {
    answering_ns_ += std::clamp<std::int64_t>(now_ns - noted_ns_, 0, kLongestStep.count());
    if (newest_->run != mine.run) before_ = *newest_;
  }
  noted_ns_ = now_ns;
  newest_ = mine;
  own_[mine.sequence % kRemembered] = mine;
  const AnswerMark& early = early_[mine.sequence % kEarly];
  if (early.run == mine.run && early.sequence == mine.sequence) compare(mine, early);
  judge();
  return may_write();
}

void InstanceSync::tick(std::int64_t now_ns) noexcept {
  if (is_alone() || !newest_) return;
  if (!was_received(newest_->run, newest_->sequence))
    answering_ns_ += std::clamp<std::int64_t>(now_ns - noted_ns_, 0, kLongestTick.count());
  noted_ns_ = now_ns;
  judge();
}

void InstanceSync::judge() noexcept {
  if (!in_sync_ && !hangs_ && receives_nobody()) in_sync_ = true;
  const bool led = leads_;
  leads_ = would_lead();
  if (leads_ && !led) ++counts_.takeovers;
}

void InstanceSync::receive(const AnswerMark& other) noexcept {
  if (is_alone() || other.instance == *instance_ || other.instance >= kMostInstances) return;
  Peer& peer = peers_[other.instance];
  peer.newest = other;
  peer.received = true;
  peer.received_ns = answering_ns_;
  const bool is_late = other.run == before_.run && other.sequence <= before_.sequence;
  const bool is_elsewhere = newest_ && other.run != newest_->run && !is_late;
  peer.elsewhere = is_elsewhere ? peer.elsewhere + 1 : 0;
  if (peer.elsewhere >= kDifferingRun && in_sync_ && is_senior(other, *newest_)) fall_behind(false);
  const AnswerMark& mine = own_[other.sequence % kRemembered];
  if (mine.run == other.run && mine.sequence == other.sequence) return compare(mine, other);
  early_[other.sequence % kEarly] = other;
}

// One that is behind has not learned what the others have, so that its answers say nothing.
void InstanceSync::compare(const AnswerMark& mine, const AnswerMark& other) noexcept {
  if (!in_sync_) return;
  Peer& peer = peers_[other.instance];
  ++counts_.compared;
  if (mine.digest == other.digest) {
    peer.differing = 0;
    return;
  }
  ++counts_.differing;
  ++peer.differing;
  const std::uint64_t run = expects_change_ ? 1 : kDifferingRun;
  if (peer.differing >= run && is_senior(other, mine)) fall_behind(true);
}

void InstanceSync::fall_behind(bool keeps_line) noexcept {
  in_sync_ = false;
  keeps_line_ = keeps_line;
  expects_change_ = false;
  ++counts_.step_backs;
  for (Peer& peer : peers_) peer.differing = peer.elsewhere = 0;
}

bool InstanceSync::receives_nobody() const noexcept {
  const std::chrono::nanoseconds silence = keeps_line_ ? kSilentLeader : kNobodyElse;
  return answering_ns_ >= silence.count() &&
         std::all_of(peers_.begin(), peers_.end(),
                     [&](const Peer& peer) { return is_silent(peer, silence); });
}

// One that hangs writes where nobody better does; note() finds the only one in sync.
bool InstanceSync::may_write() const noexcept {
  return is_alone() || in_sync_ || (hangs_ && receives_nobody());
}

bool InstanceSync::would_lead() const noexcept {
  if (!may_write()) return false;
  for (std::uint32_t other = 0; other < *instance_; ++other) {
    if (!is_silent(peers_[other], kSilentLeader)) return false;
  }
  return true;
}

void InstanceSync::set_hangs(bool hangs) noexcept {
  if (is_alone() || hangs == hangs_) return;
  hangs_ = hangs;
  if (!hangs || !in_sync_ || !newest_) return;
  AnswerMark mine = *newest_;
  mine.answered = 0;
  const bool has_better = std::any_of(peers_.begin(), peers_.end(), [&](const Peer& peer) {
    return !is_silent(peer, kNobodyElse) && is_senior(peer.newest, mine);
  });
  if (has_better) fall_behind(false);
}

std::optional<std::uint32_t> InstanceSync::giver() const noexcept {
  if (is_alone() || in_sync_ || hangs_) return std::nullopt;
  const Peer* best = nullptr;
  for (const Peer& peer : peers_) {
    if (is_silent(peer, kNobodyElse)) continue;
    if (best == nullptr || is_senior(peer.newest, best->newest)) best = &peer;
  }
  if (best == nullptr) return std::nullopt;
  return best->newest.instance;
}

std::optional<std::uint64_t> InstanceSync::wanted_run() const noexcept {
  const auto from = giver();
  if (!from) return std::nullopt;
  return peers_[*from].newest.run;
}

void InstanceSync::caught_up() noexcept {
  in_sync_ = true;
  keeps_line_ = false;
  std::fill(own_.begin(), own_.end(), AnswerMark{});
  for (Peer& peer : peers_) peer.differing = peer.elsewhere = 0;
}

bool InstanceSync::was_received(std::uint64_t run, std::uint64_t sequence) const noexcept {
  return std::any_of(peers_.begin(), peers_.end(), [&](const Peer& peer) {
    const AnswerMark& newest = peer.newest;
    if (!peer.received || newest.run != run || sequence > newest.sequence) return false;
    return newest.answered == 0 || newest.sequence - sequence < newest.answered;
  });
}

}  // namespace zerodrift::service
