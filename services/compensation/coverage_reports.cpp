// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/coverage_reports.h"

namespace zerodrift::services {

void CoverageReports::look_at(const Gyro& gyro) {
  const compensation::Compensator& compensator = gyro.compensator();
  const std::uint64_t epoch = gyro.newest().model_epoch;
  if (!gyro.leads()) return;
  const auto [seen, is_first] = epochs_.try_emplace(gyro.id, epoch);
  if (!is_first && seen->second == epoch) return;
  seen->second = epoch;
  msg::ThermalCoverage message;
  message.gyro_id(gyro.id);
  message.model_epoch(epoch);
  const auto labels = [&](core::Axis axis) {
    const compensation::ThermalCoverage* coverage = compensator.coverage(axis);
    return coverage == nullptr ? compensation::ThermalCoverage::Labels{} : coverage->labels();
  };
  message.labels_x(labels(core::Axis::kX));
  message.labels_y(labels(core::Axis::kY));
  message.labels_z(labels(core::Axis::kZ));
  seen_.push_back(message);
}

void CoverageReports::publish() {
  for (msg::ThermalCoverage& message : seen_) writer_.write(message);
  seen_.clear();
}

}  // namespace zerodrift::services
