// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/trial.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>

#include "common/core/units.h"
#include "common/diagnosis/candidates.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/generic_functions.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/noise_weight.h"
#include "common/diagnosis/rounded_text.h"
#include "common/diagnosis/stochastic_effects.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::diagnosis {

using twin::EffectSpec;
using twin::ParameterDefinition;
using twin::ParameterRole;

namespace {

double mean_of(std::span<const double> values, std::span<const std::uint8_t> valid) {
  double sum = 0.0, count = 0.0;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (valid[i] == 0) continue;
    sum += values[i];
    count += 1.0;
  }
  return count > 0.0 ? sum / count : 0.0;
}

double angle_range_rad(const MeasuredSeries& series, core::Axis axis) {
  double angle = 0.0, low = 0.0, high = 0.0;
  for (const double rate : series.reference_radps[core::index(axis)]) {
    angle += rate * series.interval_s;
    low = std::min(low, angle);
    high = std::max(high, angle);
  }
  return high - low;
}

// Between two peaks of a scan over the angle: a quarter of its resolution at the period listed
// first.
ShapeRange reset_range(const ParameterDefinition& parameter, const Candidate& candidate,
                       const MeasuredSeries& series) {
  constexpr double kRadPerArcsec = core::kRadPerDeg / 3600.0;
  const double period_rad = candidate.variants.front().shapes.at(parameter.name) * kRadPerArcsec;
  const double range_rad = angle_range_rad(series, candidate.axis);
  if (!(range_rad > 0.0)) return {};
  return {ShapeScale::kLogarithmic, parameter.minimum, parameter.maximum,
          1.0 + 0.25 * period_rad / range_rad};
}

// Between the first two values listed.
double spacing_of(const std::string& parameter, const Candidate& candidate) {
  const double first = candidate.variants.front().shapes.at(parameter);
  for (const Variant& variant : candidate.variants) {
    const double value = variant.shapes.at(parameter);
    if (value != first) return std::abs(value - first);
  }
  return 1.0;
}

// How a shape parameter moves between the values listed.
ShapeRange range_of(const ParameterDefinition& parameter, const Candidate& candidate,
                    const MeasuredSeries& series) {
  const double lowest = parameter.minimum;
  const double highest = parameter.maximum;
  const double duration_s = series.interval_s * static_cast<double>(series.size);
  if (parameter.name == "frequency_hz")
    return {ShapeScale::kLinear, 0.5 / duration_s, 0.5 / series.interval_s, 0.25 / duration_s};
  if (parameter.name == "angle_arcsec") return reset_range(parameter, candidate, series);
  if (parameter.name == "period_degc") return {ShapeScale::kLogarithmic, lowest, highest, 1.02};
  if (parameter.name == "threshold_degc")
    return {ShapeScale::kLinear, lowest, highest, spacing_of(parameter.name, candidate)};
  if (parameter.name == "lag_s") return {ShapeScale::kLinear, lowest, duration_s / 4.0, 60.0};
  if (parameter.grid.size() < 2) return {};
  if (parameter.grid.front() > 0.0) {
    return {ShapeScale::kLogarithmic, parameter.grid.front() / 4.0, parameter.grid.back() * 4.0,
            parameter.grid[1] / parameter.grid[0]};
  }
  return {ShapeScale::kLinear, lowest, highest, parameter.grid[1] - parameter.grid[0]};
}

std::string family_of(const twin::EffectDefinition& definition) {
  for (const twin::Need need : definition.needs) {
    switch (need) {
      case twin::Need::kReferenceRate:
      case twin::Need::kSlowReferenceRate:
      case twin::Need::kCrossAxisRate:
        return "rate";
      case twin::Need::kMagnetic:
        return "magnetic";
      case twin::Need::kAcceleration:
        return "acceleration";
      case twin::Need::kVibration:
        return "vibration";
      case twin::Need::kSourceCurrent:
        return "source_current";
      case twin::Need::kSupply:
        return "supply";
      default:
        break;
    }
  }
  return definition.inputs.empty() ? "time" : "temperature";
}

