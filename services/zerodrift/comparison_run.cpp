// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/comparison_run.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <stdexcept>

#include "common/report/numbers.h"
#include "services/zerodrift/offline_run.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {
namespace {

using comparison::LabelledPoint;
using comparison::Protocol;
using Clock = std::chrono::steady_clock;

constexpr std::size_t kFewestLabels = 60;
constexpr std::size_t kMostInitialLabels = 600;
constexpr double kInitialShare = 1.0 / 6.0;
constexpr std::string_view kPaperModel = "paper_fog.yaml";
constexpr std::string_view kPaperProfile = "paper_chamber.yaml";

// A scheme with a stopwatch.
class TimedScheme final : public regression::DriftScheme {
 public:
  explicit TimedScheme(std::unique_ptr<regression::DriftScheme> scheme)
      : scheme_(std::move(scheme)) {}

  void learn(const regression::DriftLabel& label) override {
    const auto begun = Clock::now();
    scheme_->learn(label);
    elapsed_ += Clock::now() - begun;
  }
  [[nodiscard]] regression::DriftPrediction predict(
      double time_s, std::span<const double> features) const override {
    const auto begun = Clock::now();
    const auto made = scheme_->predict(time_s, features);
    elapsed_ += Clock::now() - begun;
    return made;
  }
  [[nodiscard]] double seconds() const { return std::chrono::duration<double>(elapsed_).count(); }

 private:
  std::unique_ptr<regression::DriftScheme> scheme_;
  mutable Clock::duration elapsed_{};
};

bool needs_own_output(const compensation::CompensationOptions& options) {
  return std::any_of(options.features.begin(), options.features.end(), [](const auto& feature) {
    return feature.kind == thermal::FeatureKind::kPulseMean ||
           feature.kind == thermal::FeatureKind::kPulseRate;
  });
}

// What the first reading of a record gives.
struct Labels {
  core::PerAxis<std::vector<LabelledPoint>> points;
  std::uint64_t samples = 0;
  core::SensorTime last_time{0};
  record::RecordInfo info;
  std::vector<std::string> warnings;
};

Labels read_labels(const ComparisonRequest& request) {
  compensation::CompensationOptions options = request.options;
  // The labels don't depend on what is learned, unless features are made from the compensation's
  // own output.
  if (!needs_own_output(options)) options.scheme = compensation::Scheme::kNone;
  compensation::Compensator compensator(options);
  OfflineRun offline(request.record, request.columns, compensator);
  Labels labels;
  labels.info = offline.info();
  if (const auto missing = missing_probes(options, labels.info); !missing.empty()) {
    throw std::invalid_argument(request.record + ": found no temperature of probe '" +
                                missing.front() + "', expected a column temperature_" +
                                missing.front() + "_degC");
  }
  offline.run(false, [&](const compensation::CompensatedSample& sample) {
    ++labels.samples;
    labels.last_time = std::max(labels.last_time, sample.raw.time);
    const compensation::Label* label = compensator.confirmed_label();
    if (label == nullptr) return;
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (!label->valid[i] || !label->features_ready[i]) continue;
      labels.points[i].push_back({label->begin, label->end, label->drift_radps[i],
                                  label->variance_radps2[i], label->features[i]});
    }
  });
  labels.warnings = offline.warnings();
  return labels;
}

std::vector<Protocol> protocols_of(const ComparisonRequest& request,
                                   const std::vector<LabelledPoint>& points,
                                   std::size_t initial_labels) {
  const core::SensorTime trained = points[initial_labels - 1].end;
  std::vector<Protocol> protocols{{.name = "one ahead", .judged_from = trained}};
  for (const double delay_s : request.delays_s) {
    protocols.push_back({.name = "delayed " + report::significant(delay_s, 2) + " s",
                         .delay_s = delay_s,
                         .judged_from = trained + core::from_seconds(delay_s)});
  }
  const core::SensorTime frozen = request.train_until_s ? core::from_seconds(*request.train_until_s)
                                                        : comparison::begin_of_last_leg(points);
  protocols.push_back({.name = "frozen at " + report::significant(core::seconds(frozen), 4) + " s",
                       .frozen_from = frozen,
                       .judged_from = frozen});
  return protocols;
}

