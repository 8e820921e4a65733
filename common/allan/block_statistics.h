// SPDX-License-Identifier: Apache-2.0
// Mean and spread of the means over consecutive blocks of a stream: what drift does once white
// noise is averaged out. A block counts where at least four fifths of its samples are there, as the
// mean of these.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/span.h"

namespace zerodrift::allan {

// Of a block's samples, that must be there for it to count.
inline constexpr double kShareOfBlock = 0.8;

struct BlockStatisticsOptions {
  double sample_interval_s = 0.005;
  double block_s = 60.0;     // rounded to whole samples
  double window_s = 3600.0;  // rolling window, rounded up to whole blocks

  // Names the first wrong key.
  [[nodiscard]] std::optional<std::string> validate() const;
};

struct BlockMoments {
  std::uint64_t blocks = 0;
  double mean = 0.0;                // of the block means; 0 without any
  double standard_deviation = 0.0;  // sample standard deviation (n - 1); 0 below two blocks
  // Since start: of the mean of a block less that of the block just before it; 0 without such two.
  double step_rms = 0.0;
  std::uint64_t steps = 0;  // of which that is; since start
};

class BlockStatistics {
 public:
  // Throws std::invalid_argument with validate()'s sentence. All memory is taken here: 8 bytes a
  // block of the window.
  explicit BlockStatistics(const BlockStatisticsOptions& options);

  // Next sample. O(1), no allocation. A value that is not finite counts as one missing sample.
  void add(double value) noexcept;

  // Time passed without that many samples. O(blocks of the window) at worst.
  void gap(std::uint64_t missing_samples) noexcept;

  // kRolling: the last window_s of blocks that count. O(blocks of the window), in two passes; since
  // start by Welford's recurrence, O(1).
  [[nodiscard]] BlockMoments moments(Span span) const noexcept;

  [[nodiscard]] double block_s() const noexcept;

 private:
  void close_block() noexcept;
  [[nodiscard]] BlockMoments rolling_moments() const noexcept;

  double sample_interval_s_;
  std::uint64_t block_samples_;
  std::vector<double> means_;  // ring of the last blocks, NaN where one does not count
  std::size_t next_ = 0;

  double sum_ = 0.0;            // of the open block
  std::uint64_t position_ = 0;  // in the open block, missing samples included
  std::uint64_t valid_ = 0;

  std::uint64_t blocks_ = 0;  // since start
  double mean_ = 0.0;
  double squares_ = 0.0;  // about the mean
  double last_mean_;      // of the block before the open one, NaN where it does not count
  std::uint64_t steps_ = 0;
  double step_squares_ = 0.0;
};

}  // namespace zerodrift::allan
