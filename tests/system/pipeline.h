// SPDX-License-Identifier: Apache-2.0
// The main job as a test runs it: publishers -> compensation -> monitor and recorder.
#pragma once

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <string>

#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {

struct Live {
  Arguments source{};  // of both publishers
  Arguments gyro{};    // of the gyro publisher alone
  Arguments compensation{};
  std::uint64_t samples = 0;
  std::filesystem::path out{};
  std::chrono::milliseconds at_most{60000};
};

// The whole live run; every process must end with exit code 0 (a failure of the test otherwise).
void run_live(SystemUnderTest& system, const Live& live);

// `zerodrift compensate` on a record; options as "--columns".
void run_offline(SystemUnderTest& system, const std::filesystem::path& record,
                 const std::filesystem::path& out, const Arguments& options = {});

struct Simulation {
  std::filesystem::path model =
      std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/models/paper_fog.yaml";
  std::filesystem::path profile{};
  int seed = 1;
  int rate_hz = 200;
  [[nodiscard]] Arguments arguments() const;  // without the rate, which only a gyro has
};

// `zerodrift simulate`; options as "--reference".
void simulate(SystemUnderTest& system, const Simulation& simulation,
              const std::filesystem::path& out, const Arguments& options = {});

// A chamber that ramps by 1 °C/min from the start, so that there is drift to learn within minutes.
// `more` is YAML appended to the profile.
std::filesystem::path write_ramp_profile(const SystemUnderTest& system, int duration_s,
                                         const std::string& more = "");

}  // namespace zerodrift::system_test
