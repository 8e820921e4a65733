// SPDX-License-Identifier: Apache-2.0
#include "common/evaluation/comparison_run.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <chrono>
#include <cmath>
#include <set>
#include <stdexcept>

#include "common/allan/sample_clock.h"
#include "common/core/not_known.h"
#include "common/core/samples.h"
#include "common/evaluation/comparison_figures.h"
#include "common/evaluation/model_use.h"
#include "common/evaluation/offline_run.h"
#include "common/evaluation/sample_rows.h"
#include "common/evaluation/timed_scheme.h"
#include "common/measurement/doubts_json.h"
#include "common/record/bag_files.h"
#include "common/record/record_rows.h"
#include "common/report/numbers.h"

namespace zerodrift::evaluation {
namespace {

using comparison::LabelledPoint;
using comparison::Protocol;
using Clock = std::chrono::steady_clock;
using Share = std::function<void(double)>;  // of the whole comparison that is done

constexpr std::size_t kFewestLabels = 60;
constexpr std::size_t kMostInitialLabels = 600;
constexpr double kInitialShare = 1.0 / 6.0;
// Turned by less, a temperature is taken to be held.
constexpr double kLeastTurnDegc = 1.0;
// A record at rest all the time gives labels over this share of it.
constexpr double kAtRest = 0.9;
// Beyond it (a month and a half) a time is a mistake.
constexpr double kLongestTimeS = 4e6;
// Shares of the progress, as a record of 5 h at 200 Hz takes them.
constexpr double kFirstReading = 0.25;
constexpr double kJudging = 0.1;
constexpr double kSecondReading = 0.55;
constexpr std::string_view kPaperModel = "paper_fog.yaml";
constexpr std::string_view kPaperProfile = "paper_chamber.yaml";

bool needs_own_output(const compensation::CompensationOptions& options) {
  return std::any_of(options.features.begin(), options.features.end(), [](const auto& feature) {
    return feature.kind == thermal::FeatureKind::kPulseMean ||
           feature.kind == thermal::FeatureKind::kPulseRate;
  });
}

// "600", "0.5": as short as it reads back to the same number.
std::string shortest(double value) {
  std::array<char, 32> text{};
  const auto [end, error] = std::to_chars(text.data(), text.data() + text.size(), value);
  return {text.data(), end};
}

std::string axis_name(core::Axis axis) {
  return "axis " + std::string(core::name(axis));
}

// Before minutes of reading.
void check(const ComparisonRequest& request) {
  if (const auto wrong = request.options.validate()) throw std::invalid_argument(*wrong);
  const auto usable = [](double seconds) { return seconds > 0.0 && seconds <= kLongestTimeS; };
  std::set<std::string> schemes;
  for (const std::string& name : request.schemes) {
    if (!schemes.insert(name).second)
      throw std::invalid_argument("--schemes: found '" + name + "' twice, expected each once");
    static_cast<void>(comparison::make_compared_scheme(name, request.options, {}));
  }
  if (schemes.empty()) throw std::invalid_argument("--schemes: found none, expected at least one");
  std::set<double> delays;
  for (const double delay_s : request.delays_s) {
    if (!usable(delay_s) || !delays.insert(delay_s).second) {
      throw std::invalid_argument("--delays: found " + shortest(delay_s) +
                                  ", expected different times above 0 and up to 4e6 s");
    }
  }
  if (request.train_until_s && !usable(*request.train_until_s)) {
    throw std::invalid_argument("--train-until: found " + shortest(*request.train_until_s) +
                                ", expected a time above 0 and up to 4e6 s");
  }
}

// What the first reading of a record gives; times of points count from its first row.
struct Labels {
  core::PerAxis<std::vector<LabelledPoint>> points;
  std::uint64_t rows = 0;     // answered ones
  std::uint64_t samples = 0;  // of these, samples of the rate
  core::SensorTime first_sample{0};
  core::SensorTime last_sample{0};
  double period_s = 0.0;  // mean of the steps that are no gaps
  record::RecordInfo info;
  compensation::CompensationOptions options;  // for the spacing of the record's samples
  std::vector<measurement::Doubt> doubts;
  std::vector<std::string> warnings;
};

Labels read_labels(const ComparisonRequest& request, const Share& show) {
  compensation::CompensationOptions options = request.options;
  // The labels don't depend on what is learned, unless features are made from the compensation's
  // own output.
  if (!needs_own_output(options)) options.scheme = compensation::Scheme::kNone;
  OfflineRun offline(request.record, options);
  Labels labels;
  labels.options = request.options.for_samples_every(offline.info().first_interval_s);
  labels.info = offline.info();
  const core::SensorTime first = labels.info.first_time;
  if (const auto missing = missing_probes(options, labels.info); !missing.empty()) {
    const std::string& probe = missing.front();
    throw std::invalid_argument(
        request.record.file + ": found no temperature of probe '" + probe + "', expected " +
        (record::is_mcap_record(request.record.file)
             ? "one (of a ROS 2 bag: --temperature-topic " + probe + "=TOPIC)"
             : "a column temperature_" + probe + "_degC, or --columns 'temperature_" + probe +
                   "=NAME[degC]'"));
  }
  const std::optional<double> rows = record::estimated_rows(request.record.file);
  std::optional<allan::SampleClock> clock;  // of a record of more than one sample
  if (labels.info.sample_period_s > 0.0) clock.emplace(labels.info.sample_period_s);
  SampleRows placed(labels.info.sample_period_s);
  offline.run(false, [&](const core::CompensatedSample& sample) {
    ++labels.rows;
    if (rows) show(kFirstReading * static_cast<double>(labels.rows) / *rows);
    if (sample.raw.valid == core::PerAxis<bool>{}) {
      placed.pass_blank();
    } else {
      const auto [step, missing, blank] = placed.place(sample.raw.time);
      if (clock && step && *step > core::SensorTime{0}) clock->add(core::seconds(*step));
      if (labels.samples == 0) labels.first_sample = sample.raw.time;
      labels.samples += blank + 1;
      labels.last_sample = std::max(labels.last_sample, sample.raw.time);
    }
    const compensation::Label* label = offline.compensator().confirmed_label();
    if (label == nullptr) return;
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (!label->valid[i] || !label->features_ready[i]) continue;
      labels.points[i].push_back({label->begin - first, label->end - first, label->drift_radps[i],
                                  label->variance_radps2[i], label->features[i],
                                  label->prior_radps[i]});
    }
  });
  if (clock) labels.period_s = clock->period_s();
  labels.doubts = offline.doubts();
  labels.warnings = offline.warnings();
  return labels;
}

// Why the service has no model for this record at any time; empty where it has one.
std::string why_no_model(const ComparisonRequest& request) {
  OfflineRun offline(request.record, request.options);
  ModelUse use;
  offline.run(false, [&](const core::CompensatedSample& sample) { use.add(sample); });
  return use.line_of_none(request.record.file, offline.options());
}

// Where the last leg begins that was kept unseen.
core::SensorTime begin_of_unseen(const ComparisonRequest& request,
                                 const std::vector<LabelledPoint>& points) {
  if (request.train_until_s) return core::from_seconds(*request.train_until_s);
  const auto& features = request.options.features;
  const auto found = std::find_if(features.begin(), features.end(), [](const auto& feature) {
    return feature.kind == thermal::FeatureKind::kTemperature;
  });
  if (found == features.end()) return comparison::begin_of_last_leg(points, 0, 0.0);
  const double scale = found->scale.value_or(thermal::default_scale(found->kind));
  return comparison::begin_of_last_leg(points, static_cast<std::size_t>(found - features.begin()),
                                       kLeastTurnDegc / scale);
}

std::vector<Protocol> protocols_of(const ComparisonRequest& request,
                                   const std::vector<LabelledPoint>& points,
                                   std::size_t initial_labels) {
  const core::SensorTime trained = points[initial_labels - 1].end;
  std::vector<Protocol> protocols{{.name = "one ahead", .judged_from = trained}};
  for (const double delay_s : request.delays_s) {
    protocols.push_back({.name = "delayed " + shortest(delay_s) + " s",
                         .delay_s = delay_s,
                         .judged_from = trained + core::from_seconds(delay_s)});
  }
  const core::SensorTime frozen = begin_of_unseen(request, points);
  protocols.push_back({.name = "frozen at " + report::significant(core::seconds(frozen), 4) + " s",
                       .frozen_from = frozen,
                       .judged_from = frozen});
  return protocols;
}

SchemeOutcome judge(const std::string& name, const ComparisonRequest& request, Protocol protocol,
                    const std::vector<LabelledPoint>& points, std::size_t initial_labels) {
  // A frozen model was trained on everything before.
  const bool is_frozen = protocol.frozen_from != core::SensorTime::max();
  regression::InitialSetOptions initial{.labels = initial_labels};
  if (is_frozen) {
    const auto known = std::count_if(points.begin(), points.end(), [&](const auto& point) {
      return point.end <= protocol.frozen_from;
    });
    initial.labels = std::max<std::size_t>(2, static_cast<std::size_t>(known));
  }
  if (comparison::is_batch_trained(name)) protocol.calibrated_from = protocol.judged_from;
  TimedScheme scheme(comparison::make_compared_scheme(name, request.options, initial));
  SchemeOutcome outcome;
  outcome.name = name;
  const bool takes_prior = name == kOurs || name == kPapers;
  const auto predict = takes_prior ? comparison::predict_on_prior : comparison::predict_all;
  outcome.predicted = predict(protocol, points, request.options.features.size(), scheme);
  outcome.statistics = comparison::residual_statistics(points, outcome.predicted);
  outcome.seconds = scheme.seconds();
  return outcome;
}

// All schemes on one axis; what a protocol leaves nothing to judge of is stated in `warnings`.
AxisComparison judge_axis(core::Axis axis, const std::vector<LabelledPoint>& points,
                          const ComparisonRequest& request, std::vector<std::string>& warnings) {
  AxisComparison compared;
  compared.axis = axis;
  compared.points = points;
  compared.initial_labels =
      std::min(kMostInitialLabels,
               static_cast<std::size_t>(kInitialShare * static_cast<double>(points.size())));
  for (const Protocol& protocol : protocols_of(request, points, compared.initial_labels)) {
    ProtocolOutcome outcome{protocol, {}, {}};
    for (const std::string& name : request.schemes)
      outcome.schemes.push_back(judge(name, request, protocol, points, compared.initial_labels));
    if (outcome.schemes.front().statistics.points > 0) {
      compared.protocols.push_back(std::move(outcome));
    } else {
      warnings.push_back(axis_name(axis) + ", " + protocol.name +
                         ": left out, no label is left to judge; labels lie between " +
                         report::significant(core::seconds(points.front().begin), 4) + " and " +
                         report::significant(core::seconds(points.back().end), 4) + " s");
    }
  }
  return compared;
}

// The second reading: every sample into every stream, and the paper's preparation.
class Streams {
 public:
  Streams(ComparisonResult& result, const Labels& labels, bool as_the_paper)
      : result_(result),
        mounting_(labels.options.mounting),
        first_time_(labels.info.first_time),
        rows_(labels.period_s) {
    const double period_s = labels.period_s;
    const double duration_s = period_s * static_cast<double>(labels.samples);
    if (as_the_paper) temperature_.emplace(period_s, duration_s);
    for (const AxisComparison& axis : result.axes) {
      axes_.push_back({comparison::PointFinder(axis.points), {}, {}});
      if (as_the_paper) axes_.back().prepared.emplace(period_s, duration_s);
      for (const ProtocolOutcome& protocol : axis.protocols) {
        std::vector<std::optional<comparison::PredictedPoint>> nothing_off =
            protocol.schemes.front().predicted;
        for (auto& predicted : nothing_off) {
          if (predicted) predicted->drift_radps = 0.0;
        }
        axes_.back().streams.emplace_back(period_s, nothing_off);
        for (const SchemeOutcome& scheme : protocol.schemes) {
          if (scheme.name != kNothingTakenOff)
            axes_.back().streams.emplace_back(period_s, scheme.predicted);
        }
      }
    }
  }

