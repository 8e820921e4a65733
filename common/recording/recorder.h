// SPDX-License-Identifier: Apache-2.0
// A recorder on its own participant: all topics as they are on the wire, in MCAP files.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include "common/dds/participant.h"
#include "common/recording/disk_writer.h"

namespace zerodrift::recording {

struct McapRecordOptions {
  dds::NetworkOptions network{};
  DiskWriterOptions disk{};
  std::vector<std::string> topics{};  // empty: all
  std::uint32_t gyro_id = 0;          // 0: all
  std::uint64_t samples = 0;          // of compensated_rate; 0: until a stop signal
  double duration_s = 0.0;            // 0: until a stop signal
  std::string trigger{};              // an event's code; empty: any of severity warning or error
  std::size_t queue_bytes = std::size_t{64} << 20U;
};

// Until a stop signal, or until there is what was asked for. Exit code: no where a message was
// lost, or fewer samples came than asked for. Throws with one line where it can't begin.
int record_mcap(const McapRecordOptions& options);

}  // namespace zerodrift::recording
