// SPDX-License-Identifier: Apache-2.0
// A record through the service's computation, without the services.
#pragma once

#include <cstdint>
#include <deque>
#include <optional>
#include <string>
#include <vector>

#include "common/compensation/compensator.h"
#include "common/measurement/plausibility.h"
#include "common/record/record_reader.h"
#include "common/record/record_samples.h"

namespace zerodrift::evaluation {

// Names of the probes that features need and the record lacks.
[[nodiscard]] std::vector<std::string> missing_probes(
    const compensation::CompensationOptions& options, const record::RecordInfo& info);

// Feeds a record as the publishers do and answers every sample as soon as all that belongs to it is
// there. Temperatures go ahead of the rates that wait for them, as they do live; where they stop
// for a minute of sensor time, nobody waits for them.
class OfflineRun {
 public:
  OfflineRun(const record::RecordInput& record, const compensation::CompensationOptions& options);

  // Those given, for the spacing of the record's samples.
  [[nodiscard]] const compensation::CompensationOptions& options() const { return options_; }
  [[nodiscard]] compensation::Compensator& compensator() { return compensator_; }
  [[nodiscard]] const record::RecordInfo& info() const { return reader_.info(); }
  [[nodiscard]] const std::vector<std::string>& warnings() const { return reader_.warnings(); }
  // Of the rows so far.
  [[nodiscard]] std::vector<measurement::Doubt> doubts() const { return watch_.doubts(); }

  // What filters said when the record was made is left out: whoever runs it gives its own.
  void leave_feedback_out() { takes_feedback_ = false; }

  // `probe_missing`: a probe the features need is not in the record, so nobody waits for it.
  template <typename Take>
  void run(bool probe_missing, Take&& take) {
    run(
        probe_missing, [](const record::RecordRow&) {}, take);
  }
  // `see` is given each row before what it brings is pushed.
  template <typename See, typename Take>
  void run(bool probe_missing, See&& see, Take&& take) {
    while (const record::RecordRow* row = reader_.next()) {
      see(*row);
      if (row->recorded != nullptr && row->recorded->begins_anew) answer_the_rest(take);
      push(*row);
      do {
        push_held();
        if (probe_missing || waits_too_long(row->time)) compensator_.give_up_waiting();
      } while (answer_ready(take) > 0 && !held_.empty());
    }
    answer_the_rest(take);
  }

 private:
  // A rate for which the compensator has no room yet, with the reference of the same time.
  struct Held {
    core::AngularRateSample rate{};
    std::optional<core::RateReferenceSample> reference{};
  };

  void push(const record::RecordRow& row);
  void push_held();
  [[nodiscard]] bool waits_too_long(core::SensorTime now) const;

  // What is waited for doesn't come any more: the record is over, or its clock was set back.
  template <typename Take>
  void answer_the_rest(Take&& take) {
    do {
      push_held();
      compensator_.give_up_waiting();
    } while (answer_ready(take) > 0);
  }

  // How many were answered.
  template <typename Take>
  std::uint64_t answer_ready(Take&& take) {
    for (std::uint64_t answered = 0;;) {
      const compensation::Readiness readiness = compensator_.readiness();
      if (readiness == compensation::Readiness::kAwaitsModel) {
        if (!compensator_.learner().run_one()) return answered;
        continue;
      }
      if (readiness != compensation::Readiness::kReady) return answered;
      take(compensator_.answer_next());
      ++answered;
    }
  }

  record::RecordReader reader_;
  measurement::RecordWatch watch_;
  compensation::CompensationOptions options_;
  compensation::Compensator compensator_;
  core::TemperatureSample temperature_;
  std::deque<Held> held_;
  bool takes_feedback_ = true;
};

}  // namespace zerodrift::evaluation