  void add(const record::RecordRow& row, std::optional<std::size_t> probe) {
    if (probe && std::isfinite(row.temperature_degc[*probe]))
      newest_degc_ = row.temperature_degc[*probe];
    if (!record::brings_rate(row)) return;
    if (std::none_of(row.rate_radps.begin(), row.rate_radps.end(), core::is_rate)) {
      rows_.pass_blank();
      return;
    }
    const auto [step, missing, blank] = rows_.place(row.time);
    for (std::uint64_t k = 0; k < blank; ++k) prepare_blank();
    if (temperature_) temperature_->add(newest_degc_);
    const core::PerAxis<double> rate_radps = mounting_.rate_radps_b(row.rate_radps);
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      const std::size_t i = core::index(result_.axes[a].axis);
      const double drift = rate_radps[i] - row.reference_radps[i];
      const auto point = axes_[a].finder.find(row.time - first_time_);
      for (auto& stream : axes_[a].streams) stream.add(point, drift, missing);
      if (axes_[a].prepared) axes_[a].prepared->add(drift);
    }
  }

  void report() {
    for (std::size_t a = 0; a < axes_.size(); ++a) {
      auto stream = axes_[a].streams.begin();
      for (ProtocolOutcome& protocol : result_.axes[a].protocols) {
        protocol.raw = (stream++)->report();
        for (SchemeOutcome& scheme : protocol.schemes)
          scheme.stream = scheme.name == kNothingTakenOff ? protocol.raw : (stream++)->report();
      }
      if (!axes_[a].prepared) continue;
      result_.axes[a].paper_interval_s = axes_[a].prepared->interval_s();
      const auto points = axes_[a].prepared->points();
      result_.axes[a].paper_radps.assign(points.begin(), points.end());
    }
  }

