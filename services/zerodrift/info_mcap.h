// SPDX-License-Identifier: Apache-2.0
// What an MCAP file holds, read from its first to its last byte.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "common/mcap/mcap_reader.h"
#include "common/measurement/plausibility.h"
#include "services/zerodrift/provenance.h"

namespace zerodrift::services {

// One channel: a topic, or one gyro or one of its probes on it.
struct ChannelSummary {
  std::string topic{};
  std::string gyro_id{};  // as in the channel's metadata; empty: not said
  std::string probe{};
  std::string schema{};
  std::uint64_t messages = 0;
  std::uint64_t bytes = 0;  // of payloads
  std::uint64_t first_ns = 0;
  std::uint64_t last_ns = 0;
  // Of topics whose sequence numbers count up by one; at the source a sample may be missing, too.
  std::uint64_t gaps = 0;
  std::uint64_t missing = 0;
  std::uint64_t backward = 0;  // numbers that were not after the one before
  // By sensor times of what was measured, else by log times. None of messages that came in one
  // burst and don't say when they were measured.
  std::optional<double> rate_hz{};
};

struct McapSummary {
  std::string file{};
  std::uint64_t bytes = 0;
  std::string library{};
  mcap::Ending ending = mcap::Ending::kWhole;
  double duration_s = 0.0;  // by log times, without what their clock was set by
  std::uint64_t messages = 0;
  std::uint64_t chunks = 0;
  std::string compression{};
  double compression_ratio = 1.0;
  std::vector<ChannelSummary> channels{};
  std::vector<mcap::Attachment> attachments{};
  std::vector<mcap::Metadata> metadata{};
  std::vector<measurement::Doubt> doubts{};  // of each gyro's record
  std::vector<std::string> findings{};       // what is damaged or left out, a line each
  std::vector<std::string> warnings{};       // of log times that go back or jump, a line each
  // Messages that the recorder said it lost; where it could say nothing, those that are missing
  // between the numbers of the channels.
  std::uint64_t lost = 0;
};

// O(file). Throws McapError.
[[nodiscard]] McapSummary summarise(const std::string& file);

// Prints it, and writes it to `json` unless that is empty. Exit code: no where anything is damaged
// or lost, or the file was cut.
int show_mcap(const std::string& file, const std::string& json, const Invocation& made_by);

}  // namespace zerodrift::services