std::string family_of(const std::string& channel) {
  for (const char* family : {"temperature", "rate", "magnetic", "acceleration", "vibration",
                             "source_current", "supply", "time"}) {
    if (channel.starts_with(family)) return family;
  }
  return {};
}

std::string parent_of(const std::string& kind) {
  if (kind == "coil_lag") return "shupe";                // tau -> 0
  if (kind == "modulator_reset") return "scale_factor";  // no fringe
  return {};
}

// A group's shape: which choice of inputs, then the kShape parameters in the definition's order.
struct ShapeCode {
  std::vector<std::vector<twin::TemperaturePoint>> choices{};
  std::vector<std::string> names{};

  explicit ShapeCode(const Candidate& candidate)
      : names(names_of(*candidate.definition, ParameterRole::kShape)) {
    for (const Variant& variant : candidate.variants) {
      if (std::find(choices.begin(), choices.end(), variant.inputs) == choices.end())
        choices.push_back(variant.inputs);
    }
  }

  [[nodiscard]] std::vector<double> encode(const Variant& variant) const {
    const auto choice = std::find(choices.begin(), choices.end(), variant.inputs);
    std::vector<double> shape{static_cast<double>(choice - choices.begin())};
    for (const std::string& name : names) shape.push_back(variant.shapes.at(name));
    return shape;
  }

  [[nodiscard]] Variant decode(const std::vector<double>& shape) const {
    Variant variant;
    variant.inputs = choices.at(static_cast<std::size_t>(std::llround(shape.front())));
    for (std::size_t i = 0; i < names.size(); ++i) variant.shapes[names[i]] = shape[i + 1];
    return variant;
  }
};

// The candidates of a search, with what is needed to read its answer.
struct Lineup {
  std::vector<Candidate> named{};
  std::vector<ShapeCode> codes{};
  std::vector<GenericFunction> generic{};
  std::vector<InputChannel> channels{};

  [[nodiscard]] const Candidate* find(const std::string& name) const {
    for (const Candidate& candidate : named) {
      if (candidate.definition->kind == name) return &candidate;
    }
    return nullptr;
  }
  [[nodiscard]] const ShapeCode& code_of(const Candidate& candidate) const {
    return codes[static_cast<std::size_t>(&candidate - named.data())];
  }
};

std::string generic_name(const GenericFunction& function) {
  std::string name = "f(" + function.depends_on.front();
  for (std::size_t i = 1; i < function.depends_on.size(); ++i)
    name += ", " + function.depends_on[i];
  return name + ")";
}

CandidateGroup group_of(const Candidate& candidate, const ShapeCode& code,
                        const TrialInput& input) {
  CandidateGroup group;
  group.name = candidate.definition->kind;
  group.family = family_of(*candidate.definition);
  group.parent = parent_of(group.name);
  for (const Variant& variant : candidate.variants)
    group.variants.push_back({code.encode(variant), variant.log_prior});
  group.ranges.push_back({});
  for (const ParameterDefinition& parameter : candidate.definition->parameters) {
    if (parameter.role == ParameterRole::kShape)
      group.ranges.push_back(range_of(parameter, candidate, input.series));
  }
  group.columns = [&candidate, &code, &input](const std::vector<double>& shape) {
    const twin::EffectContext context =
        context_of(candidate, code.decode(shape), input.series.interval_s);
    return columns_of(input.playback, *candidate.definition, context);
  };
  return group;
}

CandidateGroup group_of(const GenericFunction& function) {
  CandidateGroup group;
  group.name = generic_name(function);
  group.kind = CandidateKind::kGeneric;
  // A product belongs to the input that is not a temperature: without it there is no effect.
  for (const std::string& channel : function.depends_on) {
    const std::string family = family_of(channel);
    if (group.family.empty() || group.family == "temperature") group.family = family;
  }
  for (std::size_t i = 0; i < function.resolutions.size(); ++i)
    group.variants.push_back({.shape = {static_cast<double>(i)}});
  group.columns = [&function](const std::vector<double>& shape) {
    return function.resolutions.at(static_cast<std::size_t>(std::llround(shape.front())));
  };
  return group;
}

std::vector<KnownColumn> columns_of(const std::vector<KnownParameter>& known) {
  std::vector<KnownColumn> columns;
  columns.reserve(known.size());
  for (const KnownParameter& parameter : known) columns.push_back(parameter.column);
  return columns;
}

