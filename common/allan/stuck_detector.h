// SPDX-License-Identifier: Apache-2.0
// Tells a frozen output from a quantised one: both repeat values to the bit.
//
// Values of a living sensor that differ from their predecessor with the chance 1 - p make runs of
// equal values with P(run reaches n) = p^(n-1). p is what this stream has shown so far. A run is
// called stuck when it is longer than all of
//   - min_run (a second at 200 Hz),
//   - the n with p^(n-1) = false_alarm_probability,
//   - longest_run_factor times the longest run seen alive, for streams whose repeats come in
//     clusters (a quantised slow signal), where the runs are not geometric,
// or when it is longer than max_run in any case. A real MEMS gyro of 0.05 deg/s resolution with 5
// steps of noise (ADIS16405) has p = 0.06 and a longest run of about 6 in a million; a gyro that
// counts coarse pulses at rest may have p = 0.99 and is alive with runs of hundreds. Runs that were
// called stuck teach nothing. Works on rates and on angle increments (all zero = one value), not on
// an accumulated angle.
#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace zerodrift::allan {

struct StuckDetectorOptions {
  std::uint64_t min_run = 200;             // samples
  std::uint64_t max_run = 12000;           // samples; a minute at 200 Hz
  double false_alarm_probability = 1e-12;  // for each sample: 0.6 % in a year at 200 Hz
  double longest_run_factor = 4.0;

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

class StuckDetector {
 public:
  enum class Output : std::uint8_t { kAlive, kStuck };

  // Throws std::invalid_argument with validate()'s sentence.
  explicit StuckDetector(const StuckDetectorOptions& options = {});

  // Next value; kStuck from the sample at which the run is too long until the value changes. A
  // value that is not a number counts as missing: it neither ends a run nor makes it longer. O(1),
  // no allocation.
  Output add(double value) noexcept;

  [[nodiscard]] Output output() const noexcept { return output_; }
  [[nodiscard]] std::uint64_t run() const noexcept { return run_; }  // equal values in a row

  // p: share of the values seen alive that repeated their predecessor, (repeats + 1) / (values +
  // 2).
  [[nodiscard]] double repeat_probability() const noexcept;

  // Shortest run that would be called stuck now.
  [[nodiscard]] std::uint64_t stuck_run() const noexcept;

 private:
  void learn_finished_run() noexcept;

  StuckDetectorOptions options_;
  Output output_ = Output::kAlive;
  double value_ = 0.0;
  std::uint64_t run_ = 0;
  std::uint64_t repeats_ = 0;      // of finished runs that were alive
  std::uint64_t changes_ = 0;      // ... their number
  std::uint64_t longest_run_ = 0;  // ... the longest
};

}  // namespace zerodrift::allan
