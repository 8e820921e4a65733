// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/navigation_run.h"

#include <cmath>
#include <deque>
#include <limits>
#include <optional>

#include "common/evaluation/offline_run.h"
#include "common/navigation/navigation_input.h"
#include "common/record/record_reader.h"
#include "common/record/record_rows.h"
#include "common/record/record_samples.h"

namespace zerodrift::evaluation {
namespace {

using compensation::Readiness;
using navigation::Stream;

constexpr double kPointEveryS = 10.0;
constexpr std::uint64_t kRowsPerProgress = 4096;

// What a row says beside rates and temperatures, until its sample is answered.
struct Beside {
  std::optional<core::RateReferenceSample> truth;
  std::optional<core::PerAxis<double>> specific_force_mps2;
};

class NavigationOfRecord {
 public:
  explicit NavigationOfRecord(const NavigationRequest& request)
      : request_(request),
        reader_(request.record.file, request.record.options()),
        compensator_(request.compensation.for_samples_every(reader_.info().first_interval_s)),
        navigation_(request.navigation),
        probe_missing_(!missing_probes(request.compensation, reader_.info()).empty()) {}

  NavigationResult run(const Progress& progress) {
    const std::optional<double> expected_rows = record::estimated_rows(request_.record.file);
    while (const record::RecordRow* row = reader_.next()) {
      if (expected_rows && row->index % kRowsPerProgress == 0)
        progress("navigate", static_cast<double>(row->index) / *expected_rows);
      push(*row);
      if (probe_missing_) compensator_.give_up_waiting();
      answer_ready();
    }
    compensator_.give_up_waiting();
    answer_ready();
    return result();
  }

 private:
  void push(const record::RecordRow& row) {
    for (std::size_t probe = 0; probe < reader_.info().probes.size(); ++probe) {
      record::to_temperature(row, reader_.info(), probe, temperature_);
      compensator_.push(temperature_);
    }
    Beside beside{.truth = record::to_rate_reference(row, reader_.info()),
                  .specific_force_mps2 = {}};
    const core::PerAxis<double>& force = row.inputs.acceleration_mps2;
    if (std::isfinite(force[0]) && std::isfinite(force[1]) && std::isfinite(force[2]))
      beside.specific_force_mps2 = force;
    if (beside.truth) compensator_.push(*beside.truth);
    beside_.push_back(beside);
    compensator_.push(record::to_angular_rate(row));
  }

  void answer_ready() {
    for (;;) {
      const Readiness readiness = compensator_.readiness();
      if (readiness == Readiness::kAwaitsModel) {
        if (!compensator_.learner().run_one()) return;
        continue;
      }
      if (readiness != Readiness::kReady) return;
      take(compensator_.answer_next());
    }
  }

  void take(const core::CompensatedSample& answer) {
    const Beside beside = beside_.front();
    beside_.pop_front();
    if (beside.truth && beside.truth->valid == core::PerAxis<bool>{true, true, true})
      navigation_.push_truth(beside.truth->time, beside.truth->rate_radps);
    auto sample = navigation::to_navigation(answer);
    sample.specific_force_mps2 = beside.specific_force_mps2;
    navigation_.push(sample);
    while (const auto reference = navigation_.take_reference()) {
      if (request_.gives_references) compensator_.push(*reference);
    }
    const double time_s = core::seconds(answer.raw.time);
    if (navigation_.phase() != navigation::Phase::kNavigating || time_s < next_point_s_) return;
    next_point_s_ = time_s + kPointEveryS;
    points_.push_back({time_s, navigation_.errors(Stream::kRaw).heading_now,
                       navigation_.errors(Stream::kCompensated).heading_now});
  }

  NavigationResult result() {
    NavigationResult result;
    result.record = request_.record.file;
    result.truth_known = navigation_.truth_received();
    for (const Stream stream : {Stream::kRaw, Stream::kCompensated}) {
      const auto i = static_cast<std::size_t>(stream);
      result.errors[i] = navigation_.errors(stream);
      result.streams[i] = navigation_.counts(stream);
      result.attitudes[i] = navigation_.attitude(stream);
      result.heading_sigma_rad[i] = std::sqrt(navigation_.filter(stream).covariance()(2, 2));
    }
    result.counts = navigation_.counts();
    result.compensation = compensator_.counts();
    result.rest_s = navigation_.rest_s();
    if (result.truth_known) result.points = points_;
    result.warnings = reader_.warnings();
    if (const auto compass = navigation_.compass())
      result.warnings.push_back("heading by Earth's rate: " + std::string(text(*compass)));
    return result;
  }

  NavigationRequest request_;
  record::RecordReader reader_;
  compensation::Compensator compensator_;
  navigation::GyroNavigation navigation_;
  bool probe_missing_;
  core::TemperatureSample temperature_;
  std::deque<Beside> beside_;
  std::vector<NavigationPoint> points_;
  double next_point_s_ = 0.0;
};

}  // namespace

NavigationResult run_navigation(const NavigationRequest& request, const Progress& progress) {
  return NavigationOfRecord(request).run(progress);
}

}  // namespace zerodrift::evaluation