SearchOptions search_options(const DiagnosisOptions& options) {
  SearchOptions search;
  search.false_alarm = 0.5 * options.false_names_per_record;
  search.max_effects = options.most_effects;
  return search;
}

void take_groups(Trial& trial, const SearchReport& report) {
  for (const GroupFinding& group : report.groups) {
    if (group.kind == CandidateKind::kNamed && group.testability != Testability::kTestable) {
      trial.not_testable.push_back(
          {group.name, group.testability == Testability::kCollinear
                           ? "the record can't tell it from " + group.collinear_with
                           : "the record doesn't excite it"});
      continue;
    }
    trial.evidence.push_back({group.name, group.log_evidence, group.separation, group.rms});
    if (group.kind == CandidateKind::kNamed && std::isfinite(group.smallest_rms))
      trial.could_have_seen.push_back({group.name, group.smallest_rms});
  }
  std::stable_sort(
      trial.evidence.begin(), trial.evidence.end(),
      [](const Evidence& a, const Evidence& b) { return a.log_evidence > b.log_evidence; });
}

// Of what the model lists, with coefficients or without: what this record has no channel or no
// component for.
void tell_untestable(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : input.model.effects) {
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || definition == nullptr || !is_waveform(*definition)) continue;
    if (auto why = why_not_testable(*definition, input.series, input.playback, input.axis)) {
      trial.not_testable.push_back({spec.kind, std::move(*why)});
      continue;
    }
    const auto components =
        amplitudes_not_testable(*definition, input.series, input.playback, input.axis);
    trial.not_testable.insert(trial.not_testable.end(), components.begin(), components.end());
  }
}

// An effect that is listed without coefficients and got none is not passed over in silence.
void tell_unfitted(Trial& trial, const TrialInput& input) {
  for (const EffectSpec& spec : trial.repaired.effects) {
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || definition == nullptr || !spec.parameters.empty()) continue;
    if (definition->family == twin::Family::kRecordFault) continue;
    const bool is_told =
        std::any_of(trial.not_testable.begin(), trial.not_testable.end(),
                    [&](const NotTestable& entry) { return entry.name == spec.kind; });
    if (is_told) continue;
    trial.not_testable.push_back(
        {spec.kind,
         "listed without coefficients, and the record shows too little of it to fit them"});
  }
}

// Lists the effects that the model knows without parameters as candidates of a search of their own,
// and gives them what it finds.
void fit_listed(Trial& trial, const TrialInput& input) {
  twin::Model& model = trial.repaired;
  std::vector<std::size_t> waiting;
  twin::Model without = model;
  for (std::size_t i = 0; i < model.effects.size(); ++i) {
    const EffectSpec& spec = model.effects[i];
    const auto* definition = twin::find_effect(spec.kind);
    if (spec.axis != input.axis || !spec.parameters.empty() || definition == nullptr) continue;
    if (definition->family == twin::Family::kDeterministic && spec.kind != "bias")
      waiting.push_back(i);
  }
  if (waiting.empty()) return;
  std::erase_if(without.effects, [&](const EffectSpec& spec) {
    return spec.axis == input.axis && spec.parameters.empty();
  });
  const auto drift = input.playback.drift(without, input.axis);
  const auto residual = difference(measured_drift(input.series, input.axis), drift, input.valid);
  const auto known = known_parameters(without, input.axis, input.playback);
  Lineup lineup;
  const Candidates all = candidates(input.series, input.playback, without, input.axis, {});
  for (const std::size_t i : waiting) {
    for (const Candidate& candidate : all.testable) {
      if (candidate.definition->kind == model.effects[i].kind) lineup.named.push_back(candidate);
    }
  }
  for (const Candidate& candidate : lineup.named) lineup.codes.emplace_back(candidate);
  SearchProblem problem{
      .series = residual,
      .valid = input.valid,
      .interval_s = input.series.interval_s,
      .known = columns_of(known),
      .noise = noise_prior(model, input.axis, kModelNoiseSigma, valid_share(input.valid))};
  for (std::size_t i = 0; i < lineup.named.size(); ++i)
    problem.groups.push_back(group_of(lineup.named[i], lineup.codes[i], input));
  SearchOptions options = search_options(input.options);
  options.false_alarm = 0.1;  // they are known to be there
  const SearchReport report = search(problem, options);
  take_groups(trial, report);
  for (const FoundEffect& found : report.effects) {
    const Candidate* candidate = lineup.find(found.name);
    if (candidate == nullptr) continue;
    for (const std::size_t i : waiting) {
      EffectSpec& spec = model.effects[i];
      if (spec.kind != found.name || !spec.parameters.empty()) continue;
      const Variant variant = lineup.code_of(*candidate).decode(found.shape);
      spec.inputs.clear();
      for (const auto point : variant.inputs) spec.inputs.emplace_back(twin::name(point));
      spec.parameters = variant.shapes;
      for (std::size_t a = 0; a < candidate->amplitudes.size(); ++a) {
        const auto row = static_cast<Eigen::Index>(a);
        spec.parameters[candidate->amplitudes[a]] = found.amplitudes[a];
        if (!(found.covariance(row, row) > 0.0)) continue;  // nothing is known of it
        const double error = std::sqrt(found.covariance(row, row));
        spec.standard_errors[candidate->amplitudes[a]] = error;
        trial.recalibrated.push_back(
            {spec.kind, candidate->amplitudes[a], 0.0, found.amplitudes[a], error});
      }
    }
  }
}

