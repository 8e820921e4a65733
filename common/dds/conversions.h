// SPDX-License-Identifier: Apache-2.0
// Between the domain types of common/ and the generated message types, which end here. Every value
// is carried bit for bit; a value that can be no rate (core::is_rate) makes its axis invalid and is
// never learned from.
#pragma once

#include <cstdint>

#include "common/core/compensated_sample.h"
#include "common/core/samples.h"
#include "common/dds/topics.h"

namespace zerodrift::dds {

msg::AngularRate to_message(const core::AngularRateSample& sample, std::uint32_t gyro_id,
                            std::int64_t publish_time_ns);
core::AngularRateSample from_message(const msg::AngularRate& message) noexcept;

msg::Temperature to_message(const core::TemperatureSample& sample, std::uint32_t gyro_id);
core::TemperatureSample from_message(const msg::Temperature& message);

msg::Environment to_message(const core::EnvironmentSample& sample, std::uint32_t gyro_id);
core::EnvironmentSample from_message(const msg::Environment& message) noexcept;

msg::RateReference to_message(const core::RateReferenceSample& sample, std::uint32_t gyro_id);
core::RateReferenceSample from_message(const msg::RateReference& message) noexcept;

// In place, so that the data path reuses one message.
void to_message(const core::CompensatedSample& sample, std::uint32_t gyro_id,
                std::uint32_t instance, msg::CompensatedRate& message) noexcept;
core::CompensatedSample from_message(const msg::CompensatedRate& message) noexcept;

}  // namespace zerodrift::dds
