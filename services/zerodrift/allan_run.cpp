// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/allan_run.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <stdexcept>

#include "common/allan/sample_clock.h"
#include "common/core/median.h"
#include "common/core/not_known.h"
#include "common/record/csv_cells.h"
#include "common/record/record_reader.h"
#include "common/record/record_rows.h"
#include "common/report/numbers.h"
#include "services/zerodrift/progress_bar.h"

namespace zerodrift::services {
namespace {

using allan::SeriesReport;
using record::RecordReader;
using record::RecordRow;
using report::significant;

using core::kNaN;
constexpr std::size_t kStepsForPeriod = 100;
constexpr std::uint64_t kMostRowsForPeriod = 100'000;
constexpr std::uint64_t kLookEvery = 1 << 16;  // rows, for the progress
constexpr double kReading = 0.7;               // share of the work
constexpr std::size_t kBytesKept = 8;          // a sample and stream
constexpr std::size_t kBytesInWork = 20;       // a sample of the stream in work
constexpr std::size_t kMegabyte = 1'000'000;

bool has_any_rate(const RecordRow& row) {
  return std::any_of(row.rate_radps.begin(), row.rate_radps.end(),
                     [](double rate) { return std::isfinite(rate); });
}

// Of the rows that hold a rate: others may lie between them.
double nominal_period_s(const AllanRequest& request) {
  RecordReader reader(request.record.file, request.record.options());
  std::vector<double> steps_s;
  std::optional<core::SensorTime> previous;
  for (std::uint64_t rows = 0; rows < kMostRowsForPeriod; ++rows) {
    const RecordRow* row = reader.next();
    if (row == nullptr || steps_s.size() == kStepsForPeriod) break;
    if (!has_any_rate(*row)) continue;
    if (previous) steps_s.push_back(core::seconds(row->time - *previous));
    previous = row->time;
  }
  if (steps_s.empty()) {
    throw std::invalid_argument(request.record.file + ": found " +
                                (previous ? "one row" : "no row") +
                                " with a measured rate; an Allan deviation needs at least 2, and "
                                "says something from hundreds on");
  }
  return core::median_of(std::move(steps_s));
}

// One axis of the record as it is read.
struct Source {
  core::Axis axis = core::Axis::kX;
  StreamKind kind = StreamKind::kRaw;
  std::optional<std::size_t> applied;  // extra column to be added
  allan::SeriesAnalysis analysis;
};

std::optional<std::size_t> applied_column(const record::RecordInfo& info, core::Axis axis) {
  const auto& extra = info.extra_columns;
  const auto found = std::find(extra.begin(), extra.end(),
                               "applied_drift_" + std::string(core::name(axis)) + "_rad_s");
  if (found == extra.end()) return std::nullopt;
  return static_cast<std::size_t>(found - extra.begin());
}

std::vector<Source> sources_of(const AllanRequest& request, const record::RecordInfo& info,
                               double nominal_s) {
  struct Wanted {
    core::Axis axis;
    StreamKind kind;
    std::optional<std::size_t> applied;
  };
  std::vector<Wanted> wanted;
  for (const auto axis : core::kAxes) {
    if (!info.has_rate[core::index(axis)]) continue;
    const auto applied = applied_column(info, axis);
    wanted.push_back({axis, StreamKind::kRaw, applied});
    if (applied) wanted.push_back({axis, StreamKind::kCompensated, std::nullopt});
  }
  allan::SeriesOptions options;
  options.nominal_interval_s = nominal_s;
  options.grid = request.grid;
  options.confidence = request.confidence;
  options.statistics = request.statistics;
  options.most_kept_samples =
      request.memory_mb * kMegabyte / (kBytesKept * wanted.size() + kBytesInWork);
  std::vector<Source> sources;
  for (const Wanted& one : wanted)
    sources.push_back({one.axis, one.kind, one.applied, allan::SeriesAnalysis(options)});
  return sources;
}

double drift_of(const RecordRow& row, const Source& source) {
  const std::size_t i = core::index(source.axis);
  const double drift = row.rate_radps[i] - row.reference_radps[i];
  if (!source.applied) return drift;
  return drift + record::parse_number(row.extra[*source.applied]).value_or(kNaN);
}

// Rows of the last samples, to tell where the period changed.
class RowNumbers {
 public:
  void add(std::uint64_t row) { rows_[count_++ % rows_.size()] = row; }
  // Counted from 1.
  [[nodiscard]] std::uint64_t of(std::uint64_t sample) const {
    return rows_[sample % rows_.size()] + 1;
  }

