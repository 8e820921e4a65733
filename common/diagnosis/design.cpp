// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/design.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <stdexcept>
#include <utility>

#include "common/core/units.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/search_problem.h"
#include "common/diagnosis/separation.h"
#include "common/twin/effect_catalogue.h"
#include "common/twin/random.h"

namespace zerodrift::diagnosis {
namespace {

constexpr double kMostPoints = 1000.0;  // of the grid that an experiment is judged on

double interval_of(const twin::Profile& profile) {
  return std::max(1.0, std::ceil(profile.duration_s / kMostPoints));
}

// One question over one experiment.
class HeldApart {
 public:
  HeldApart(const Question& question, const MeasuredSeries& series)
      : question_(question),
        series_(series),
        playback_(series),
        candidates_(candidates(series, playback_, question.model, question.axis, offered_scans())),
        whitener_(noise_of(question, series)) {
    Columns known;
    for (auto& parameter : known_parameters(question.model, question.axis, playback_))
      known.push_back(std::move(parameter.column.values));
    known_ = whitener_.matrix(known);
    for (const Explanation& explanation : question.explanations) add(explanation);
    for (const std::string& name : question.look_alikes) forms_.push_back(forms_of(name));
  }

  // d of each explanation, if it is the truth, from each other one and from each look-alike.
  [[nodiscard]] std::vector<std::vector<double>> distances() const {
    const std::size_t n = question_.explanations.size();
    std::vector<std::vector<double>> d(n, std::vector<double>(forms_.size(), 0.0));
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = 0; j < forms_.size(); ++j) {
        if (i == j) continue;
        const bool is_nothing = question_.explanations[i].is_nothing();
        if (is_nothing && j < n) d[i][j] = lessened(size_[j], size_[j]);
        if (!is_nothing) d[i][j] = lessened(left_of(i, j), size_[i]);
      }
    }
    return d;
  }

 private:
  static std::vector<double> noise_of(const Question& question, const MeasuredSeries& series) {
    auto noise = model_noise(question.model, question.axis, series.interval_s, series.size);
    if (*std::max_element(noise.begin(), noise.end()) > 0.0) return noise;
    throw std::invalid_argument("the model lists no noise of axis " +
                                std::string(core::name(question.axis)) +
                                ", expected an angle_random_walk at least: without noise nothing "
                                "is too small to be seen");
  }

  void add(const Explanation& explanation) {
    Eigen::VectorXd waveform = Eigen::VectorXd::Zero(known_.rows());
    std::vector<Eigen::MatrixXd> forms;
    if (!explanation.is_nothing()) {
      const twin::EffectSpec spec = spec_of(explanation.effect, question_.axis);
      const auto definition = twin::definition_of(spec);
      const auto context = context_of(spec, *definition, series_.interval_s);
      waveform = whitener_.matrix({playback_.run(*definition, context)}).col(0);
      forms.push_back(whitener_.matrix(columns_of(playback_, *definition, context)));
      for (auto& form : forms_of(explanation.effect.name)) forms.push_back(std::move(form));
    }
    size_.push_back(norm_beside(waveform, known_));
    waveforms_.push_back(std::move(waveform));
    forms_.push_back(std::move(forms));
  }

  [[nodiscard]] std::vector<Eigen::MatrixXd> forms_of(const std::string& name) {
    std::vector<Eigen::MatrixXd> forms;
    for (const Columns& columns : rivals_of(name, candidates_, playback_))
      forms.push_back(whitener_.matrix(columns));
    return forms;
  }

  [[nodiscard]] double left_of(std::size_t truth, std::size_t rival) const {
    double least = size_[truth];
    for (const Eigen::MatrixXd& form : forms_[rival]) {
      Eigen::MatrixXd beside(known_.rows(), known_.cols() + form.cols());
      beside << known_, form;
      least = std::min(least, norm_beside(waveforms_[truth], beside));
    }
    return least;
  }

  // The share of its power that a form is known to leave unexplained, spread over the degrees of
  // freedom that a search gives it, is noise as well.
  static double lessened(double left, double size) {
    const SearchOptions search;
    const double mismatch = search.form_mismatch_share * size * size / search.mismatch_freedom;
    return left / std::sqrt(1.0 + mismatch);
  }

  const Question& question_;
  const MeasuredSeries& series_;
  Playback playback_;
  Candidates candidates_;
  Whitener whitener_;
  Eigen::MatrixXd known_;
  std::vector<Eigen::VectorXd> waveforms_;
  std::vector<std::vector<Eigen::MatrixXd>> forms_;
  std::vector<double> size_;  // of each waveform beside the known effects
};

