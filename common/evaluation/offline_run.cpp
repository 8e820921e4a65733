// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/offline_run.h"

#include <algorithm>
#include <chrono>

#include "common/core/integer_time.h"
#include "common/record/bag_files.h"

namespace zerodrift::evaluation {
namespace {

constexpr core::SensorTime kPatience = std::chrono::minutes(1);

// What went wrong with the time of a live stream is answered as it was live; a file that claims to
// be a record is held to it.
record::RecordOptions reader_options(const record::RecordInput& record) {
  record::RecordOptions options = record.options();
  if (record::is_mcap_record(record.file)) options.time_order = record::TimeOrder::kAsFound;
  return options;
}

}  // namespace

OfflineRun::OfflineRun(const record::RecordInput& record,
                       const compensation::CompensationOptions& options)
    : reader_(record.file, reader_options(record)),
      watch_(reader_.info(), record.columns),
      options_(options.for_samples_every(reader_.info().first_interval_s)),
      compensator_(options_) {}

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
  static_cast<void>(watch_.add(row));
  for (std::size_t probe = 0; probe < reader_.info().probes.size(); ++probe) {
    if (!record::brings_temperature(row, probe)) continue;
    record::to_temperature(row, reader_.info(), probe, temperature_);
    compensator_.push(temperature_);
  }
  auto reference = record::to_rate_reference(row, reader_.info());
  if (reference && !takes_feedback_ && !core::is_true_rate(reference->kind)) reference.reset();
  if (record::brings_rate(row)) {
    held_.push_back({record::to_angular_rate(row), reference});
  } else if (reference) {
    compensator_.push(*reference);
  }
}

void OfflineRun::push_held() {
  while (!held_.empty()) {
    Held& next = held_.front();
    if (next.reference) compensator_.push(*next.reference);
    next.reference.reset();
    if (compensator_.push(next.rate) == compensation::Admission::kQueueFull) return;
    held_.pop_front();
  }
}

bool OfflineRun::waits_too_long(core::SensorTime now) const {
  return !held_.empty() && core::saturating_difference(now, compensator_.needed_time()) > kPatience;
}

}  // namespace zerodrift::evaluation
