// SPDX-License-Identifier: Apache-2.0
// A topic of temperatures and whose they are, as it is named on a command line.
#pragma once

#include <optional>
#include <string>
#include <string_view>

namespace zerodrift::record {

// Which the configuration's defaults read.
inline constexpr const char* kUsualProbe = "coil";

struct ProbeTopic {
  std::string probe{};
  std::string topic{};
};

// "case=/imu/temperature", or a topic alone, which is that of kUsualProbe. Nothing where the probe
// isn't 1 to 32 letters, digits and '_', or the topic is empty.
[[nodiscard]] std::optional<ProbeTopic> parse_probe_topic(std::string_view text);

}  // namespace zerodrift::record
