// SPDX-License-Identifier: Apache-2.0
// Whether a prior makes the changes of an axis's drift larger than they are.
//
// Each time the prior has moved by dp, large beside the noise of labels, the drift has moved by dy:
// with the prior dy - dp is left to learn, without it dy, so that the prior costs where
// dy / dp < 1/2. That ratio, of 0 to 1 since more says no more, has to be four standard errors of
// its mean below 1/2 both where the prior rose and where it fell: a drift that goes one way by
// itself (warm-up, a walk) speaks against the prior in one of the two only. So a temperature has
// to go and to come back, and a prior that hardly moves, or is too small, isn't judged.
//
// O(1) a label, no allocation.
#pragma once

#include <array>
#include <cstdint>
#include <optional>

#include "common/core/axis.h"
#include "common/core/state_archive.h"

namespace zerodrift::compensation {

class PriorCheck {
 public:
  // Of a label: the drift as measured, the prior's part of it, rad/s, and the label's variance,
  // (rad/s)².
  void add(core::Axis axis, double drift_radps, double prior_radps, double variance) noexcept;
  // The time began anew, and the bias may be another; what was found stays.
  void restart() noexcept;

  // How many axes' prior was found to cost.
  [[nodiscard]] std::uint64_t found() const noexcept;

  // Its state (core/state_archive.h).
  void carry(core::StateArchive& archive) { archive(axes_); }

 private:
  struct Cost {
    double sum = 0.0;  // of 1/2 less the ratio
    double squares = 0.0;

    [[nodiscard]] bool is_certain() const noexcept;
    void carry(core::StateArchive& archive) { archive(sum, squares); }
  };
  struct Axis {
    std::optional<double> prior_before{};  // where it last moved, and the drift then
    double drift_before = 0.0;
    Cost rising{};
    Cost falling{};
    bool costs = false;

    void carry(core::StateArchive& archive) {
      archive(prior_before, drift_before, rising, falling, costs);
    }
  };

  core::PerAxis<Axis> axes_{};
};

}  // namespace zerodrift::compensation