double expected_entropy(const Question& question, const std::vector<std::vector<double>>& d) {
  const std::size_t n = question.explanations.size();
  const double others = 1.0 - SearchOptions{}.credible_mass;
  const double of_look_alike = others / static_cast<double>(question.look_alikes.size());
  double sum = 0.0;
  for (std::size_t i = 0; i < n; ++i) {
    const double p = question.explanations[i].probability;
    double confused = 0.0;
    for (std::size_t j = 0; j < d[i].size(); ++j) {
      if (j == i || (j >= n && question.explanations[i].is_nothing())) continue;
      const double q = j < n ? question.explanations[j].probability : of_look_alike;
      confused += q / p * std::exp(-d[i][j] * d[i][j] / 8.0);
    }
    sum += p * std::log1p(confused);
  }
  return sum;
}

Judgement judge_series(const std::vector<Question>& questions, const MeasuredSeries& series) {
  Judgement judgement;
  for (std::size_t q = 0; q < questions.size(); ++q) {
    const auto d = HeldApart(questions[q], series).distances();
    judgement.entropy_nats += expected_entropy(questions[q], d);
    for (std::size_t i = 0; i < d.size(); ++i) {
      for (std::size_t j = 0; j < i; ++j) {
        judgement.separations.push_back({q, questions[q].explanations[j].name(),
                                         questions[q].explanations[i].name(),
                                         std::min(d[i][j], d[j][i])});
      }
    }
  }
  return judgement;
}

// A model's thermal plant is rarely measured: what is designed has to hold where all its time
// constants are shorter or longer.
constexpr std::array kTimesOfPlant{1.0 / 1.5, 1.5};
using Temperatures = std::array<std::vector<ProbeSeries>, kTimesOfPlant.size()>;

Temperatures temperatures_over(const Question& question, const twin::Profile& profile) {
  Temperatures all;
  for (std::size_t p = 0; p < all.size(); ++p) {
    twin::Model model = question.model;
    twin::ThermalParameters& plant = model.thermal_plant;
    for (double* capacity : {&plant.case_capacity_j_per_k, &plant.coil_outer_capacity_j_per_k,
                             &plant.coil_inner_capacity_j_per_k, &plant.board_capacity_j_per_k})
      *capacity *= kTimesOfPlant[p];
    all[p] = exposure(model, profile, interval_of(profile)).probes;
  }
  return all;
}

// Mean entropy, smallest separations.
Judgement judge(const std::vector<Question>& questions, const twin::Profile& profile,
                const Temperatures& temperatures) {
  Judgement all;
  for (const auto& probes : temperatures) {
    const Judgement one = judge_series(questions, exposure(profile, interval_of(profile), probes));
    all.entropy_nats += one.entropy_nats / static_cast<double>(temperatures.size());
    if (all.separations.empty()) all.separations = one.separations;
    for (std::size_t i = 0; i < one.separations.size(); ++i) {
      double& least = all.separations[i].standard_errors;
      least = std::min(least, one.separations[i].standard_errors);
    }
  }
  return all;
}

// Uniform numbers one after the other.
class Dice {
 public:
  explicit Dice(std::uint64_t seed) : stream_(seed, "design") {}

  std::size_t below(std::size_t n) {
    return std::min(n - 1,
                    static_cast<std::size_t>(stream_.uniform(next_++) * static_cast<double>(n)));
  }

 private:
  twin::NoiseStream stream_;
  std::uint64_t next_ = 0;
};

// A plan with one thing changed.
class Proposals {
 public:
  Proposals(const twin::ChamberLimits& limits, std::uint64_t seed) : limits_(limits), dice_(seed) {
    for (std::size_t c = 0; c < kChannels; ++c) {
      if (is_movable(limits, static_cast<Channel>(c))) channels_.push_back(c);
    }
  }

  ExperimentPlan change(const ExperimentPlan& plan) {
    ExperimentPlan next = plan;
    next.what = {};
    const bool has_levels = !channels_.empty();
    const std::size_t choice = dice_.below(10);
    if (choice < 5 && has_levels) {
      change_levels(next);
    } else if (choice == 5 && has_levels) {
      change_channel(next);
    } else if (choice == 6) {
      change_power(next);
    } else if (limits_.moves_temperature()) {
      change_thermal(next);
    } else if (has_levels) {
      change_levels(next);
    }
    return next;
  }

 private:
  [[nodiscard]] std::size_t blocks(const ExperimentPlan& plan) const {
    return static_cast<std::size_t>(std::ceil(plan.duration_s / kLevelBlockS));
  }

  double level(std::size_t channel) {
    const auto levels = levels_of(static_cast<Channel>(channel));
    return levels[dice_.below(levels.size())];
  }