SchemeOutcome judge(const std::string& name, const ComparisonRequest& request,
                    const Protocol& protocol, const std::vector<LabelledPoint>& points,
                    std::size_t initial_labels) {
  // A frozen model was trained on everything before.
  const bool is_frozen = protocol.frozen_from != core::SensorTime::max();
  regression::InitialSetOptions initial{.labels = initial_labels};
  if (is_frozen) {
    const auto known = std::count_if(points.begin(), points.end(), [&](const auto& point) {
      return point.end <= protocol.frozen_from;
    });
    initial.labels = std::max<std::size_t>(2, static_cast<std::size_t>(known));
  }
  TimedScheme scheme(comparison::make_compared_scheme(name, request.options, initial));
  SchemeOutcome outcome;
  outcome.name = name;
  outcome.predicted =
      comparison::predict_all(protocol, points, request.options.features.size(), scheme);
  outcome.statistics = comparison::residual_statistics(points, outcome.predicted);
  outcome.seconds_a_point = scheme.seconds() / static_cast<double>(points.size());
  return outcome;
}

// The second reading: every sample into every stream, and the paper's preparation.
class Streams {
 public:
  Streams(ComparisonResult& result, const Labels& labels)
      : result_(result),
        period_s_(labels.info.sample_period_s),
        temperature_(period_s_, std::max(period_s_ * static_cast<double>(labels.samples), 1.0)) {
    for (const AxisComparison& axis : result.axes) {
      axes_.push_back(
          {comparison::PointFinder(axis.points),
           {},
           {period_s_, std::max(period_s_ * static_cast<double>(labels.samples), 1.0)}});
      for (const ProtocolOutcome& protocol : axis.protocols) {
        std::vector<std::optional<comparison::PredictedPoint>> nothing_off =
            protocol.schemes.front().predicted;
        for (auto& predicted : nothing_off) {
          if (predicted) predicted->drift_radps = 0.0;
        }
        axes_.back().streams.emplace_back(period_s_, nothing_off);
        for (const SchemeOutcome& scheme : protocol.schemes)
          axes_.back().streams.emplace_back(period_s_, scheme.predicted);
      }
    }
  }

  void add(const record::RecordRow& row, std::optional<std::size_t> probe) {
    std::uint64_t missing = 0;
    if (previous_) {
      const double steps = core::seconds(row.time - *previous_) / period_s_;
      if (steps > 1.5) missing = static_cast<std::uint64_t>(std::llround(steps)) - 1;
    }
    previous_ = row.time;
    if (probe && std::isfinite(row.temperature_degc[*probe]))
      newest_degc_ = row.temperature_degc[*probe];
    temperature_.add(newest_degc_);
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      const std::size_t i = core::index(result_.axes[a].axis);
      const double drift = row.rate_radps[i] - row.reference_radps[i];
      const auto point = axes_[a].finder.find(row.time);
      for (auto& stream : axes_[a].streams) stream.add(point, drift, missing);
      axes_[a].prepared.add(drift);
    }
  }

  void report() {
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      auto stream = axes_[a].streams.begin();
      for (ProtocolOutcome& protocol : result_.axes[a].protocols) {
        protocol.raw = (stream++)->report();
        for (SchemeOutcome& scheme : protocol.schemes) scheme.stream = (stream++)->report();
      }
      result_.axes[a].paper_interval_s = axes_[a].prepared.interval_s();
      const auto points = axes_[a].prepared.points();
      result_.axes[a].paper_radps.assign(points.begin(), points.end());
    }
  }

  [[nodiscard]] std::span<const double> temperature_degc() const { return temperature_.points(); }

 private:
  struct AxisStreams {
    comparison::PointFinder finder;
    std::vector<comparison::ResidualStream> streams;
    comparison::PaperPreparation prepared;
  };

  ComparisonResult& result_;
  double period_s_;
  std::optional<core::SensorTime> previous_;
  double newest_degc_ = std::numeric_limits<double>::quiet_NaN();
  comparison::PaperPreparation temperature_;
  std::vector<AxisStreams> axes_;
};

// Options of the paper's procedure: its two features, in the order of paper_points().
compensation::CompensationOptions paper_options(compensation::CompensationOptions options,
                                                const std::string& probe, double interval_s) {
  options.features = {{.kind = thermal::FeatureKind::kTemperature, .probe = probe},
                      {.kind = thermal::FeatureKind::kTemperatureRate, .probe = probe},
                      {.kind = thermal::FeatureKind::kPulseMean}};
  options.learning.label_interval_s = interval_s;
  return options;
}

