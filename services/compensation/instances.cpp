// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/instances.h"

#include <bit>
#include <string>

namespace zerodrift::services {
namespace {

class Digest {
 public:
  void add(std::uint64_t value) noexcept {
    value_ = (value_ ^ value) * 0x9e3779b97f4a7c15;
    value_ ^= value_ >> 29U;
  }
  template <typename Values>
  void add_all(const Values& values) noexcept {
    for (const auto value : values) {
      if constexpr (sizeof(value) == sizeof(std::uint64_t)) {
        add(std::bit_cast<std::uint64_t>(value));
      } else {
        add(static_cast<std::uint64_t>(value));
      }
    }
  }
  [[nodiscard]] std::uint64_t value() const noexcept { return value_; }

 private:
  std::uint64_t value_ = 0;
};

std::string partition_of(std::uint32_t instance) {
  return "instance_" + std::to_string(instance);
}

}  // namespace

dds::Partitions partitions_to_write(std::uint32_t instance) {
  return {"", partition_of(instance)};
}

dds::Partitions partitions_of_others(std::uint32_t instance) {
  dds::Partitions partitions;
  for (std::uint32_t other = 0; other < service::kMostInstances; ++other) {
    if (other != instance) partitions.push_back(partition_of(other));
  }
  return partitions;
}

service::AnswerMark mark_of(const msg::CompensatedRate& answer) noexcept {
  Digest digest;
  digest.add(static_cast<std::uint64_t>(answer.sensor_time_ns()));
  digest.add(answer.model_epoch());
  digest.add_all(answer.mode());
  digest.add_all(answer.reason());
  digest.add_all(answer.rung());
  digest.add_all(answer.rate_radps());
  digest.add_all(answer.applied_drift_radps());
  digest.add_all(answer.drift_variance_radps2());
  digest.add_all(answer.rate_covariance_radps2());
  return {.instance = answer.instance(),
          .answered = answer.answered(),
          .run = answer.run_id(),
          .sequence = answer.sequence_number(),
          .digest = digest.value()};
}

}  // namespace zerodrift::services