// What is left after the search, with the known columns that were refitted: for the noise.
std::vector<double> remainder_of(const std::vector<double>& residual, const SearchReport& report,
                                 const std::vector<KnownColumn>& known,
                                 std::span<const std::uint8_t> valid) {
  std::vector<double> left = residual;
  const auto take_off = [&](const std::vector<double>& waveform, double factor) {
    for (std::size_t i = 0; i < left.size(); ++i) left[i] -= factor * waveform[i];
  };
  for (const FoundEffect& effect : report.effects) take_off(effect.waveform, 1.0);
  if (report.unknown) take_off(report.unknown->waveform, 1.0);
  for (std::size_t c = 0; c < report.corrections.size(); ++c) {
    if (report.corrections[c].testability == Testability::kTestable)
      take_off(known[c].values, report.corrections[c].value);
  }
  centre(left, valid);
  return left;
}

// `problem` has no groups yet: its search gives the noise beside the known effects alone, against
// which oscillations are seen.
Lineup line_up(const twin::Model& model, const TrialInput& input, const SearchProblem& problem,
               const std::vector<double>& residual, std::vector<NotTestable>& not_testable) {
  const SearchReport noise = search(problem, search_options(input.options));
  const bool fitted = noise.noise_squares.size() == noise.noise_terms.size();
  const std::vector<double> corrected = remainder_of(residual, noise, problem.known, input.valid);
  const std::size_t quick = quick_length(corrected.size());
  const auto variances =
      fitted ? dct_variances(noise.noise_terms, noise.noise_squares, quick, input.series.interval_s)
             : std::vector<double>(quick, 0.0);
  auto weighted = divided_by_noise(std::span(corrected).first(quick), variances);
  weighted.resize(corrected.size(), 0.0);
  const Oscillations oscillations =
      fitted ? find_oscillations(weighted, input.playback, input.axis) : Oscillations{};

  Lineup lineup;
  Candidates found = candidates(input.series, input.playback, model, input.axis, oscillations);
  lineup.named = std::move(found.testable);
  std::erase_if(lineup.named, [&](const Candidate& candidate) {
    return std::find(input.refuted.begin(), input.refuted.end(), candidate.definition->kind) !=
           input.refuted.end();
  });
  not_testable.insert(not_testable.end(), found.not_testable.begin(), found.not_testable.end());
  for (const Candidate& candidate : lineup.named) lineup.codes.emplace_back(candidate);
  lineup.channels = moving_inputs(input.series, input.axis);
  lineup.generic = generic_functions(lineup.channels, input.series.interval_s);
  return lineup;
}

