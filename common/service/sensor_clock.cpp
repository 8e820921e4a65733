// SPDX-License-Identifier: Apache-2.0
#include "common/service/sensor_clock.h"

#include <sys/timex.h>

#include <cstdlib>
#include <string>

#include "common/service/host.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::service {
namespace {

constexpr int kTries = 8;
constexpr std::int64_t kHeldUpNs = 1'000'000;

bool is_within(std::int64_t a_ns, std::int64_t b_ns, std::chrono::nanoseconds span) noexcept {
  return std::abs(a_ns - b_ns) <= span.count();
}

}  // namespace

std::optional<ClockReading> read_clocks() noexcept {
  for (int tried = 0; tried < kTries; ++tried) {
    const std::int64_t before_ns = monotonic_ns();
    const std::int64_t unix_ns = unix_time_ns();
    const std::int64_t after_ns = monotonic_ns();
    if (after_ns - before_ns < kHeldUpNs)
      return ClockReading{.monotonic_ns = before_ns + (after_ns - before_ns) / 2,
                          .unix_ns = unix_ns};
  }
  return std::nullopt;
}

ClockReading await_clocks() noexcept {
  for (;;) {
    if (const auto now = read_clocks()) return *now;
  }
}

SensorClock::Look SensorClock::look(const ClockReading& now) noexcept {
  const std::int64_t offset_ns = now.unix_ns - now.monotonic_ns;
  const std::chrono::nanoseconds step{offset_ns - offset_ns_};
  if (is_within(offset_ns, offset_ns_, kSmallestStep)) {
    doubt_.reset();
    reported_unsteady_ = false;
    return {};
  }
  if (!doubt_) elsewhere_since_ns_ = now.monotonic_ns;
  if (!doubt_ || !is_within(offset_ns, doubt_->offset_ns, kConfirmWithin)) {
    doubt_ = {.offset_ns = offset_ns, .since_ns = now.monotonic_ns};
  } else if (now.monotonic_ns - doubt_->since_ns >=
             std::chrono::nanoseconds(kConfirmAfter).count()) {
    offset_ns_ = offset_ns;
    doubt_.reset();
    reported_unsteady_ = false;
    return {.verdict = Verdict::kStepped, .step = step};
  }
  const bool is_long =
      now.monotonic_ns - elsewhere_since_ns_ >= std::chrono::nanoseconds(kUnsteadyAfter).count();
  if (!is_long || reported_unsteady_) return {.verdict = Verdict::kDoubted, .step = step};
  reported_unsteady_ = true;
  return {.verdict = Verdict::kUnsteady, .step = step};
}

bool follow_wall_clock(SensorClock& clock, Host& host, std::uint32_t gyro_id) {
  const auto now = read_clocks();
  if (!now) return false;
  const SensorClock::Look look = clock.look(*now);
  const bool is_stepped = look.verdict == SensorClock::Verdict::kStepped;
  if (!is_stepped && look.verdict != SensorClock::Verdict::kUnsteady) return false;
  const std::string by_s = std::to_string(core::seconds(look.step)) + " s";
  host.raise({.code = is_stepped ? "clock_stepped" : "clock_unsteady",
              .severity = Severity::kWarning,
              .text = is_stepped ? "the wall clock was stepped by " + by_s +
                                       "; sensor time follows it, the stream starts anew"
                                 : "the wall clock runs at another pace than the monotonic one, " +
                                       by_s + " off; sensor time doesn't follow it",
              .gyro_id = gyro_id,
              .sensor_time_ns = clock.at(now->monotonic_ns).count()});
  return is_stepped;
}

ClockDiscipline discipline_of(int state, int status, std::int64_t offset) noexcept {
  if (state < 0) return {};
  if (state == TIME_ERROR || (status & STA_UNSYNC) != 0)
    return {.lock = ClockDiscipline::Lock::kFree};
  constexpr std::int64_t kNsPerUs = 1000;
  return {.lock = ClockDiscipline::Lock::kLocked,
          .offset_ns = (status & STA_NANO) != 0 ? offset : offset * kNsPerUs};
}

ClockDiscipline clock_discipline() noexcept {
  timex now{};  // modes = 0: only asked
  const int state = ::adjtimex(&now);
  return discipline_of(state, now.status, now.offset);
}

}  // namespace zerodrift::service
