// SPDX-License-Identifier: Apache-2.0
// How several instances tell each other's answers from their own: an instance writes in the
// partition that everybody reads and in one of its own, and reads those of the others.
#pragma once

#include <cstdint>
#include <string>

#include "common/dds/participant.h"
#include "common/service/hot_standby.h"

namespace zerodrift::services {

inline std::string partition_of(std::uint32_t instance) {
  return "instance_" + std::to_string(instance);
}

inline dds::Partitions partitions_of_others(std::uint32_t instance) {
  dds::Partitions partitions;
  for (std::uint32_t other = 0; other < service::kMostInstances; ++other) {
    if (other != instance) partitions.push_back(partition_of(other));
  }
  return partitions;
}

}  // namespace zerodrift::services
