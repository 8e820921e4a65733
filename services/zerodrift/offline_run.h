// SPDX-License-Identifier: Apache-2.0
// A record through the service's computation, without the services.
#pragma once

#include <string>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"

namespace zerodrift::services {

// Names of the probes that features need and the record lacks.
[[nodiscard]] std::vector<std::string> missing_probes(
    const compensation::CompensationOptions& options, const record::RecordInfo& info);

// Feeds a record as the publishers do and answers every sample as soon as all that belongs to it is
// there.
class OfflineRun {
 public:
  OfflineRun(const std::string& record, const std::string& columns,
             compensation::Compensator& compensator)
      : reader_(record, record::RecordOptions{.columns = record::parse_column_map(columns)}),
        compensator_(compensator) {}

  [[nodiscard]] const record::RecordInfo& info() const { return reader_.info(); }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return reader_.warnings(); }

  // `probe_missing`: a probe the features need is not in the record, so nobody waits for it.
  template <typename Take>
  void run(bool probe_missing, Take&& take) {
    while (const record::RecordRow* row = reader_.next()) {
      push(*row);
      if (probe_missing) compensator_.give_up_waiting();
      answer_ready(take);
    }
    compensator_.give_up_waiting();  // the record is over: nothing more comes
    answer_ready(take);
  }

 private:
  void push(const record::RecordRow& row);

  template <typename Take>
  void answer_ready(Take&& take) {
    for (;;) {
      const compensation::Readiness readiness = compensator_.readiness();
      if (readiness == compensation::Readiness::kAwaitsModel) {
        if (!compensator_.learner().run_one()) return;
        continue;
      }
      if (readiness != compensation::Readiness::kReady) return;
      take(compensator_.answer_next());
    }
  }

  record::RecordReader reader_;
  compensation::Compensator& compensator_;
  core::TemperatureSample temperature_;
};

}  // namespace zerodrift::services