void follow_the_paper(const ComparisonRequest& request, std::span<const double> temperature_degc,
                      AxisComparison& axis) {
  // A label's noise, averaged on over a minute.
  double label_variance = 0.0;
  for (const auto& point : axis.points)
    label_variance += point.variance / static_cast<double>(axis.points.size());
  const double point_variance =
      label_variance * request.options.learning.label_interval_s / comparison::kPaperWindowS;
  const auto begun = Clock::now();
  const auto points = comparison::paper_points(axis.paper_radps, temperature_degc,
                                               axis.paper_interval_s, point_variance);
  const double rate_s = std::chrono::duration<double>(Clock::now() - begun).count();
  if (points.size() < kFewestLabels) return;
  const auto options =
      paper_options(request.options, request.options.probes().front(), axis.paper_interval_s);
  const regression::InitialSetOptions initial{
      .labels = (points.size() + comparison::kPaperTrainingStride - 1) /
                comparison::kPaperTrainingStride};
  for (const std::string& name : request.schemes) {
    TimedScheme scheme(comparison::make_compared_scheme(name, options, initial));
    PaperOutcome outcome;
    outcome.name = name;
    outcome.residual_radps = comparison::paper_residuals(name, points, scheme);
    outcome.moments = comparison::moments(outcome.residual_radps);
    outcome.coefficients =
        comparison::paper_coefficients(outcome.residual_radps, axis.paper_interval_s);
    outcome.seconds = scheme.seconds() + rate_s;
    axis.paper.push_back(std::move(outcome));
  }
}

bool is_paper_like(const record::RecordInfo& info) {
  const auto names = [&](std::string_view key, std::string_view file) {
    return std::any_of(info.metadata.begin(), info.metadata.end(), [&](const auto& entry) {
      return entry.first == key && std::string_view(entry.second).ends_with(file);
    });
  };
  return names("model", kPaperModel) && names("profile", kPaperProfile);
}

// The paper's 15 000 points lie evenly over time, so the samples must.
bool is_evenly_sampled(const Labels& labels) {
  const double spanned_s = core::seconds(labels.last_time - labels.info.first_time);
  const double counted_s = static_cast<double>(labels.samples - 1) * labels.info.sample_period_s;
  return std::abs(spanned_s - counted_s) <= 0.001 * spanned_s;
}

}  // namespace

ComparisonResult run_comparison(const ComparisonRequest& request) {
  ProgressBar bar("compare");
  bar.show(0.0);
  const Labels labels = read_labels(request);
  ComparisonResult result;
  result.record = request.record;
  result.warnings = labels.warnings;
  result.label_s = request.options.learning.label_interval_s;
  result.is_paper_like = is_paper_like(labels.info);
  const auto axes = std::count_if(labels.points.begin(), labels.points.end(),
                                  [](const auto& p) { return p.size() >= kFewestLabels; });
  if (axes == 0) {
    const auto most =
        std::max_element(labels.points.begin(), labels.points.end(),
                         [](const auto& a, const auto& b) { return a.size() < b.size(); });
    throw std::invalid_argument(
        request.record + ": found " + std::to_string(most->size()) +
        " labels at rest with all features on any axis, expected at least " +
        std::to_string(kFewestLabels));
  }
  constexpr double kFirstReading = 0.25;
  constexpr double kJudging = 0.5;
  double done = 0.0;
  for (const auto axis : core::kAxes) {
    const auto& points = labels.points[core::index(axis)];
    if (points.size() < kFewestLabels) continue;
    AxisComparison& compared = result.axes.emplace_back();
    compared.axis = axis;
    compared.points = points;
    const auto initial =
        std::min(kMostInitialLabels,
                 static_cast<std::size_t>(kInitialShare * static_cast<double>(points.size())));
    result.initial_labels = initial;
    for (const Protocol& protocol : protocols_of(request, points, initial)) {
      ProtocolOutcome outcome{protocol, {}, {}};
      for (const std::string& name : request.schemes)
        outcome.schemes.push_back(judge(name, request, protocol, points, initial));
      if (outcome.schemes.front().statistics.points > 0)
        compared.protocols.push_back(std::move(outcome));
      done += 1.0 / static_cast<double>(request.delays_s.size() + 2);
      bar.show(kFirstReading + kJudging * done / static_cast<double>(axes));
    }
  }

  Streams streams(result, labels);
  record::RecordReader reader(
      request.record, record::RecordOptions{.columns = record::parse_column_map(request.columns)});
  const auto& probes = labels.info.probes;
  const auto found = std::find(probes.begin(), probes.end(), request.options.probes().front());
  const auto probe = static_cast<std::size_t>(found - probes.begin());
  std::uint64_t rows = 0;
  while (const record::RecordRow* row = reader.next()) {
    streams.add(*row, probe);
    bar.show(kFirstReading + kJudging +
             0.2 * static_cast<double>(++rows) / static_cast<double>(labels.samples));
  }
  streams.report();
  if (is_evenly_sampled(labels)) {
    for (AxisComparison& axis : result.axes)
      follow_the_paper(request, streams.temperature_degc(), axis);
  }
  return result;
}

}  // namespace zerodrift::services
