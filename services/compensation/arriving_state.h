// SPDX-License-Identifier: Apache-2.0
// Another instance's state on its way in, a part after the other.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>

#include "common/dds/topics.h"

namespace zerodrift::services {

struct RunningState {
  std::uint64_t run = 0;       // of the raw samples
  std::uint64_t sequence = 0;  // the newest one in the state
  std::string bytes{};         // checkpoint::encode_running
};

class ArrivingState {
 public:
  // The state, with its last part. What doesn't follow the parts before is passed over.
  [[nodiscard]] std::optional<RunningState> take(const msg::CheckpointPart& part) {
    if (part.parts() > kMostParts) return std::nullopt;
    if (part.part() == 0) {
      from_ = part.instance();
      parts_ = 0;
      state_ = {.run = part.run_id(), .sequence = part.sequence_number()};
    }
    const bool follows = part.instance() == from_ && part.run_id() == state_.run &&
                         part.sequence_number() == state_.sequence && part.part() == parts_;
    if (!follows) return std::nullopt;
    state_.bytes.append(reinterpret_cast<const char*>(part.bytes().data()), part.bytes().size());
    if (++parts_ < part.parts()) return std::nullopt;
    return std::exchange(state_, {});
  }

 private:
  static constexpr std::uint32_t kMostParts = 4096;

  std::uint32_t from_ = 0;
  std::uint32_t parts_ = 0;  // so far
  RunningState state_{};
};

}  // namespace zerodrift::services
