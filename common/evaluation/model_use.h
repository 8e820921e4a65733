// SPDX-License-Identifier: Apache-2.0
// Whether a model ever compensated a record, and one that goes by temperature; if not, why not and
// what would be right.
#pragma once

#include <array>
#include <cstdint>
#include <string>

#include "common/compensation/options.h"
#include "common/core/compensated_sample.h"

namespace zerodrift::evaluation {

class ModelUse {
 public:
  void add(const core::CompensatedSample& sample) noexcept;

  [[nodiscard]] bool is_measured(core::Axis axis) const noexcept {
    return axes_[core::index(axis)].measured;
  }
  // A learned model, or a prior, has compensated at least one sample.
  [[nodiscard]] bool came_into_force(core::Axis axis) const noexcept;
  // Share of the samples that measured a rate which a learned model compensated.
  [[nodiscard]] double learned_share(core::Axis axis) const noexcept;
  // Where none came into force on any measured axis, or none that goes by temperature: a line that
  // says so, the commonest reason of its samples and what would be right; else nothing. `options`:
  // those the record was compensated with.
  [[nodiscard]] std::string line_of_none(const std::string& record,
                                         const compensation::CompensationOptions& options) const;

 private:
  struct Axis {
    bool measured = false;
    bool goes_by_temperature = false;  // a model did, once at least
    std::uint64_t samples = 0;
    std::array<std::uint64_t, core::kRungs> rungs{};
    std::array<std::uint64_t, core::kReasons> reasons{};
  };
  [[nodiscard]] core::Reason commonest_reason() const noexcept;
  [[nodiscard]] std::string remedy_of(core::Reason reason, const std::string& record,
                                      const compensation::CompensationOptions& options) const;

  core::PerAxis<Axis> axes_;
  core::SensorTime first_{core::kNever};
  core::SensorTime last_{core::kNever};
  double interval_s_ = 0.0;  // of the first sample
};

}  // namespace zerodrift::evaluation
