// SPDX-License-Identifier: Apache-2.0
// Whether the compensation is given its own output for raw rates: then what it takes off comes back
// with the opposite sign, and it corrects twice.
//
// The true drift never answers to what is taken off it. So each step of the applied drift that is
// large beside the noise is a question: the mean of three seconds after it, less that of three
// seconds before, is 0 of raw rates, and the step's negative of corrected ones, give or take a
// quarter. The step's own second and two after it are left out, for the way round. Three such
// answers, and none in between where the rate stayed, are the verdict; one where it stayed takes it
// back. What neither stays nor answers (a turn), or goes on as a ramp does, is no answer; a rate
// that steps by as much where nothing asked makes the count begin anew: it does so by itself. Of a
// drift that is first taken off an answer within a 64th is as rare by chance as three others, and
// is the verdict: what it leaves behind the rest gate takes for motion, for drift / 0.05 deg/h
// seconds. Steps that are small beside the noise ask nothing. A rate that falls by all that is
// taken off, within a 64th, is what a loop that closes looks like: the next answer is the verdict.
//
// O(1) a sample, no allocation.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "common/core/axis.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

class OwnOutputCheck {
 public:
  // Of a sample: what came in, and what was being taken off, rad/s.
  void add(core::Axis axis, double rate_radps, double applied_radps) noexcept;
  // The block of about a second is over. `block_sigma_radps`: noise of a block's mean; 0: unknown.
  void close(const core::PerAxis<double>& block_sigma_radps) noexcept;
  // The time began anew, or a sample is missing; verdicts stay.
  void restart() noexcept;

  [[nodiscard]] bool is_own(core::Axis axis) const noexcept { return axes_[core::index(axis)].own; }
  // How often an axis was found to be given its own output that was not before.
  [[nodiscard]] std::uint64_t found() const noexcept { return found_; }

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(axes_, found_); }

 private:
  static constexpr std::size_t kBlocks = 9;  // three before the step, its own and two, three after
  struct Axis {
    std::uint64_t samples = 0;
    double rate = 0.0;
    double applied = 0.0;
    std::array<double, kBlocks> rates{};  // means of the newest blocks, oldest first
    std::array<double, kBlocks> taken{};
    std::uint64_t blocks = 0;
    std::uint64_t votes = 0;
    double asked = 0.0;  // size of the newest step that asked
    bool own = false;

    void carry(core::StateArchive& archive) {
      archive(samples, rate, applied, rates, taken, blocks, votes, asked, own);
    }
  };
  void judge(Axis& axis, double block_sigma_radps) noexcept;

  core::PerAxis<Axis> axes_{};
  std::uint64_t found_ = 0;
};

}  // namespace zerodrift::compensation
