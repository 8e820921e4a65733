// SPDX-License-Identifier: Apache-2.0
// The messages of idl/dds that a record is made of, read from their bytes on the wire (plain CDR
// behind an encapsulation header, OMG DDSI-RTPS 2.3, 10.2) without any middleware.
#pragma once

#include <cstdint>
#include <optional>
#include <string_view>

#include "common/core/samples.h"

namespace zerodrift::record {

template <typename Sample>
struct OfGyro {
  std::uint32_t gyro_id = 0;
  Sample sample{};
};

// Nothing where the bytes are no such message, too few, or in another encoding than plain CDR. Says
// what dds::from_message() says of the same message, to the bit.
[[nodiscard]] std::optional<OfGyro<core::AngularRateSample>> decode_angular_rate(
    std::string_view payload) noexcept;
[[nodiscard]] std::optional<OfGyro<core::TemperatureSample>> decode_temperature(
    std::string_view payload);
[[nodiscard]] std::optional<OfGyro<core::EnvironmentSample>> decode_environment(
    std::string_view payload) noexcept;
[[nodiscard]] std::optional<OfGyro<core::RateReferenceSample>> decode_rate_reference(
    std::string_view payload) noexcept;

}  // namespace zerodrift::record
