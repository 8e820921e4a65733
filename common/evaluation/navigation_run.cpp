// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/navigation_run.h"

#include <algorithm>
#include <cmath>
#include <deque>
#include <optional>

#include "common/evaluation/offline_run.h"
#include "common/navigation/navigation_input.h"
#include "common/record/decimal_time.h"
#include "common/record/record_rows.h"
#include "common/record/record_samples.h"

namespace zerodrift::evaluation {
namespace {

using navigation::Stream;

constexpr double kPointEveryS = 10.0;
constexpr std::uint64_t kRowsPerProgress = 4096;

// What a row says beside rates and temperatures, until a sample of its time is answered.
struct Beside {
  core::SensorTime time{0};
  std::optional<core::PerAxis<double>> true_rate_radps{};
  std::optional<core::PerAxis<double>> specific_force_mps2{};
};

class NavigationOfRecord {
 public:
  explicit NavigationOfRecord(const NavigationRequest& request)
      : request_(request),
        offline_(request.record, request.compensation),
        navigation_(request.navigation) {
    if (request.gives_references) offline_.leave_feedback_out();
  }

  NavigationResult run(const Progress& progress) {
    const std::optional<double> expected_rows = record::estimated_rows(request_.record.file);
    const auto see = [&](const record::RecordRow& row) {
      if (expected_rows && row.index % kRowsPerProgress == 0)
        progress("navigate", static_cast<double>(row.index) / *expected_rows);
      keep_beside(row);
    };
    const bool probe_missing = !missing_probes(request_.compensation, offline_.info()).empty();
    offline_.run(probe_missing, see, [&](const core::CompensatedSample& answer) { take(answer); });
    navigation_.give_up_waiting();
    return result();
  }

 private:
  void keep_beside(const record::RecordRow& row) {
    Beside beside{.time = row.time};
    const auto reference = record::to_rate_reference(row, offline_.info());
    if (reference && is_truth(*reference)) beside.true_rate_radps = reference->rate_radps;
    const core::PerAxis<double>& force = row.inputs.acceleration_mps2;
    if (std::isfinite(force[0]) && std::isfinite(force[1]) && std::isfinite(force[2]))
      beside.specific_force_mps2 = force;
    if (!beside.true_rate_radps && !beside.specific_force_mps2) return;
    if (!beside_.empty() && row.time < beside_.back().time) beside_.clear();  // time began anew
    beside_.push_back(beside);
  }

  // An axis without a column is said to have a rate of 0, which is no truth.
  [[nodiscard]] bool has_truth_of(core::Axis axis) const {
    return offline_.info().has_reference[core::index(axis)];
  }

  [[nodiscard]] bool is_truth(const core::RateReferenceSample& reference) const {
    return core::is_true_rate(reference.kind) &&
           std::all_of(core::kAxes.begin(), core::kAxes.end(), [&](core::Axis axis) {
             const std::size_t i = core::index(axis);
             return !offline_.info().has_rate[i] || (has_truth_of(axis) && reference.valid[i]);
           });
  }

  // As the filters take it: an axis that nobody measures doesn't turn against the Earth.
  [[nodiscard]] core::PerAxis<double> completed(core::PerAxis<double> true_rate_radps) const {
    const core::PerAxis<double> earth_radps = navigation_.true_earth_rate_radps();
    for (const core::Axis axis : core::kAxes) {
      const std::size_t i = core::index(axis);
      if (!has_truth_of(axis)) true_rate_radps[i] = earth_radps[i];
    }
    return true_rate_radps;
  }

  void take(const core::CompensatedSample& answer) {
    auto sample = navigation::to_navigation(answer);
    for (; !beside_.empty() && beside_.front().time <= answer.raw.time; beside_.pop_front()) {
      const Beside& beside = beside_.front();
      if (beside.true_rate_radps)
        navigation_.push_truth(beside.time, completed(*beside.true_rate_radps));
      if (beside.time == answer.raw.time) sample.specific_force_mps2 = beside.specific_force_mps2;
    }
    navigation_.push(sample);
    // A truth that comes now comes with a later sample.
    navigation_.give_up_waiting();
    while (const auto reference = navigation_.take_reference()) {
      if (request_.gives_references) offline_.compensator().push(*reference);
    }
    const double time_s = core::seconds(answer.raw.time);
    if (navigation_.phase() != navigation::Phase::kNavigating || time_s < next_point_s_) return;
    next_point_s_ = time_s + kPointEveryS;
    if (!navigation_.knows_truth()) return;
    points_.push_back({time_s, navigation_.errors(Stream::kRaw).heading_now,
                       navigation_.errors(Stream::kCompensated).heading_now});
  }

