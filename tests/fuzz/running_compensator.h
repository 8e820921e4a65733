// SPDX-License-Identifier: Apache-2.0
// A small compensator in mid-run, to be handed over.
#pragma once

#include <array>
#include <string>
#include <utility>

#include "common/checkpoint/checkpoint_bytes.h"
#include "tests/fuzz/small_compensation.h"

namespace zerodrift::fuzz {

inline constexpr std::uint32_t kRunningGyro = 7;
// After so many samples: new; with labels gathered; with a model, which is made from four.
inline constexpr std::array kMoments{0, 35, 75};

inline std::string data_path_of(compensation::Compensator& compensator) {
  std::string path;
  core::StateArchive archive(path);
  compensator.carry(archive);
  return path;
}

inline std::string state_of(compensation::Compensator& compensator,
                            const zerodrift::checkpoint::Owner& owner) {
  return zerodrift::checkpoint::encode_running(owner, compensator.learner().export_state(),
                                               data_path_of(compensator));
}

class RunningCompensator {
 public:
  RunningCompensator(bool with_prior, int samples)
      : options_(small_compensation(with_prior)), compensator_(options_) {
    for (int i = 1; i <= samples || !compensator_.is_quiescent(); ++i) {
      const core::SensorTime time = kSmallInterval * i;
      compensator_.push(good_temperature(time, i % 16));
      compensator_.push(good_rate(static_cast<std::uint64_t>(i), time, i % 7));
      answer_all(compensator_, [](const core::CompensatedSample&) {});
    }
  }

  [[nodiscard]] std::string data_path() { return data_path_of(compensator_); }
  // With any data path's part.
  [[nodiscard]] std::string state(std::string data_path) {
    return zerodrift::checkpoint::encode_running(
        {kRunningGyro, options_}, compensator_.learner().export_state(), std::move(data_path));
  }

 private:
  compensation::CompensationOptions options_;
  compensation::Compensator compensator_;
};

}  // namespace zerodrift::fuzz
