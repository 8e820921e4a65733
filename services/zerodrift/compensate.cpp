// SPDX-License-Identifier: Apache-2.0
// zerodrift compensate: the service's computation on a record, without the services.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <deque>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/allan/block_statistics.h"
#include "common/allan/sample_clock.h"
#include "common/checkpoint/checkpoint_file.h"
#include "common/compensation/compensator.h"
#include "common/compensation/drift_prior.h"
#include "common/compensation/input_faults.h"
#include "common/compensation/option_keys.h"
#include "common/compensation/rest_gate.h"
#include "common/config/compensation_config.h"
#include "common/core/counted.h"
#include "common/core/integer_time.h"
#include "common/core/not_known.h"
#include "common/core/one_line.h"
#include "common/core/units.h"
#include "common/evaluation/model_use.h"
#include "common/evaluation/offline_run.h"
#include "common/files/atomic_file.h"
#include "common/record/record_rows.h"
#include "common/record/record_samples.h"
#include "common/recording/compensated_csv.h"
#include "common/report/numbers.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"
#include "services/zerodrift/doubts.h"
#include "services/zerodrift/ending.h"
#include "services/zerodrift/record_options.h"
#include "services/zerodrift/write_progress.h"

namespace zerodrift::services {
namespace {

struct CompensateOptions {
  record::RecordInput record;
  std::string config;
  std::string scheme;
  std::string prior;
  std::string out;
  std::uint32_t gyro_id = 1;
  std::string checkpoint;
  bool after_power_on = false;
  std::string save_checkpoint;
};

std::string figure_deg_h(double rate_radps) {
  return report::significant(core::deg_h_from_radps(rate_radps), 4);
}

constexpr core::SensorTime kSecond{1'000'000'000};

// A steady turn looks like rest, at a level that no drift has.
bool is_motion(compensation::RestState state) {
  return state == compensation::RestState::kMotion ||
         state == compensation::RestState::kLevelImplausible;
}

// Mean square of a signal about its first value, which an offset doesn't change.
class Swing {
 public:
  void add(double value) noexcept {
    if (!std::isfinite(value)) return;
    if (count_ == 0) first_ = value;
    const double off = value - first_;
    sum_ += off;
    squares_ += off * off;
    ++count_;
  }
  [[nodiscard]] double about(const Swing& other) const noexcept {
    const double n = static_cast<double>(count_);
    const double centre = other.first_ + other.sum_ / static_cast<double>(other.count_) - first_;
    return std::sqrt(std::max(0.0, (squares_ - 2.0 * centre * sum_) / n + centre * centre));
  }
  [[nodiscard]] std::uint64_t count() const noexcept { return count_; }

 private:
  std::uint64_t count_ = 0;
  double first_ = 0.0;
  double sum_ = 0.0;
  double squares_ = 0.0;
};

// Means over a minute, raw and compensated, less the reference where there is one, from when an
// axis is first compensated; and what holding the mean of the last minute would have left. By the
// time stamps: what is missing between two samples is missing in its minute.
class Summary {
 public:
  explicit Summary(const record::RecordInfo& info)
      : interval_s_(info.sample_period_s > 0.0 ? info.sample_period_s : 1.0),
        has_rate_(info.has_rate),
        has_reference_(info.has_reference) {
    const allan::BlockStatisticsOptions options{.sample_interval_s = interval_s_,
                                                .block_s = std::max(60.0, interval_s_),
                                                .window_s = std::max(60.0, interval_s_)};
    for (auto& axis : axes_) {
      axis.raw.emplace(options);
      axis.compensated.emplace(options);
    }
  }

  // Each row before what it brings is answered.
  void see(const record::RecordRow& row) {
    if (has_reference_ == core::PerAxis<bool>{} || !record::brings_rate(row)) return;
    if (!references_.empty() && row.time < references_.back().time) references_.clear();
    references_.push_back({row.time, row.reference_radps});
  }

  // `state`: of rest, when the sample was answered.
  void add(const core::CompensatedSample& sample, compensation::RestState state) {
    use_.add(sample);
    if (sample.raw.valid == core::PerAxis<bool>{}) return;  // what it lacks is missing by time
    const core::PerAxis<double> reference = reference_at(sample.raw.time);
    const core::SensorTime time = sample.raw.time;
    const std::uint64_t missing =
        last_ ? allan::missing_between(core::seconds(core::saturating_difference(time, *last_)),
                                       interval_s_)
              : 0;
    last_ = std::max(time, last_.value_or(time));
    for (const auto a : core::kAxes) {
      const std::size_t i = core::index(a);
      Axis& axis = axes_[i];
      if (axis.compensating) {
        axis.raw->gap(missing);
        axis.compensated->gap(missing);
      }
      axis.compensating = axis.compensating || sample.mode[i] != core::Mode::kPassthrough;
      if (!axis.compensating) continue;
      axis.raw->add(sample.raw.valid[i] ? sample.raw.rate_radps[i] - reference[i] : core::kNaN);
      axis.compensated->add(sample.raw.valid[i] ? sample.rate_radps[i] - reference[i] : core::kNaN);
      if (has_reference_[i] || !sample.raw.valid[i]) continue;
      axis.add_to_second(sample.raw.time, sample.raw.rate_radps[i], is_motion(state));
    }
  }

  [[nodiscard]] const evaluation::ModelUse& use() const { return use_; }

  // A spread takes two minutes: of less there is no table.
  void print() const {
    if (std::any_of(core::kAxes.begin(), core::kAxes.end(),
                    [&](core::Axis axis) { return has_spread(axis); })) {
      print_table();
    } else {
      std::printf("no table: no axis has a spread\n");
    }
    for (const auto a : core::kAxes) {
      if (!has_rate_[core::index(a)] || has_spread(a)) continue;
      std::printf(
          "%s: no spread, which takes two blocks of %s s, compensated and with 80 %% of their\n"
          "samples each: found %llu\n",
          std::string(core::name(a)).c_str(), block_text().c_str(),
          static_cast<unsigned long long>(raw_of(a).blocks));
    }
  }

 private:
  struct Axis {
    std::optional<allan::BlockStatistics> raw;
    std::optional<allan::BlockStatistics> compensated;
    bool compensating = false;
    // Of means over a second of an axis without a reference, as the decision of rest is made of.
    Swing at_rest;
    Swing in_motion;
    core::SensorTime second_began{0};
    double second_sum = 0.0;
    std::uint64_t second_count = 0;
    bool second_moved = false;

    void add_to_second(core::SensorTime time, double rate_radps, bool moves) {
      if (second_count > 0 && (time < second_began || time - second_began >= kSecond)) {
        (second_moved ? in_motion : at_rest).add(second_sum / static_cast<double>(second_count));
        second_sum = 0.0;
        second_count = 0;
        second_moved = false;
      }
      if (second_count++ == 0) second_began = time;
      second_sum += rate_radps;
      second_moved = second_moved || moves;
    }
  };
  struct Reference {
    core::SensorTime time;
    core::PerAxis<double> rate_radps;
  };

  // 0 on an axis without a column, not a number where the row of this time has none.
  core::PerAxis<double> reference_at(core::SensorTime time) {
    core::PerAxis<double> reference{};
    for (std::size_t i = 0; i < core::kAxisCount; ++i)
      reference[i] = has_reference_[i] ? core::kNaN : 0.0;
    while (!references_.empty() && references_.front().time < time) references_.pop_front();
    if (references_.empty() || references_.front().time != time) return reference;
    for (std::size_t i = 0; i < core::kAxisCount; ++i) {
      if (has_reference_[i]) reference[i] = references_.front().rate_radps[i];
    }
    return reference;
  }

  // The spread is then that of a rotation which nothing in the record tells from drift.
  [[nodiscard]] bool turned(core::Axis a) const {
    constexpr std::uint64_t kFewest = 2;
    constexpr double kTurning = 3.0;  // of noise and drift at rest
    const Axis& axis = axes_[core::index(a)];
    if (axis.in_motion.count() < kFewest) return false;
    return axis.at_rest.count() < kFewest ||
           axis.in_motion.about(axis.at_rest) > kTurning * axis.at_rest.about(axis.at_rest);
  }

  [[nodiscard]] allan::BlockMoments raw_of(core::Axis axis) const {
    return axes_[core::index(axis)].raw->moments(allan::Span::kSinceStart);
  }
  [[nodiscard]] bool has_spread(core::Axis axis) const {
    return has_rate_[core::index(axis)] && raw_of(axis).blocks >= 2;
  }
  // A minute, in whole samples.
  [[nodiscard]] std::string block_text() const {
    return report::significant(axes_.front().raw->block_s(), 2);
  }

  // Of those in the table: "x, z".
  template <typename Is>
  [[nodiscard]] std::string axes_where(const Is& is) const {
    std::string text;
    for (const auto a : core::kAxes) {
      if (has_spread(a) && is(a)) text += (text.empty() ? "" : ", ") + std::string(core::name(a));
    }
    return text;
  }

  void print_table() const {
    std::printf(
        "standard deviation of %s s means, deg/h\n"
        "axis       raw  compensated  persistence  raw/compensated  on model\n",
        block_text().c_str());
    for (const auto a : core::kAxes) {
      if (!has_spread(a)) continue;
      const allan::BlockMoments raw = raw_of(a);
      const double left =
          axes_[core::index(a)].compensated->moments(allan::Span::kSinceStart).standard_deviation;
      const bool is_comparable = use_.came_into_force(a) && left > 0.0 && !turned(a);
      const std::string ratio =
          is_comparable ? report::significant(raw.standard_deviation / left, 3) : "not comparable";
      std::printf("%-4s %9s %12s %12s %16s %7.1f %%\n", std::string(core::name(a)).c_str(),
                  figure_deg_h(raw.standard_deviation).c_str(), figure_deg_h(left).c_str(),
                  raw.steps > 0 ? figure_deg_h(raw.step_rms).c_str() : "n/a", ratio.c_str(),
                  100.0 * use_.learned_share(a));
    }
    if (const std::string axes =
            axes_where([&](core::Axis a) { return has_reference_[core::index(a)]; });
        !axes.empty())
      std::printf("%s: less the reference.\n", axes.c_str());
    if (const std::string axes = axes_where([&](core::Axis a) { return turned(a); }); !axes.empty())
      std::printf("%s: turned without a reference, so that the spread is that of the motion.\n",
                  axes.c_str());
    const std::string block = block_text() == "60" ? "minute" : "block of " + block_text() + " s";
    std::printf(
        "persistence: the mean of a %s held over the next %s. Each sample was\n"
        "compensated before any label that contains it was learned (test-then-train).\n",
        block.c_str(), block_text() == "60" ? "minute" : "one");
  }

  double interval_s_;
  core::PerAxis<bool> has_rate_;
  core::PerAxis<bool> has_reference_;
  std::deque<Reference> references_;  // of rows whose samples aren't answered yet
  core::PerAxis<Axis> axes_;
  std::optional<core::SensorTime> last_;  // the latest
  evaluation::ModelUse use_;
};

// What was resumed, for people.
std::string resume(const std::string& file, bool after_power_on, const checkpoint::Owner& owner,
                   compensation::Compensator& compensator) {
  const auto restored = checkpoint::load(file, owner);
  if (after_power_on) restored->forget_age();
  compensator.restore_models(restored);
  return file + ": resumed, model epoch " + std::to_string(restored->epoch) + "\n";
}

void print_scale_factors(const compensation::Compensator& compensator) {
  constexpr double kPpm = 1e-6;
  for (const auto axis : core::kAxes) {
    const auto scale = compensator.scale_factor(axis);
    if (!scale) continue;
    std::printf("%-4s  scale factor: ", std::string(core::name(axis)).c_str());
    if (scale->is_known) {
      std::printf("%.1f ppm, sigma %.1f, at the end; %.2f ppm/°C, sigma %.2f; ",
                  scale->error / kPpm, scale->sigma / kPpm, scale->per_degc / kPpm,
                  scale->per_degc_sigma / kPpm);
    } else {
      std::printf("not known; ");
    }
    std::printf("windows of the reference: %llu taken, %llu refused\n",
                static_cast<unsigned long long>(scale->windows),
                static_cast<unsigned long long>(scale->refused));
  }
}

void save(const std::string& file, const checkpoint::Owner& owner,
          compensation::Compensator& compensator) {
  compensator.finish_learning();
  const compensation::LearnerState state = compensator.learner().export_state();
  checkpoint::save(file, owner, state);
  std::printf("%s: saved, model epoch %llu\n", file.c_str(),
              static_cast<unsigned long long>(state.epoch));
}

// What the configuration has to say so that the prior reads what the record has; empty where the
// record has too little. It is the configuration's to say: a running service knows no columns.
std::string where_mean_would_do(const twin::Model& prior, const std::vector<std::string>& probes) {
  const std::vector<std::string> needed = compensation::prior_probes(prior, probes);
  const bool are_there = std::all_of(needed.begin(), needed.end(), [&](const std::string& name) {
    return std::find(probes.begin(), probes.end(), name) != probes.end();
  });
  if (!are_there) return {};
  std::string names;
  for (const std::string& name : needed) names += (names.empty() ? "" : ", ") + name;
  return "; it would read the mean of coil_outer and coil_inner where the configuration has "
         "probes: "
         "[" +
         names + "] and features of these, none of 'coil'";
}

// The prior is part of every estimate: unlike the model, it can't be left aside where a temperature
// is missing.
void require_probes_of_prior(const std::string& record, const record::RecordInfo& info,
                             const compensation::CompensationOptions& options,
                             const std::vector<std::string>& missing) {
  if (!options.prior) return;
  const auto configured = options.probes();
  for (const auto& probe : compensation::prior_probes(*options.prior, configured)) {
    if (std::find(missing.begin(), missing.end(), probe) == missing.end()) continue;
    throw std::invalid_argument(record + ": has no temperature of probe '" + probe +
                                "', which the prior reads" +
                                where_mean_would_do(*options.prior, info.probes));
  }
}

// What of the record gave no answer, or one of an earlier drift, and why; empty: nothing.
std::string unanswered(const compensation::CompensatorCounts& counts) {
  std::string line;
  const auto add = [&](std::uint64_t number, const char* what) {
    if (number == 0) return;
    line += (line.empty() ? "" : "; ") + core::counted(number, "sample") + " " + what;
  };
  add(counts.duplicates, "left out, as repeats");
  add(counts.too_old, "left out, as too late by the number");
  add(counts.late, "late by the number, answered by the drift in force");
  add(counts.time_faults,
      "with a time that does not go on from the one before, answered by the drift in force");
  return line;
}

// The number of samples that measured a rate.
std::uint64_t answer_all(evaluation::OfflineRun& offline, bool probe_missing,
                         const CompensateOptions& options, Summary& summary,
                         std::optional<recording::CompensatedCsv>& csv) {
  constexpr std::uint64_t kSamplesPerProgress = 4096;
  WriteProgress progress("compensate", options.out);
  const std::optional<double> expected_rows = record::estimated_rows(options.record.file);
  std::uint64_t rows = 0;
  std::uint64_t samples = 0;
  const auto see = [&](const record::RecordRow& row) { summary.see(row); };
  offline.run(probe_missing, see, [&](const core::CompensatedSample& sample) {
    summary.add(sample, offline.compensator().rest_state());
    if (csv) csv->write(sample);
    if (sample.raw.valid != core::PerAxis<bool>{}) ++samples;
    if (++rows % kSamplesPerProgress == 0 && expected_rows)
      progress(static_cast<double>(rows) / *expected_rows, csv ? csv->bytes() : 0);
  });
  return samples;
}

int compensate(const CompensateOptions& options) {
  const EndsAtOnce on_signal;
  files::check_outputs({{"--record", options.record.file},
                        {"--config", options.config},
                        {"--prior", options.prior},
                        {"--checkpoint", options.checkpoint}},
                       {{"--out", options.out}, {"--save-checkpoint", options.save_checkpoint}});
  compensation::CompensationOptions compensation_options;
  if (!options.config.empty()) compensation_options = config::load_compensation(options.config);
  if (!options.scheme.empty())
    compensation_options.scheme = compensation::scheme_named(options.scheme);
  if (!options.prior.empty()) compensation_options.prior = config::load_prior(options.prior);
  evaluation::OfflineRun offline(options.record, compensation_options);
  const std::uint32_t recorded_gyro = offline.info().gyro_id;
  const checkpoint::Owner owner{recorded_gyro != 0 ? recorded_gyro : options.gyro_id,
                                offline.options()};
  std::string resumed;
  if (!options.checkpoint.empty())
    resumed = resume(options.checkpoint, options.after_power_on, owner, offline.compensator());
  const auto missing = evaluation::missing_probes(compensation_options, offline.info());
  require_probes_of_prior(options.record.file, offline.info(), compensation_options, missing);
  if (compensation_options.prior) {
    std::string names;
    for (const auto& effect : compensation::effects_left_out(*compensation_options.prior))
      names += (names.empty() ? "" : ", ") + effect;
    if (!names.empty()) {
      std::fprintf(stderr, "prior: left out, as not driven by temperature and time alone: %s\n",
                   names.c_str());
    }
  }
  for (const auto& probe : missing) {
    std::fprintf(
        stderr,
        "%s: has no temperature of probe '%s', which a feature needs; the drift is foretold "
        "without temperature\n",
        options.record.file.c_str(), core::one_line(probe).c_str());
  }
  std::optional<recording::CompensatedCsv> csv;
  if (!options.out.empty()) csv.emplace(options.out);
  Summary summary(offline.info());
  const std::uint64_t samples = answer_all(offline, !missing.empty(), options, summary, csv);
  for (const auto& line : offline.warnings()) std::fprintf(stderr, "%s\n", line.c_str());
  for (const auto& line : compensation::input_faults(offline.compensator()))
    std::fprintf(stderr, "%s: %s\n", options.record.file.c_str(), line.c_str());
  if (csv) {
    csv->commit();
    if (const std::string fault = csv->fault_of_times(); !fault.empty())
      std::fprintf(stderr, "%s\n", fault.c_str());
  }
  // First of all: what comes below looks like results.
  print_doubts(offline.doubts());
  if (const auto line = summary.use().line_of_none(options.record.file, offline.options());
      !line.empty())
    std::printf("%s\n", line.c_str());
  std::fputs(resumed.c_str(), stdout);
  if (!options.save_checkpoint.empty()) save(options.save_checkpoint, owner, offline.compensator());
  std::printf("%s: %llu samples compensated\n", options.record.file.c_str(),
              static_cast<unsigned long long>(samples));
  if (const std::string line = unanswered(offline.compensator().counts()); !line.empty())
    std::printf("%s: %s\n", options.record.file.c_str(), line.c_str());
  summary.print();
  print_scale_factors(offline.compensator());
  return service::kExitDone;
}

}  // namespace

void add_compensate(CLI::App& app, Run& run) {
  auto* command =
      app.add_subcommand("compensate", "take the drift off a record, as the service would");
  auto options = std::make_shared<CompensateOptions>();
  command->add_option("--record", options->record.file, kRecordHelp)->required();
  add_columns(*command, options->record.columns);
  add_bag_topics(*command, options->record.topics);
  command->add_option("--config", options->config, "YAML or JSON file (docs/configuration.md)");
  const auto schemes = compensation::scheme_names();
  const auto standard = std::find_if(schemes.begin(), schemes.end(), [](std::string_view scheme) {
    return compensation::scheme_named(scheme) == compensation::CompensationOptions{}.scheme;
  });
  command->add_option("--scheme", options->scheme, "overrides the file")
      ->check(CLI::IsMember(std::vector<std::string>(schemes.begin(), schemes.end())))
      ->default_str("the file's, else " + std::string(*standard));
  command->add_option("--prior", options->prior,
                      "a twin's model: drift = model + what is learned of the remainder; overrides "
                      "the file");
  command->add_option("--out", options->out, "record to write; without, only the summary");
  auto* checkpoint = command->add_option(
      "--checkpoint", options->checkpoint,
      "go on with what was learned then, from the first sample on; rest detection, "
      "temperature histories and labels not yet confirmed begin anew");
  command
      ->add_flag("--after-power-on", options->after_power_on,
                 "the gyro was off since that checkpoint, whatever its clock says: the bias is "
                 "learned anew, as by a service after another boot of its computer")
      ->needs(checkpoint);
  command->add_option("--save-checkpoint", options->save_checkpoint,
                      "write what is learned by the end; labels not confirmed by then are not in "
                      "it");
  const auto* gyro_id =
      command
          ->add_option(
              "--gyro-id", options->gyro_id,
              "whose checkpoint it is; only that gyro's is taken. .mcap: which gyro, where "
              "there are several")
          ->capture_default_str();
  command->callback([options, gyro_id, &run] {
    options->record.gyro_id = chosen_gyro(*gyro_id);
    run = [options] { return compensate(*options); };
  });
}

}  // namespace zerodrift::services