  // Only where the paper is followed.
  [[nodiscard]] std::span<const double> temperature_degc() const { return temperature_->points(); }

 private:
  struct AxisStreams {
    comparison::PointFinder finder;
    std::vector<comparison::ResidualStream> streams;
    std::optional<comparison::PaperPreparation> prepared;
  };

  void prepare_blank() {
    if (temperature_) temperature_->add(newest_degc_);
    for (AxisStreams& axis : axes_) {
      if (axis.prepared) axis.prepared->add(core::kNaN);
    }
  }

  ComparisonResult& result_;
  compensation::Mounting mounting_;
  core::SensorTime first_time_;
  SampleRows rows_;
  double newest_degc_ = core::kNaN;
  std::optional<comparison::PaperPreparation> temperature_;
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

// Why the paper's procedure says nothing of this record; empty where it does.
std::string obstacle_to_the_paper(const Labels& labels, const ComparisonRequest& request,
                                  const std::vector<LabelledPoint>& points) {
  if (request.options.probes().empty()) return "no feature is made from a temperature";
  const double period_s = labels.period_s;
  if (period_s > comparison::kPaperWindowS)
    return "a sample every " + shortest(period_s) + " s leaves no minute to average over";
  // Its 15 000 points lie evenly over time, so the samples must.
  const double spanned_s = core::seconds(labels.last_sample - labels.first_sample);
  const double counted_s = static_cast<double>(labels.samples - 1) * period_s;
  if (std::abs(spanned_s - counted_s) > 0.001 * spanned_s)
    return "the samples are not evenly spaced in time";
  double labelled_s = 0.0;
  for (const auto& point : points) labelled_s += core::seconds(point.end - point.begin);
  if (labelled_s < kAtRest * spanned_s)
    return "labels at rest, with all features, are only " +
           report::significant(100.0 * labelled_s / spanned_s, 2) + " % of the record";
  return {};
}

void read_streams(const ComparisonRequest& request, const Labels& labels, Streams& streams,
                  const Share& show) {
  record::RecordReader reader(request.record.file, request.record.options());
  const std::vector<std::string> wanted = request.options.probes();
  std::optional<std::size_t> probe;
  if (!wanted.empty()) {
    const auto& probes = labels.info.probes;
    const auto found = std::find(probes.begin(), probes.end(), wanted.front());
    probe = static_cast<std::size_t>(found - probes.begin());
  }
  std::uint64_t rows = 0;
  while (const record::RecordRow* row = reader.next()) {
    streams.add(*row, probe);
    if (record::brings_rate(*row)) ++rows;
    const double share = static_cast<double>(rows) / static_cast<double>(labels.rows);
    show(kFirstReading + kJudging + kSecondReading * share);
  }
  streams.report();
}

}  // namespace

