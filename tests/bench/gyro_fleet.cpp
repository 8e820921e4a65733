// SPDX-License-Identifier: Apache-2.0
#include "tests/bench/gyro_fleet.h"

#include <time.h>

#include <algorithm>
#include <iostream>
#include <memory>
#include <sstream>
#include <vector>

#include "common/service/main.h"
#include "common/service/monotonic_clock.h"
#include "tests/bench/bench_sample.h"

namespace zerodrift::bench {
namespace {

class Fleet {
 public:
  explicit Fleet(const GyroFleetOptions& options) : participant_("gyro_fleet", options.network) {
    for (std::uint32_t i = 0; i < options.gyros; ++i) {
      writers_.push_back(std::make_unique<dds::Writer<msg::AngularRate>>(participant_));
    }
  }

  std::string obey(const std::string& line) {
    std::istringstream words(line);
    std::string command;
    words >> command;
    if (command == "ready") return ready() ? "yes" : "no";
    if (command != "send") return "unknown command";
    double rate_hz = 0.0;
    std::uint64_t count = 0;
    words >> rate_hz >> count;
    send(rate_hz, count);
    return std::to_string(sequence_) + ' ' + std::to_string(refused_);
  }

 private:
  [[nodiscard]] bool ready() const {
    return std::all_of(writers_.begin(), writers_.end(),
                       [](const auto& writer) { return writer->matched() > 0; });
  }

  // The gyros' samples are spread over the period, as those of gyros without a common trigger are.
  void send(double rate_hz, std::uint64_t count) {
    constexpr std::int64_t kSecond = 1000000000;
    const double step_ns = 1e9 / rate_hz / static_cast<double>(writers_.size());
    const std::int64_t start_ns = service::monotonic_ns();
    double due_ns = 0.0;
    for (std::uint64_t i = 0; i < count; ++i) {
      ++sequence_;
      for (std::size_t gyro = 0; gyro < writers_.size(); ++gyro) {
        due_ns += step_ns;
        const std::int64_t until_ns = start_ns + static_cast<std::int64_t>(due_ns);
        const timespec until{until_ns / kSecond, until_ns % kSecond};
        while (clock_nanosleep(CLOCK_MONOTONIC, TIMER_ABSTIME, &until, nullptr) != 0) {
        }
        // The time it was due, not the time it was written: a publisher that falls behind is late.
        auto sample = synthetic_sample(static_cast<std::uint32_t>(gyro + 1), sequence_, until_ns,
                                       1.0 / rate_hz);
        if (!writers_[gyro]->write(sample)) ++refused_;
      }
    }
  }

  dds::Participant participant_;
  std::vector<std::unique_ptr<dds::Writer<msg::AngularRate>>> writers_;
  std::uint64_t sequence_ = 0;
  std::uint64_t refused_ = 0;
};

}  // namespace

int run_gyro_fleet(const GyroFleetOptions& options) {
  Fleet fleet(options);
  for (std::string line; std::getline(std::cin, line);) {
    std::cout << fleet.obey(line) << std::endl;
  }
  return service::kExitDone;
}

}  // namespace zerodrift::bench
