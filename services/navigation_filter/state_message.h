// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <cstdint>

#include "common/dds/topics.h"
#include "common/navigation/gyro_navigation.h"

namespace zerodrift::services {

// What is published of one stream.
msg::NavigationState to_message(const navigation::GyroNavigation& navigation,
                                navigation::Stream stream, std::uint32_t gyro_id,
                                navigation::BodyFrame frame);

}  // namespace zerodrift::services