  // A few blocks of one channel get another level.
  void change_levels(ExperimentPlan& plan) {
    const std::size_t c = channels_[dice_.below(channels_.size())];
    plan.levels[c].resize(blocks(plan), 0.0);
    const std::size_t first = dice_.below(plan.levels[c].size());
    const std::size_t last = std::min(first + 1 + dice_.below(4), plan.levels[c].size());
    const double value = level(c);
    for (std::size_t b = first; b < last; ++b) plan.levels[c][b] = value;
  }

  // A channel rests, or takes another level in each block.
  void change_channel(ExperimentPlan& plan) {
    const std::size_t c = channels_[dice_.below(channels_.size())];
    const bool rests = dice_.below(2) == 0;
    plan.levels[c].assign(blocks(plan), 0.0);
    if (rests) return;
    for (double& value : plan.levels[c]) value = level(c);
  }

  void change_power(ExperimentPlan& plan) {
    if (!limits_.off_s || !(plan.duration_s > 4.0 * *limits_.off_s)) return;
    if (plan.off_at_s && dice_.below(2) == 0) {
      plan.off_at_s.reset();
    } else {
      const double eighths = static_cast<double>(1 + dice_.below(6)) / 8.0;
      plan.off_at_s = eighths * (plan.duration_s - *limits_.off_s);
    }
  }

  ThermalBlock thermal_block() {
    const double share = static_cast<double>(dice_.below(5)) / 4.0;
    constexpr std::array kSlower{1.0, 2.0, 4.0, 8.0};
    constexpr std::array kSoaks{0.0, 1.0, 2.0, 4.0};
    const std::size_t soak = dice_.below(kSoaks.size());
    return {*limits_.low_degc + share * (*limits_.high_degc - *limits_.low_degc),
            *limits_.ramp_degc_per_s / kSlower[dice_.below(kSlower.size())],
            kSoaks[soak] * limits_.soak_s};
  }

  void change_thermal(ExperimentPlan& plan) {
    auto& blocks = plan.thermal;
    const std::size_t choice = dice_.below(4);
    const std::size_t place = dice_.below(blocks.size() + 1);
    if (choice == 0 || place == blocks.size()) {
      blocks.insert(blocks.begin() + static_cast<std::ptrdiff_t>(place), thermal_block());
    } else if (choice == 1) {
      blocks.erase(blocks.begin() + static_cast<std::ptrdiff_t>(place));
    } else {
      blocks[place] = thermal_block();
    }
  }

  const twin::ChamberLimits& limits_;
  Dice dice_;
  std::vector<std::size_t> channels_;
};

struct Judged {
  ExperimentPlan plan;
  twin::Profile profile;
  Judgement judgement;
  Temperatures temperatures;
};

Judged judged(const std::vector<Question>& questions, const ExperimentPlan& plan,
              const twin::ChamberLimits& limits, const Judged* before) {
  Judged result{plan, profile_of(plan, limits), {}, {}};
  const bool is_as_warm = before != nullptr && before->plan.thermal == plan.thermal &&
                          before->plan.off_at_s == plan.off_at_s;
  result.temperatures =
      is_as_warm ? before->temperatures : temperatures_over(questions.front(), result.profile);
  result.judgement = judge(questions, result.profile, result.temperatures);
  return result;
}

Judged best_of_menu(const std::vector<Question>& questions, const twin::ChamberLimits& limits) {
  std::optional<Judged> best;
  for (const ExperimentPlan& plan : experiment_menu(limits)) {
    Judged one = judged(questions, plan, limits, nullptr);
    if (!best || one.judgement.entropy_nats < best->judgement.entropy_nats) best = std::move(one);
  }
  return *std::move(best);  // no menu is empty
}

// What the explanations read.
std::vector<twin::Need> needs_of(const std::vector<Question>& questions) {
  std::vector<twin::Need> needs;
  for (const Question& question : questions) {
    for (const Explanation& explanation : question.explanations) {
      if (explanation.is_nothing()) continue;
      const auto definition = twin::definition_of(spec_of(explanation.effect, question.axis));
      needs.insert(needs.end(), definition->needs.begin(), definition->needs.end());
    }
  }
  return needs;
}