NamedEffect named_effect(const FoundEffect& found, const Lineup& lineup) {
  NamedEffect effect;
  effect.name = found.name;
  effect.probability = found.probability;
  effect.log_evidence = found.log_evidence;
  for (const RankedName& ranked : found.credible_set) {
    if (ranked.name != found.name) effect.alternatives.push_back({ranked.name, ranked.probability});
  }
  const Candidate* candidate = lineup.find(found.name);
  if (candidate == nullptr) return effect;
  const Variant variant = lineup.code_of(*candidate).decode(found.shape);
  for (const auto point : variant.inputs) effect.inputs.emplace_back(twin::name(point));
  effect.parameters = candidate->conventions;
  for (const auto& [name, value] : variant.shapes) effect.parameters[name] = value;
  for (std::size_t a = 0; a < candidate->amplitudes.size(); ++a) {
    const auto row = static_cast<Eigen::Index>(a);
    effect.parameters[candidate->amplitudes[a]] = found.amplitudes[a];
    if (found.covariance(row, row) > 0.0)
      effect.standard_errors[candidate->amplitudes[a]] = std::sqrt(found.covariance(row, row));
  }
  return effect;
}

// r' C^-1 r of what an effect with these parameters would leave.
double misfit(const NamedEffect& effect, const std::vector<double>& without,
              const std::vector<double>& dct_variances, const TrialInput& input) {
  const EffectSpec spec{.kind = effect.name,
                        .axis = input.axis,
                        .parameters = effect.parameters,
                        .inputs = effect.inputs};
  const twin::EffectDefinition& definition = *twin::find_effect(effect.name);
  const auto waveform =
      input.playback.run(definition, context_of(spec, definition, input.series.interval_s));
  return weighted_square(difference(without, waveform, input.valid), input.valid, dct_variances);
}

// An effect without an amplitude has the size that its shape gives it: the shape that fits as it
// is, within a factor of five of the one whose column was chosen, or of what it would be if its
// waveform grew with it.
void fit_size(NamedEffect& effect, const Candidate& candidate, double factor,
              const std::vector<double>& without, const SearchReport& report,
              const TrialInput& input) {
  constexpr int kSteps = 60;
  const auto shapes = names_of(*candidate.definition, ParameterRole::kShape);
  if (!candidate.amplitudes.empty() || shapes.size() != 1) return;
  const auto variances = dct_variances(report.noise_terms, report.noise_squares,
                                       quick_length(without.size()), input.series.interval_s);
  const ParameterDefinition& parameter = *std::find_if(
      candidate.definition->parameters.begin(), candidate.definition->parameters.end(),
      [&](const ParameterDefinition& p) { return p.name == shapes.front(); });
  double& value = effect.parameters[shapes.front()];
  const double chosen = value;
  double best = chosen;
  double least = std::numeric_limits<double>::infinity();
  for (const double around : {chosen, chosen * factor}) {
    for (int step = -kSteps; step <= kSteps; ++step) {
      value = around * std::pow(5.0, static_cast<double>(step) / kSteps);
      if (!(value >= parameter.minimum && value <= parameter.maximum)) continue;
      const double left = misfit(effect, without, variances, input);
      if (left < least) {
        least = left;
        best = value;
      }
    }
  }
  value = best;
}

std::string shape_in_words(const std::vector<double>& input, const std::vector<double>& rate,
                           const InputChannel& channel) {
  const auto largest = std::max_element(
      rate.begin(), rate.end(), [](double a, double b) { return std::abs(a) < std::abs(b); });
  const double at = input[static_cast<std::size_t>(largest - rate.begin())];
  const bool inside = largest != rate.begin() && largest + 1 != rate.end();
  const std::string place = rounded(at) + " " + channel.unit + " in " + channel.name;
  return (inside ? "bump at " : "grows towards ") + place;
}

// Mean of the waveform over quantile bins of the channel.
void tabulate(UnknownEffect& unknown, const InputChannel& channel,
              const std::vector<double>& waveform) {
  constexpr std::size_t kBins = 24;
  std::vector<std::size_t> order(channel.values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
    return channel.values[a] < channel.values[b];
  });
  for (std::size_t bin = 0; bin < kBins; ++bin) {
    const std::size_t begin = order.size() * bin / kBins;
    const std::size_t end = order.size() * (bin + 1) / kBins;
    if (begin == end) continue;
    double x = 0.0, y = 0.0;
    for (std::size_t i = begin; i < end; ++i) {
      x += channel.values[order[i]];
      y += waveform[order[i]];
    }
    const auto count = static_cast<double>(end - begin);
    unknown.input.push_back(x / count);
    unknown.rate_radps.push_back(y / count);
  }
}

