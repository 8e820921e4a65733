// SPDX-License-Identifier: Apache-2.0
// What a supervisor (systemd, a container engine, an orchestrator) learns of a service, and
// when the service ends so that it is started again.
#pragma once

#include <CLI/CLI.hpp>
#include <chrono>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>

#include "common/dds/discovery.h"

namespace zerodrift::service {

struct Supervision {
  double peer_within_s = 0.0;  // nobody at the other end of the flow by then: exit code 1; 0: waits
  double stale_after_s = 2.0;  // a flow that had begun and is silent for longer is stale
  bool exit_when_stale = false;         // exit code 1 then
  std::filesystem::path health_file{};  // written once a second; empty: none
};

void add_supervision_options(CLI::App& app, Supervision& supervision);

// The samples that a service lives on: what it takes, or of a source what it gives.
struct Flow {
  std::string_view topic{};
  dds::Direction end = dds::Direction::kReader;  // this service's
  std::uint64_t samples = 0;                     // so far
  double interval_s = 0.0;  // between two samples, where that may be long; 0: short
  bool paced = false;       // by its consumers: their silence, not its own
};

// Watches a flow. Time is an argument, s of any clock that only grows.
class FlowWatch {
 public:
  enum class Verdict : std::uint8_t { kFine, kStale, kNobody };
  FlowWatch(const Supervision& supervision, double now_s)
      : supervision_(supervision), started_s_(now_s), moved_s_(now_s) {}
  // kStale: silent for longer than stale_after_s, or three intervals if that is longer, although
  // somebody is matched: who ends in order is not stale. kNobody: peer_within_s is over.
  // `peers`: endpoints at the other end, known now.
  Verdict judge(const Flow& flow, std::size_t peers, double now_s);
  [[nodiscard]] double silent_s(double now_s) const { return now_s - moved_s_; }

 private:
  Supervision supervision_;
  double started_s_;
  double moved_s_;
  std::uint64_t samples_ = 0;
  bool met_ = false;
};

// As a health file says it.
struct Health {
  std::int64_t monotonic_ns = 0;  // when
  std::int64_t process_id = 0;
  std::string service{};
  std::string state{};  // starting, waiting, running, degraded, stopping
  std::string summary{};
};

// In whole or not at all (written beside it and renamed). Throws std::runtime_error, one line with
// the file and the remedy.
void write_health(const std::filesystem::path& file, const Health& health);

// Throws std::runtime_error, one line, where it is not there or no health file.
Health read_health(const std::filesystem::path& file);

// Why that is not healthy at `now_ns` of CLOCK_MONOTONIC; empty: it is. Older than `at_most` means
// that the service hangs or is gone.
std::string why_unhealthy(const Health& health, std::int64_t now_ns,
                          std::chrono::duration<double> at_most);

}  // namespace zerodrift::service