ComparisonResult run_comparison(const ComparisonRequest& requested, const Progress& progress) {
  check(requested);
  const Share show = [&](double share) { progress("compare", share); };
  show(0.0);
  const Labels labels = read_labels(requested, show);
  ComparisonRequest request = requested;
  request.options = labels.options;
  ComparisonResult result;
  result.record = request.record.file;
  result.doubts = labels.doubts;
  result.warnings = labels.warnings;
  result.delays_s = request.delays_s;
  result.is_paper_like = is_paper_like(labels.info);
  const double label_s = request.options.learning.label_interval_s;
  std::size_t most = 0;
  for (const auto& points : labels.points) most = std::max(most, points.size());
  if (most < kFewestLabels) {
    result.no_model = why_no_model(requested);
    if (!result.no_model.empty()) return result;
    throw std::invalid_argument(
        request.record.file + ": found " + std::to_string(most) +
        " labels at rest with all features on any axis, expected at least " +
        std::to_string(kFewestLabels) + " (a label is " + report::significant(label_s, 2) +
        " s of samples at rest; the record has one every " +
        report::significant(labels.info.sample_period_s, 2) + " s)" +
        possible_cause(result.doubts));
  }
  for (const auto axis : core::kAxes) {
    const auto& points = labels.points[core::index(axis)];
    if (points.size() >= kFewestLabels) {
      result.axes.push_back(judge_axis(axis, points, request, result.warnings));
    } else if (labels.info.has_rate[core::index(axis)]) {
      result.warnings.push_back(axis_name(axis) + ": left out, found " +
                                std::to_string(points.size()) + " labels at rest, expected " +
                                std::to_string(kFewestLabels));
    }
    const auto axes_done = static_cast<double>(core::index(axis) + 1);
    show(kFirstReading + kJudging * axes_done / static_cast<double>(core::kAxisCount));
  }

  if (request.only_labels) return result;
  const std::string obstacle = obstacle_to_the_paper(labels, request, result.axes.front().points);
  Streams streams(result, labels, obstacle.empty());
  read_streams(request, labels, streams, show);
  if (!obstacle.empty()) {
    result.warnings.push_back("the paper's procedure is left out: " + obstacle);
    return result;
  }
  double done = kFirstReading + kJudging + kSecondReading;
  const double step = (1.0 - done) / static_cast<double>(result.axes.size());
  for (AxisComparison& axis : result.axes) {
    follow_the_paper(request, streams.temperature_degc(), axis);
    if (axis.paper.empty())
      result.warnings.push_back(axis_name(axis.axis) +
                                ": the paper's procedure is left out, too "
                                "few minutes of it are whole");
    show(done += step);
  }
  return result;
}

}  // namespace zerodrift::evaluation