// What the limits lack, at what a laboratory usually has.
std::vector<std::pair<const char*, twin::ChamberLimits>> widened(
    const twin::ChamberLimits& limits) {
  std::vector<std::pair<const char*, twin::ChamberLimits>> all;
  const auto add = [&](const char* channel, bool is_there, const auto& give) {
    if (is_there) return;
    all.emplace_back(channel, limits);
    give(all.back().second);
  };
  add("temperature", limits.moves_temperature(), [](twin::ChamberLimits& more) {
    more.low_degc = 0.0;
    more.high_degc = 50.0;
    more.ramp_degc_per_s = 2.0 / 60.0;
  });
  add("rate_table.largest_deg_s", limits.rate_radps.has_value(),
      [](auto& more) { more.rate_radps = 10.0 * core::kRadPerDeg; });
  add("magnetic.largest_ut", limits.magnetic_ut.has_value(),
      [](auto& more) { more.magnetic_ut = 100.0; });
  add("tilt.largest_deg", limits.tilt_rad.has_value(),
      [](auto& more) { more.tilt_rad = 90.0 * core::kRadPerDeg; });
  add("vibration.largest_g", limits.vibration_g.has_value(),
      [](auto& more) { more.vibration_g = 1.0; });
  add("source_current.change_ma", limits.source_current_ma.has_value(),
      [](auto& more) { more.source_current_ma = 5.0; });
  add("supply.change_v", limits.supply_v.has_value(), [](auto& more) { more.supply_v = 0.25; });
  return all;
}

// Begins with the menu's best and keeps each change that lowers the expected entropy.
Judged searched(const std::vector<Question>& questions, const twin::ChamberLimits& limits,
                const DesignOptions& options, const std::function<void(double)>& progress) {
  Judged best = best_of_menu(questions, limits);
  Proposals proposals(limits, options.seed);
  for (std::size_t i = 0; i < options.proposals; ++i) {
    progress(static_cast<double>(i) / static_cast<double>(options.proposals));
    Judged next = judged(questions, proposals.change(best.plan), limits, &best);
    if (next.judgement.entropy_nats < best.judgement.entropy_nats) best = std::move(next);
  }
  return best;
}

std::size_t movable_channels(const twin::ChamberLimits& limits) {
  std::size_t count = limits.moves_temperature() ? 1U : 0U;
  for (std::size_t c = 0; c < kChannels; ++c)
    count += is_movable(limits, static_cast<Channel>(c)) ? 1U : 0U;
  return count;
}

// Those of the pairs without a channel that an experiment would separate.
void name_channel(std::vector<Inseparable>& pairs, const char* channel,
                  const std::vector<Separation>& separations) {
  for (Inseparable& pair : pairs) {
    if (!pair.channel.empty()) continue;
    const auto now =
        std::find_if(separations.begin(), separations.end(), [&](const Separation& other) {
          return other.question == pair.pair.question && other.first == pair.pair.first &&
                 other.second == pair.pair.second;
        });
    if (now->standard_errors >= kLeastStandardErrors) pair.channel = channel;
  }
}

// What a channel would do is what an experiment designed with it would, as that of these limits was
// designed: the menu's alone may not show it.
std::vector<Inseparable> inseparable_pairs(const std::vector<Question>& questions,
                                           const twin::ChamberLimits& limits,
                                           const DesignOptions& options,
                                           const Judgement& judgement) {
  std::vector<Inseparable> pairs;
  for (const Separation& pair : judgement.separations) {
    if (pair.standard_errors < kLeastStandardErrors) pairs.push_back({pair, {}});
  }
  const auto needs = needs_of(questions);
  for (const auto& [channel, more] : widened(limits)) {
    const auto is_open = [](const Inseparable& pair) { return pair.channel.empty(); };
    if (std::none_of(pairs.begin(), pairs.end(), is_open)) break;
    const twin::ChamberLimits own = limited_to(more, needs);
    if (movable_channels(own) == movable_channels(limited_to(limits, needs))) continue;
    name_channel(pairs, channel, best_of_menu(questions, more).judgement.separations);
    if (std::none_of(pairs.begin(), pairs.end(), is_open)) break;
    name_channel(pairs, channel,
                 searched(questions, own, options, [](double) {}).judgement.separations);
  }
  return pairs;
}

}  // namespace

Judgement judge_profile(const std::vector<Question>& questions, const twin::Profile& profile) {
  return judge(questions, profile, temperatures_over(questions.front(), profile));
}

Design design(const std::vector<Question>& questions, const twin::ChamberLimits& limits,
              const DesignOptions& options, const std::function<void(double)>& progress) {
  Judged best = best_of_menu(questions, limits);
  Design result;
  result.best_of_menu = best.plan.what;
  result.menu_profile = best.profile;
  result.of_menu = best.judgement;
  // What nobody asks about rests: it could only hide what is asked about.
  const twin::ChamberLimits own = limited_to(limits, needs_of(questions));
  best = searched(questions, own, options, progress);
  result.profile = std::move(best.profile);
  result.judgement = std::move(best.judgement);
  result.inseparable = inseparable_pairs(questions, limits, options, result.judgement);
  return result;
}

}  // namespace zerodrift::diagnosis