  [[nodiscard]] std::string missing_truth() const {
    const std::string consequence = ", there is no truth to judge by";
    if (offline_.info().has_reference == core::PerAxis<bool>{})
      return "the record has no reference columns" + consequence;
    std::string missing;
    for (const core::Axis axis : core::kAxes) {
      if (!offline_.info().has_rate[core::index(axis)] || has_truth_of(axis)) continue;
      missing += (missing.empty() ? "" : ", ") + std::string(core::name(axis));
    }
    if (missing.empty()) return "no row has all reference columns" + consequence;
    return "the record has no reference column of " + missing + consequence;
  }

  [[nodiscard]] std::string truth_note() const {
    if (!navigation_.truth_received()) return missing_truth();
    if (!navigation_.truth_has_start())
      return "true rates make no true heading without the one at the start (--heading)";
    if (navigation_.truth_lost_at() == core::kNever) return {};
    return "true rates are missing before " + record::print_seconds(navigation_.truth_lost_at()) +
           " s, so that errors are known until then";
  }

  // Why true rates can't be compared with what the filters are given; empty: they can.
  [[nodiscard]] std::string objection_to_truth() const {
    const auto means =
        navigation_.truth_doubt() ? navigation_.truth_doubt() : navigation_.truth_at_rest();
    if (!means) return {};
    using compensation::EarthRateMode;
    const compensation::CompensationOptions& options = request_.compensation;
    const EarthRateMode mode = options.earth_rate.mode;  // kAuto of a record: kIncluded
    return navigation::objection(
        *means,
        {.axes = offline_.info().has_reference,
         .latitude_known = request_.navigation.filter.latitude_rad.has_value(),
         .earth_is_drift = options.scheme != compensation::Scheme::kNone &&
                           options.reference.truth != compensation::ReferencePolicy::kAccept &&
                           (mode == EarthRateMode::kAuto || mode == EarthRateMode::kIncluded)});
  }

  NavigationResult result() {
    NavigationResult result;
    result.record = request_.record.file;
    result.truth_known = navigation_.truth_received() && navigation_.truth_has_start();
    result.truth_lost = navigation_.truth_lost_at() != core::kNever;
    result.truth_note = truth_note();
    for (const Stream stream : {Stream::kRaw, Stream::kCompensated}) {
      const auto i = static_cast<std::size_t>(stream);
      result.errors[i] = navigation_.errors(stream);
      result.streams[i] = navigation_.counts(stream);
      result.attitudes[i] = navigation_.attitude(stream);
      result.heading_sigma_rad[i] = std::sqrt(navigation_.filter(stream).covariance()(2, 2));
    }
    if (const std::string why = objection_to_truth(); result.truth_known && !why.empty()) {
      result.truth_known = false;
      result.truth_note = why;
      result.errors = {};
    }
    result.counts = navigation_.counts();
    result.compensation = offline_.compensator().counts();
    result.rest_s = navigation_.rest_s();
    if (result.truth_known) result.points = points_;
    result.warnings = offline_.warnings();
    if (result.truth_known && !result.truth_note.empty())
      result.warnings.push_back(result.truth_note);
    if (const auto& doubt = navigation_.heading_doubt())
      result.warnings.push_back("heading: " + text(*doubt));
    if (const auto compass = navigation_.compass())
      result.warnings.push_back("heading by Earth's rate: " + std::string(text(*compass)));
    return result;
  }

  NavigationRequest request_;
  OfflineRun offline_;
  navigation::GyroNavigation navigation_;
  std::deque<Beside> beside_;
  std::vector<NavigationPoint> points_;
  double next_point_s_ = 0.0;
};

}  // namespace

NavigationResult run_navigation(const NavigationRequest& request, const Progress& progress) {
  return NavigationOfRecord(request).run(progress);
}

}  // namespace zerodrift::evaluation
