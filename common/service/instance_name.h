// SPDX-License-Identifier: Apache-2.0
// What the instances of the compensation are called: "compensation", or "compensation/2" of one
// that has a number.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

namespace zerodrift::service {

inline constexpr const char* kCompensation = "compensation";

[[nodiscard]] inline std::string instance_name(std::uint32_t instance) {
  return instance == 0 ? kCompensation
                       : std::string(kCompensation) + "/" + std::to_string(instance);
}

[[nodiscard]] inline bool is_compensation(std::string_view service) noexcept {
  if (!service.starts_with(kCompensation)) return false;
  service.remove_prefix(std::string_view(kCompensation).size());
  return service.empty() || service.front() == '/';
}

}  // namespace zerodrift::service