 private:
  std::array<std::uint64_t, 1024> rows_{};
  std::uint64_t count_ = 0;
};

void refuse_second_rate(const AllanRequest& request, const allan::SampleClock& clock,
                        const RowNumbers& rows) {
  const auto change = clock.period_change();
  if (!change) return;
  throw std::invalid_argument(
      request.record.file + ": row " + std::to_string(rows.of(change->sample)) +
      " below the header: up to there samples come every " + significant(change->before_s, 4) +
      " s, from there on every " + significant(change->after_s, 4) +
      " s; an Allan deviation is of one rate, so split the record there");
}

void read_all(const AllanRequest& request, RecordReader& reader, allan::SampleClock& clock,
              std::vector<Source>& sources, AllanResult& result, ProgressBar& bar) {
  const std::optional<double> rows_expected = record::estimated_rows(request.record.file);
  RowNumbers rows;
  measurement::RecordWatch watch(reader.info(), request.record.columns);
  std::optional<core::SensorTime> first, previous;
  while (const RecordRow* row = reader.next()) {
    if (rows_expected && row->index % kLookEvery == 0)
      bar.show(kReading * std::min(1.0, static_cast<double>(row->index) / *rows_expected));
    static_cast<void>(watch.add(*row));
    if (!has_any_rate(*row)) continue;
    rows.add(row->index);
    const std::uint64_t missing = previous ? clock.add(core::seconds(row->time - *previous)) : 0;
    refuse_second_rate(request, clock, rows);
    if (!first) first = row->time;
    previous = row->time;
    ++result.samples;
    for (Source& source : sources) {
      source.analysis.gap(missing);
      source.analysis.add(drift_of(*row, source));
    }
  }
  result.doubts = watch.doubts();
  clock.finish();
  refuse_second_rate(request, clock, rows);
  result.period_s = clock.period_s();
  result.duration_s = core::seconds(*previous - *first);
}

std::string label(const AllanStream& stream) {
  return "axis " + std::string(core::name(stream.axis)) + ", " + std::string(name(stream.kind));
}

std::string samples_text(std::uint64_t count) {
  return std::to_string(count) + (count == 1 ? " sample" : " samples");
}

// What the reader of the result must know of the samples it is made of.
void warn(const AllanStream& stream, double longest_gap_s, AllanResult& result) {
  const SeriesReport& r = stream.report;
  const std::string who = label(stream) + ": ";
  const auto at = [&](std::uint64_t place) {
    return (place == 0 ? "0" : significant(static_cast<double>(place) * result.period_s, 6)) +
           " s after the first sample";
  };
  auto& lines = result.warnings;
  if (r.missing > 0) {
    std::string line = who + samples_text(r.missing) + " of " +
                       std::to_string(r.findings.samples + r.missing) + " missing, in " +
                       std::to_string(r.interruptions) + (r.interruptions == 1 ? " gap" : " gaps");
    if (longest_gap_s > 0.0)
      line += " (longest of the time stamps " + significant(longest_gap_s, 3) + " s)";
    line += r.method == allan::SeriesMethod::kCascade
                ? "; only differences without a missing sample count"
                : "; where half of the differences would be lost, clusters lacking up to a tenth "
                  "of their samples count too";
    lines.push_back(line);
  }
  for (const auto& curve : r.curves) {
    if (!curve.stretch) continue;
    lines.push_back(who + std::string(allan::name(curve.statistic)) +
                    " cannot bridge gaps: it is of the longest stretch without one, " +
                    samples_text(curve.stretch->count) + " from " + at(curve.stretch->begin));
  }
  if (r.findings.outliers > 0) {
    lines.push_back(who + samples_text(r.findings.outliers) + " more than " +
                    significant(allan::kOutlierSigmas, 2) +
                    " robust standard deviations off their neighbours, the first " +
                    at(r.findings.first_outlier) + ", the farthest " +
                    significant(r.findings.largest_outlier_sigmas, 2) +
                    "; spikes or true rotation, kept: the deviations show them");
  }
  if (r.findings.is_stuck && !r.findings.is_constant) {
    lines.push_back(who + "stuck: " + samples_text(r.findings.longest_run) +
                    " in a row are equal, from " + at(r.findings.longest_run_begin) +
                    "; noise does not do that; kept");
  }
  if (r.method == allan::SeriesMethod::kCascade) {
    std::string line = who + "longer than " + std::to_string(result.request.memory_mb) +
                       " MB hold (--memory): overlapping deviation from differences a sixteenth of "
                       "tau apart";
    for (const auto statistic : r.left_out)
      line += (statistic == r.left_out.front() ? "; left out: " : ", ") +
              std::string(allan::name(statistic));
    lines.push_back(line);
  }
  if (r.too_large > 0) {
    lines.push_back(who + samples_text(r.too_large) +
                    " too large for the cascade's angle and left out as if missing; with more "
                    "--memory they are kept");
  }
}

// "x", with what is wrong, where an axis gives no deviation.
std::optional<std::string> why_left_out(const AllanStream& stream) {
  const SeriesReport& r = stream.report;
  if (r.findings.samples == 0) return "no sample is measured";
  if (r.findings.is_constant && r.findings.samples > 1)
    return "all " + samples_text(r.findings.samples) + " are equal: the sensor is stuck";
  if (r.allan.empty())
    return "no two neighbouring samples among " + std::to_string(r.findings.samples);
  return std::nullopt;
}

void add_stream(AllanStream stream, double longest_gap_s, AllanResult& result) {
  if (const auto why = why_left_out(stream)) {
    result.warnings.push_back(label(stream) + ": left out, " + *why);
    return;
  }
  warn(stream, longest_gap_s, result);
  result.streams.push_back(std::move(stream));
}

}  // namespace

std::string_view name(StreamKind kind) {
  return kind == StreamKind::kRaw ? "raw" : "compensated";
}

AllanResult run_allan(const AllanRequest& request) {
  ProgressBar bar("allan");
  bar.show(0.0);
  const double nominal_s = nominal_period_s(request);
  RecordReader reader(request.record.file, request.record.options());
  allan::SampleClock clock(nominal_s);
  std::vector<Source> sources = sources_of(request, reader.info(), nominal_s);
  AllanResult result;
  result.request = request;
  result.less_reference = reader.info().has_reference;
  read_all(request, reader, clock, sources, result, bar);
  result.warnings = reader.warnings();
  // It names the columns that `compensate` writes beside the rate as unknown.
  if (std::any_of(sources.begin(), sources.end(), [](const Source& s) { return s.applied; }))
    std::erase_if(result.warnings, [&](const std::string& line) {
      const auto& known = reader.info().warnings;
      return std::find(known.begin(), known.end(), line) != known.end();
    });
  for (std::size_t i = 0; i < sources.size(); ++i) {
    add_stream({sources[i].axis, sources[i].kind, sources[i].analysis.report(result.period_s)},
               clock.longest_gap_s(), result);
    const double done = static_cast<double>(i + 1) / static_cast<double>(sources.size());
    bar.show(kReading + (1.0 - kReading) * done);
  }
  if (result.streams.empty())
    throw std::invalid_argument(request.record.file + ": " + result.warnings.back());
  return result;
}

}  // namespace zerodrift::services