UnknownEffect unknown_effect(const FoundEffect& found, const Lineup& lineup) {
  UnknownEffect unknown;
  unknown.rms_radps = found.rms;
  for (const GenericFunction& function : lineup.generic) {
    if (generic_name(function) == found.name) unknown.depends_on = function.depends_on;
  }
  unknown.description = "something that depends on " + found.name.substr(2, found.name.size() - 3);
  for (const InputChannel& channel : lineup.channels) {
    if (unknown.depends_on.empty() || channel.name != unknown.depends_on.front()) continue;
    tabulate(unknown, channel, found.waveform);
    if (unknown.depends_on.size() == 1)
      unknown.description = shape_in_words(unknown.input, unknown.rate_radps, channel);
  }
  return unknown;
}

void add_to_model(Trial& trial, const TrialInput& input) {
  for (const NamedEffect& effect : trial.effects) {
    trial.repaired.effects.push_back(
        {.kind = effect.name,
         .axis = input.axis,
         .parameters = effect.parameters,
         .standard_errors = effect.standard_errors,
         .inputs = effect.inputs,
         .origin = {.by = "diagnose",
                    .record = input.options.record,
                    .date = input.options.date,
                    .evidence = "log Bayes factor " + rounded(effect.log_evidence)}});
  }
}

NoiseFindings noise_of(const std::vector<double>& remainder, const TrialInput& input,
                       const SearchProblem& problem, const twin::Model& model) {
  const SearchProblem of_noise{.series = remainder,
                               .valid = problem.valid,
                               .interval_s = problem.interval_s,
                               .known = problem.known};
  return examine_noise({of_noise, model, input.axis, 0.5 * input.options.false_names_per_record},
                       search_options(input.options));
}

void take_noise(Trial& trial, const TrialInput& input, const NoiseFindings& noise) {
  trial.noise_dct_variances =
      dct_variances(noise.terms, noise.squares, input.series.size, input.series.interval_s);
  adopt_noise(trial.repaired, input.axis, noise,
              {.by = "diagnose",
               .record = input.options.record,
               .date = input.options.date,
               .evidence = "noise spectrum"});
  trial.effects.insert(trial.effects.end(), noise.effects.begin(), noise.effects.end());
  trial.recalibrated.insert(trial.recalibrated.end(), noise.recalibrated.begin(),
                            noise.recalibrated.end());
}

// The bias takes up the mean that is left where it is more than slow noise makes of a mean.
void recalibrate_bias(Trial& trial, const TrialInput& input, double mean_radps) {
  constexpr double kSigmas = 3.0;
  constexpr double kMeanS = 60.0;
  const auto block = static_cast<std::size_t>(std::max(1.0, kMeanS / input.series.interval_s));
  const double slow = expected_rms_of_block_means(trial.noise_dct_variances, block);
  if (std::abs(mean_radps) <= kSigmas * slow) return;
  const double to = shift_bias(trial.repaired, input.axis, mean_radps);
  trial.recalibrated.push_back({"bias", "bias_deg_h", to - core::deg_h_from_radps(mean_radps), to,
                                core::deg_h_from_radps(slow)});
}

// A name that was chosen in the light of one state of the search may look worse in another one, or
// once a noise is split into two readings. Then it can't be told from the names that look better:
// all of them are as probable.
void level(NamedEffect& effect) {
  double sum = effect.probability;
  double count = 1.0;
  for (const Alternative& other : effect.alternatives) {
    if (other.probability <= effect.probability) continue;
    sum += other.probability;
    count += 1.0;
  }
  for (Alternative& other : effect.alternatives) {
    if (other.probability > effect.probability) other.probability = sum / count;
  }
  effect.probability = sum / count;
}

