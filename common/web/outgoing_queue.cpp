// SPDX-License-Identifier: Apache-2.0
#include "common/web/outgoing_queue.h"

#include <algorithm>
#include <utility>

namespace zerodrift::web {
namespace {

bool is_sample(const Frame& frame) {
  return frame.importance == Frame::Importance::kSample;
}

}  // namespace

OutgoingQueue::Held& OutgoingQueue::held(const Frame& frame) {
  return is_sample(frame) ? samples_ : states_;
}

OutgoingQueue::Pushed OutgoingQueue::push(Frame frame) {
  if (frame.replaces != 0) {
    const auto known = replaceable_.find(frame.replaces);
    if (known != replaceable_.end()) {
      Held& of = held(*known->second);
      of.bytes += frame.size();
      of.bytes -= known->second->size();
      *known->second = std::move(frame);
      return Pushed::kWaits;
    }
  }
  Held& of = held(frame);
  ++of.frames;
  of.bytes += frame.size();
  const bool drops = is_sample(frame);
  const std::uint64_t key = frame.replaces;
  const auto at = waiting_.insert(waiting_.end(), std::move(frame));
  if (key != 0) replaceable_[key] = at;
  if (drops) {
    waiting_samples_.push_back(at);
    drop_oldest_samples();
    return Pushed::kWaits;
  }
  const bool fits =
      of.frames <= limits_.state_frames && (of.bytes <= limits_.state_bytes || of.frames == 1);
  return fits ? Pushed::kWaits : Pushed::kTooMuchState;
}

void OutgoingQueue::drop_oldest_samples() {
  while (samples_.frames > limits_.sample_frames ||
         (samples_.bytes > limits_.sample_bytes && samples_.frames > 1)) {
    take_out(waiting_samples_.front());
    waiting_samples_.pop_front();
    ++dropped_;
  }
}

void OutgoingQueue::take_out(Waiting::iterator at) {
  Held& of = held(*at);
  --of.frames;
  of.bytes -= at->size();
  if (at->replaces != 0) replaceable_.erase(at->replaces);
  waiting_.erase(at);
}

std::optional<Frame> OutgoingQueue::pop() {
  if (waiting_.empty()) return std::nullopt;
  Frame frame = waiting_.front();
  if (is_sample(frame)) waiting_samples_.pop_front();
  take_out(waiting_.begin());
  return frame;
}

double OutgoingQueue::fill() const {
  const auto share = [](std::size_t held, std::size_t limit) {
    return static_cast<double>(held) / static_cast<double>(limit);
  };
  return std::min(1.0, std::max({share(samples_.frames, limits_.sample_frames),
                                 share(samples_.bytes, limits_.sample_bytes),
                                 share(states_.frames, limits_.state_frames),
                                 share(states_.bytes, limits_.state_bytes)}));
}

}  // namespace zerodrift::web
