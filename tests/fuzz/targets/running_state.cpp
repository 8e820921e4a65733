// SPDX-License-Identifier: Apache-2.0
// Input: one byte that says what the rest is. f: a running compensator's whole state, as it is
// handed to a standby. m or d: changes to such a state, which is too large and too dull for a
// fuzzer; m to the message (proto::Checkpoint), d to the data path's part of it. The envelope and,
// for d, owner, options and learner are put to it, so that a fuzzer gets past the CRC and every
// check before. F, M and D: the same for a compensator with a prior. Changes: a byte, the moment
// (kMoments) of what is changed; then, again and again, two bytes, where (little-endian, modulo the
// size), one byte, how many, and as many bytes to be put there. None: the state ends there.
#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <memory>
#include <string>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"
#include "tests/fuzz/checkpoint_envelope.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/running_compensator.h"

namespace zerodrift::fuzz {
namespace {

using compensation::Compensator;
using core::CompensatedSample;

constexpr int kSamples = 40;  // long enough for labels, confirmed and learned

std::string changed(std::string bytes, Bytes changes) {
  constexpr std::size_t kHead = 3;
  while (changes.size() >= kHead && !bytes.empty()) {
    const std::size_t at = (std::size_t{changes[0]} | std::size_t{changes[1]} << 8U) % bytes.size();
    const std::size_t count = std::min<std::size_t>(changes[2], changes.size() - kHead);
    const Bytes put = changes.subspan(kHead, count);
    changes = changes.subspan(kHead + count);
    if (count == 0) return bytes.substr(0, at);
    for (std::size_t i = 0; i < std::min(count, bytes.size() - at); ++i)
      bytes[at + i] = static_cast<char>(put[i]);
  }
  return bytes;
}

RunningCompensator& at_moment(std::size_t moment, bool with_prior) {
  static std::array<std::array<std::unique_ptr<RunningCompensator>, kMoments.size()>, 2> kept;
  auto& one = kept[with_prior ? 1 : 0][moment];
  if (!one) one = std::make_unique<RunningCompensator>(with_prior, kMoments[moment]);
  return *one;
}

std::string made_up(char way, Bytes input, bool with_prior) {
  if ((way != 'm' && way != 'd') || input.empty()) return std::string(as_text(input));
  RunningCompensator& from = at_moment(input.front() % kMoments.size(), with_prior);
  const Bytes changes = input.subspan(1);
  if (way == 'd') return from.state(changed(from.data_path(), changes));
  const std::string whole = from.state(from.data_path());
  return in_envelope(changed(whole.substr(checkpoint::kEnvelopeSize), changes));
}

// A standby that took the state answers the samples after it, and can hand its own state on: what
// was made up may be refused there (sample_stream says that nothing else is).
void go_on(Compensator& compensator, const checkpoint::Owner& owner) {
  const std::uint64_t answered = compensator.counts().samples_out;
  std::uint64_t admitted = 0;
  for (int i = 1; i <= kSamples; ++i) {
    if (i == kSamples / 2) compensator.restart_stream();
    const auto sequence = static_cast<std::uint64_t>(kMoments.back() + i);
    const core::SensorTime time = kSmallInterval * (kMoments.back() + i);
    compensator.push(good_temperature(time, i));
    const auto admission = compensator.push(good_rate(sequence, time, i));
    if (admission == compensation::Admission::kInOrder ||
        admission == compensation::Admission::kLate) {
      ++admitted;
    }
    answer_all(compensator, [](const CompensatedSample& sample) {
      for (const double drift : sample.applied_drift_radps)
        demand(std::isfinite(drift), "what is taken off is a number");
    });
  }
  compensator.give_up_waiting();
  demand(compensator.counts().samples_out - answered == admitted,
         "each sample that was admitted is answered once");
  if (compensator.is_quiescent()) static_cast<void>(state_of(compensator, owner));
}

}  // namespace

void running_state(Bytes input) {
  if (input.empty()) return;
  const auto first = input.front();
  const bool with_prior = std::isupper(first) != 0;
  const auto way = static_cast<char>(std::tolower(first));
  const auto options = small_compensation(with_prior);
  const checkpoint::Owner owner{kRunningGyro, options};
  try {
    const auto compensator =
        checkpoint::decode_running(made_up(way, input.subspan(1), with_prior), owner);
    go_on(*compensator, owner);
  } catch (const checkpoint::CheckpointError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