double evidence_of(const SearchReport& report) {
  double sum = report.unknown ? report.unknown->log_evidence : 0.0;
  for (const FoundEffect& effect : report.effects) sum += effect.log_evidence;
  return sum;
}

double evidence_of(const NoiseFindings& noise) {
  double sum = 0.0;
  for (const NamedEffect& effect : noise.effects) sum += effect.log_evidence;
  return sum;
}

// An unknown dependence on an input, told by a spline, leaves a remainder that effects of the same
// input seem to explain: with an unknown of their family none of them is named.
SearchReport search_without_family_of_unknown(SearchProblem& problem,
                                              const SearchOptions& options) {
  SearchReport report = search(problem, options);
  if (!report.unknown || report.effects.empty()) return report;
  const auto family = [&](const std::string& group_name) {
    for (const CandidateGroup& group : problem.groups) {
      if (group.name == group_name) return group.family;
    }
    return std::string();
  };
  const std::string of_unknown = family(report.unknown->name);
  const auto named_there =
      std::count_if(report.effects.begin(), report.effects.end(),
                    [&](const FoundEffect& effect) { return family(effect.name) == of_unknown; });
  if (named_there == 0) return report;
  std::erase_if(problem.groups, [&](const CandidateGroup& group) {
    return group.kind == CandidateKind::kNamed && group.family == of_unknown;
  });
  SearchReport again = search(problem, options);
  again.groups = std::move(report.groups);
  return again;
}

// The amplitudes once more beside the known parameters that were found wrong; the others stay as
// the model has them. In the search all were free, so that a small error of theirs is not mistaken
// for an effect; but corrections within their errors make a twin worse elsewhere.
void settle_amplitudes(SearchReport& report, SearchProblem problem, const SearchOptions& options) {
  std::vector<KnownColumn> wrong;
  for (std::size_t i = 0; i < report.corrections.size(); ++i) {
    if (!report.corrections[i].significant) continue;
    wrong.push_back(problem.known[i]);
    wrong.back().prior_sd = std::numeric_limits<double>::infinity();
  }
  problem.known = std::move(wrong);
  std::vector<CandidateGroup> chosen;
  const auto choose = [&](const FoundEffect& effect) {
    for (const CandidateGroup& group : problem.groups) {
      if (group.name != effect.name) continue;
      chosen.push_back(group);
      chosen.back().kind = CandidateKind::kNamed;
      chosen.back().variants = {{.shape = effect.shape}};
      chosen.back().ranges.clear();
      chosen.back().parent.clear();
    }
  };
  for (const FoundEffect& effect : report.effects) choose(effect);
  if (report.unknown) choose(*report.unknown);
  problem.groups = std::move(chosen);
  SearchOptions certain = options;
  certain.false_alarm = 0.49;
  certain.form_mismatch_share = 1e-6;
  certain.max_effects = std::max<std::size_t>(1, problem.groups.size());
  const SearchReport settled = search(problem, certain);
  const bool fits =
      settled.outcome != SearchOutcome::kRefused && settled.effects.size() == problem.groups.size();
  if (!fits) return;  // keep what fits together
  const auto take = [&](FoundEffect& effect) {
    for (const FoundEffect& now : settled.effects) {
      if (now.name != effect.name) continue;
      effect.amplitudes = now.amplitudes;
      effect.covariance = now.covariance;
      effect.waveform = now.waveform;
      effect.rms = now.rms;
    }
  };
  for (FoundEffect& effect : report.effects) take(effect);
  if (report.unknown) take(*report.unknown);
  std::size_t of_settled = 0;
  for (CorrectionFinding& correction : report.corrections) {
    correction.value = 0.0;
    if (!correction.significant) continue;
    const CorrectionFinding& now = settled.corrections[of_settled++];
    correction.value = now.value;
    correction.standard_error = now.standard_error;
  }
}

