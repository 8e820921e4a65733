// SPDX-License-Identifier: Apache-2.0
// Where each gyro's model has learned, on its topic: written whenever another model is in force.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <vector>

#include "common/dds/participant.h"
#include "common/service/host.h"
#include "services/compensation/gyro.h"

namespace zerodrift::services {

class CoverageReports {
 public:
  CoverageReports(service::Host& host, std::size_t most_gyros)
      : writer_(host.participant(), host.observer()) {
    seen_.reserve(most_gyros);
  }

  // Samples of the gyro wait meanwhile: copies what is new of one that this instance leads.
  void look_at(const Gyro& gyro);
  void publish();

 private:
  dds::Writer<msg::ThermalCoverage> writer_;
  std::map<std::uint32_t, std::uint64_t> epochs_;  // seen last, by gyro
  std::vector<msg::ThermalCoverage> seen_;
};

}  // namespace zerodrift::services
