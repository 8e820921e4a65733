// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/offline_run.h"

#include <algorithm>

namespace zerodrift::services {

std::vector<std::string> missing_probes(const compensation::CompensationOptions& options,
                                        const record::RecordInfo& info) {
  std::vector<std::string> missing;
  for (const auto& probe : options.probes()) {
    if (std::find(info.probes.begin(), info.probes.end(), probe) == info.probes.end())
      missing.push_back(probe);
  }
  return missing;
}

void OfflineRun::push(const record::RecordRow& row) {
  for (std::size_t probe = 0; probe < reader_.info().probes.size(); ++probe) {
    record::to_temperature(row, reader_.info(), probe, temperature_);
    compensator_.push(temperature_);
  }
  if (const auto reference = record::to_rate_reference(row, reader_.info()))
    compensator_.push(*reference);
  compensator_.push(record::to_angular_rate(row));
}

}  // namespace zerodrift::services