// A missing kind of noise looks like missing effects, and the other way round. First the model's
// own kinds of noise only: flexible noise would absorb effects. Where a kind is missing beside what
// was found, or explains the record better than all that was found with it, the search is made
// again with it.
SearchReport search_beside_noise(SearchProblem& problem, const TrialInput& input,
                                 const twin::Model& model, const std::vector<double>& residual) {
  const SearchOptions options = search_options(input.options);
  const std::size_t listed = problem.noise.known.size();
  if (listed == 0) return search_without_family_of_unknown(problem, options);
  problem.noise.unlisted = UnlistedNoise::kExcluded;
  SearchReport report = search_without_family_of_unknown(problem, options);
  if (report.outcome == SearchOutcome::kRefused) return report;
  NoiseFindings noise =
      noise_of(remainder_of(residual, report, problem.known, input.valid), input, problem, model);
  if (!report.effects.empty() || report.unknown) {
    NoiseFindings alone = noise_of(residual, input, problem, model);
    if (evidence_of(alone) > evidence_of(report) + evidence_of(noise)) noise = std::move(alone);
  }
  if (noise.effects.empty()) return report;
  const double share = valid_share(input.valid);
  for (std::size_t t = listed; t < noise.terms.size(); ++t) {
    const double seen = noise.squares[t] * seen_share(noise.terms[t].kind, share);
    problem.noise.known.push_back({noise.terms[t], seen, kModelNoiseSigma});
  }
  return search_without_family_of_unknown(problem, options);
}

}  // namespace

std::vector<double> measured_drift(const MeasuredSeries& series, core::Axis axis) {
  const std::size_t a = core::index(axis);
  return difference(series.rate_radps[a], series.reference_radps[a], series.valid[a]);
}

std::vector<double> difference(std::span<const double> a, std::span<const double> b,
                               std::span<const std::uint8_t> valid) {
  std::vector<double> result(a.size(), 0.0);
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (valid[i] != 0) result[i] = a[i] - b[i];
  }
  return result;
}

Trial repair(const TrialInput& input) {
  Trial trial{.repaired = input.model};
  tell_untestable(trial, input);
  fit_listed(trial, input);
  const auto residual = difference(measured_drift(input.series, input.axis),
                                   input.playback.drift(trial.repaired, input.axis), input.valid);
  const auto known = known_parameters(trial.repaired, input.axis, input.playback);
  SearchProblem problem{
      .series = residual,
      .valid = input.valid,
      .interval_s = input.series.interval_s,
      .known = columns_of(known),
      .noise = noise_prior(trial.repaired, input.axis, kModelNoiseSigma, valid_share(input.valid))};
  const Lineup lineup = line_up(trial.repaired, input, problem, residual, trial.not_testable);
  for (std::size_t i = 0; i < lineup.named.size(); ++i)
    problem.groups.push_back(group_of(lineup.named[i], lineup.codes[i], input));
  for (const GenericFunction& function : lineup.generic)
    problem.groups.push_back(group_of(function));

  SearchReport report = search_beside_noise(problem, input, trial.repaired, residual);
  if (report.outcome == SearchOutcome::kRefused) {
    trial.refusal = report.reason;
    return trial;
  }
  settle_amplitudes(report, problem, search_options(input.options));
  take_groups(trial, report);
  const auto remainder = remainder_of(residual, report, problem.known, input.valid);
  for (const FoundEffect& found : report.effects) {
    NamedEffect effect = named_effect(found, lineup);
    effect.share_of_gap = found.rms * found.rms;
    std::vector<double> without = remainder;
    for (std::size_t i = 0; i < without.size(); ++i) without[i] += found.waveform[i];
    if (const Candidate* candidate = lineup.find(found.name))
      fit_size(effect, *candidate, found.amplitudes.front(), without, report, input);
    trial.effects.push_back(std::move(effect));
  }
  if (report.unknown) trial.unknown = unknown_effect(*report.unknown, lineup);
  const auto changes = recalibrate(trial.repaired, known, report.corrections);
  trial.recalibrated.insert(trial.recalibrated.end(), changes.begin(), changes.end());
  add_to_model(trial, input);
  take_noise(trial, input, noise_of(remainder, input, problem, trial.repaired));
  const auto left = difference(measured_drift(input.series, input.axis),
                               input.playback.drift(trial.repaired, input.axis), input.valid);
  recalibrate_bias(trial, input, mean_of(left, input.valid));
  tell_unfitted(trial, input);
  for (NamedEffect& effect : trial.effects) level(effect);
  return trial;
}

}  // namespace zerodrift::diagnosis
