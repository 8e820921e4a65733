// SPDX-License-Identifier: Apache-2.0
#include "tests/blind/baselines.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <stdexcept>

#include "common/diagnosis/candidates.h"
#include "common/diagnosis/gap.h"
#include "common/diagnosis/known_effects.h"
#include "common/diagnosis/playback.h"
#include "common/diagnosis/trial.h"
#include "common/twin/effect_catalogue.h"

namespace zerodrift::blind {
namespace {

using diagnosis::Candidate;
using diagnosis::CorrectionFinding;
using diagnosis::KnownParameter;
using diagnosis::MeasuredSeries;
using diagnosis::NamedEffect;
using diagnosis::Playback;
using diagnosis::Variant;

constexpr double kMeanS = 60.0;        // RMS figures are of means over this
constexpr double kKeptShare = 1e-6;    // of a column's square norm; with less it says nothing new
constexpr double kSmallRidge = 1e-12;  // of the largest diagonal: columns may be collinear
constexpr std::size_t kStlsqTurns = 20;

// A variant of a candidate as columns over the valid samples, without their means.
struct Regressor {
  const Candidate* candidate = nullptr;
  const Variant* variant = nullptr;
  Eigen::MatrixXd columns{};
};

// Orthonormal columns that were taken already, and the square sum of what they leave of a series.
class Basis {
 public:
  explicit Basis(Eigen::Index rows) : q_(rows, 0) {}

  // What is left of the columns; those with next to nothing left are not among them.
  [[nodiscard]] Eigen::MatrixXd orthonormal_remainder(const Eigen::MatrixXd& columns) const {
    Eigen::MatrixXd kept(columns.rows(), 0);
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
      Eigen::VectorXd left = columns.col(c);
      const double whole = left.squaredNorm();
      for (int pass = 0; pass < 2; ++pass) {  // twice is enough (Kahan, Parlett)
        left -= q_ * (q_.transpose() * left);
        left -= kept * (kept.transpose() * left);
      }
      const double square = left.squaredNorm();
      if (!(square > kKeptShare * whole)) continue;
      kept.conservativeResize(Eigen::NoChange, kept.cols() + 1);
      kept.rightCols(1) = left / std::sqrt(square);
    }
    return kept;
  }
  void take(const Eigen::MatrixXd& columns) {
    const Eigen::MatrixXd more = orthonormal_remainder(columns);
    const Eigen::Index before = q_.cols();
    q_.conservativeResize(Eigen::NoChange, before + more.cols());
    q_.rightCols(more.cols()) = more;
  }
  [[nodiscard]] Eigen::VectorXd remainder(const Eigen::VectorXd& series) const {
    return series - q_ * (q_.transpose() * series);
  }

 private:
  Eigen::MatrixXd q_;
};

struct Fit {
  Eigen::VectorXd amplitudes;
  Eigen::VectorXd standard_errors;
  double square_sum = 0.0;  // of what is left
};

// Columns are scaled to unit norm for the solution.
Fit least_squares(const Eigen::MatrixXd& columns, const Eigen::VectorXd& series) {
  Fit fit{Eigen::VectorXd::Zero(columns.cols()), Eigen::VectorXd::Zero(columns.cols()),
          series.squaredNorm()};
  if (columns.cols() == 0) return fit;
  Eigen::VectorXd scale = columns.colwise().norm().transpose();
  scale = (scale.array() > 0.0).select(scale, 1.0);
  const Eigen::MatrixXd unit = columns * scale.cwiseInverse().asDiagonal();
  Eigen::MatrixXd gram = unit.transpose() * unit;
  gram.diagonal().array() += kSmallRidge * gram.diagonal().maxCoeff();
  const Eigen::LDLT<Eigen::MatrixXd> solver(gram);
  const Eigen::VectorXd x = solver.solve(unit.transpose() * series);
  const auto k = columns.cols();
  const Eigen::MatrixXd inverse = solver.solve(Eigen::MatrixXd::Identity(k, k));
  fit.square_sum = (series - unit * x).squaredNorm();
  const double freedom = std::max<double>(1.0, static_cast<double>(columns.rows() - k - 1));
  const double variance = fit.square_sum / freedom;
  fit.amplitudes = x.cwiseQuotient(scale);
  fit.standard_errors =
      (inverse.diagonal().cwiseMax(0.0) * variance).cwiseSqrt().cwiseQuotient(scale);
  return fit;
}

double bic(double square_sum, Eigen::Index rows, double parameters) {
  const auto n = static_cast<double>(rows);
  return n * std::log(std::max(square_sum, std::numeric_limits<double>::min()) / n) +
         parameters * std::log(n);
}

double parameters_of(const Regressor& regressor) {
  return static_cast<double>(regressor.columns.cols()) +
         static_cast<double>(regressor.variant->shapes.size());
}

struct Chosen {
  Regressor regressor;
  double log_evidence = 0.0;  // half of what BIC loses with it
};

Eigen::MatrixXd joined(const Eigen::MatrixXd& known, const std::vector<Chosen>& chosen,
                       std::size_t without = std::numeric_limits<std::size_t>::max()) {
  Eigen::MatrixXd all = known;
  for (std::size_t i = 0; i < chosen.size(); ++i) {
    if (i == without) continue;
    const Eigen::MatrixXd& more = chosen[i].regressor.columns;
    all.conservativeResize(known.rows(), all.cols() + more.cols());
    all.rightCols(more.cols()) = more;
  }
  return all;
}

class AxisRegression {
 public:
  AxisRegression(const BaselineOptions& options, const twin::Model& model,
                 const MeasuredSeries& series, const Playback& playback, core::Axis axis)
      : options_(options), model_(model), series_(series), playback_(playback), axis_(axis) {
    const auto& valid = series.valid[core::index(axis)];
    for (std::size_t i = 0; i < valid.size(); ++i) {
      if (valid[i] != 0) rows_.push_back(i);
    }
    const auto drift = playback.drift(model, axis);
    const auto residual =
        diagnosis::difference(diagnosis::measured_drift(series, axis), drift, valid);
    residual_ = centred(residual);
    known_ = diagnosis::known_parameters(model, axis, playback);
    known_columns_.resize(rows(), static_cast<Eigen::Index>(known_.size()));
    for (std::size_t i = 0; i < known_.size(); ++i)
      known_columns_.col(static_cast<Eigen::Index>(i)) = centred(known_[i].column.values);
  }

  diagnosis::AxisDiagnosis run(twin::Model& repaired) {
    diagnosis::AxisDiagnosis result;
    if (rows() < 2 || !(residual_.squaredNorm() > 0.0)) {
      result.sentence = "This axis has no rate that moves.";
      return result;
    }
    line_up_candidates(result);
    fit_listed();
    const std::vector<Regressor> regressors = make_regressors();
    std::vector<Chosen> chosen =
        options_.method == Method::kStepwiseBic ? stepwise(regressors) : thresholded(regressors);
    weigh(chosen);
    take(chosen, result, repaired);
    return result;
  }

 private:
  [[nodiscard]] Eigen::Index rows() const { return static_cast<Eigen::Index>(rows_.size()); }

  [[nodiscard]] Eigen::VectorXd centred(const std::vector<double>& values) const {
    Eigen::VectorXd column(rows());
    for (Eigen::Index r = 0; r < rows(); ++r)
      column(r) = values[rows_[static_cast<std::size_t>(r)]];
    column.array() -= column.mean();
    return column;
  }

  void line_up_candidates(diagnosis::AxisDiagnosis& result) {
    Basis known(rows());
    known.take(known_columns_);
    const Eigen::VectorXd left = known.remainder(residual_);
    const double variance = left.squaredNorm() / static_cast<double>(rows());
    std::vector<double> weighted(series_.size, 0.0);
    for (Eigen::Index r = 0; r < rows(); ++r)
      weighted[rows_[static_cast<std::size_t>(r)]] = left(r) / variance;
    const std::vector<double> white(series_.size, variance);
    const auto scans = diagnosis::scan_residual(weighted, white, playback_, axis_);
    candidates_ = diagnosis::candidates(series_, playback_, model_, axis_, scans);
    result.not_testable = candidates_.not_testable;
    const auto is_listed = [](const Candidate& candidate) { return candidate.is_listed; };
    std::copy_if(candidates_.testable.begin(), candidates_.testable.end(),
                 std::back_inserter(listed_candidates_), is_listed);
    std::erase_if(candidates_.testable, is_listed);
  }

  [[nodiscard]] Regressor regressor_of(const Candidate& candidate, const Variant& variant) const {
    Regressor regressor{&candidate, &variant, {}};
    const auto columns = columns_of(playback_, *candidate.definition,
                                    diagnosis::context_of(candidate, variant, series_.interval_s));
    regressor.columns.resize(rows(), static_cast<Eigen::Index>(columns.size()));
    for (std::size_t c = 0; c < columns.size(); ++c)
      regressor.columns.col(static_cast<Eigen::Index>(c)) = centred(columns[c]);
    return regressor;
  }

  [[nodiscard]] static double explained(const Regressor& regressor, const Basis& basis,
                                        const Eigen::VectorXd& left) {
    if (!regressor.columns.allFinite()) return 0.0;
    return (basis.orthonormal_remainder(regressor.columns).transpose() * left).squaredNorm();
  }

  // Effects that the model lists without parameters are there: the variant that explains most of
  // each belongs to the known columns.
  void fit_listed() {
    for (const Candidate& candidate : listed_candidates_) {
      Basis basis(rows());
      basis.take(joined(known_columns_, listed_));
      const Eigen::VectorXd left = basis.remainder(residual_);
      Regressor best;
      double most = 0.0;
      for (const Variant& variant : candidate.variants) {
        Regressor regressor = regressor_of(candidate, variant);
        const double gain = explained(regressor, basis, left);
        if (gain <= most) continue;
        most = gain;
        best = std::move(regressor);
      }
      if (most > 0.0) listed_.push_back({std::move(best)});
    }
  }

  [[nodiscard]] std::vector<Regressor> make_regressors() const {
    std::vector<Regressor> all;
    for (const Candidate& candidate : candidates_.testable) {
      for (const Variant& variant : candidate.variants)
        all.push_back(regressor_of(candidate, variant));
    }
    return all;
  }

  [[nodiscard]] Eigen::MatrixXd fixed() const { return joined(known_columns_, listed_); }
  [[nodiscard]] double fixed_parameters() const { return static_cast<double>(fixed().cols() + 1); }

  [[nodiscard]] static double parameters_of_all(const std::vector<Chosen>& chosen) {
    double sum = 0.0;
    for (const Chosen& one : chosen) sum += parameters_of(one.regressor);
    return sum;
  }

  [[nodiscard]] double bic_of(const std::vector<Chosen>& chosen) const {
    return bic(least_squares(joined(fixed(), chosen), residual_).square_sum, rows(),
               fixed_parameters() + parameters_of_all(chosen));
  }

  [[nodiscard]] std::vector<Chosen> stepwise(const std::vector<Regressor>& regressors) const {
    std::vector<Chosen> chosen;
    while (chosen.size() < options_.most_effects) {
      Basis basis(rows());
      basis.take(joined(fixed(), chosen));
      const Eigen::VectorXd left = basis.remainder(residual_);
      const double square_sum = left.squaredNorm();
      const double parameters = fixed_parameters() + parameters_of_all(chosen);
      double lowest = bic(square_sum, rows(), parameters);
      const Regressor* best = nullptr;
      for (const Regressor& regressor : regressors) {
        if (holds(chosen, regressor)) continue;
        const double with = bic(square_sum - explained(regressor, basis, left), rows(),
                                parameters + parameters_of(regressor));
        if (with >= lowest) continue;
        lowest = with;
        best = &regressor;
      }
      if (best == nullptr) break;
      chosen.push_back({*best});
      drop_useless(chosen);
    }
    return chosen;
  }

  [[nodiscard]] static bool holds(const std::vector<Chosen>& chosen, const Regressor& regressor) {
    return std::any_of(chosen.begin(), chosen.end(), [&](const Chosen& one) {
      return one.regressor.candidate == regressor.candidate;
    });
  }

  // All but the newest: each step lowers BIC, so the search ends.
  void drop_useless(std::vector<Chosen>& chosen) const {
    for (std::size_t i = 0; i + 1 < chosen.size();) {
      std::vector<Chosen> fewer = chosen;
      fewer.erase(fewer.begin() + static_cast<std::ptrdiff_t>(i));
      if (bic_of(fewer) < bic_of(chosen)) {
        chosen = std::move(fewer);
      } else {
        ++i;
      }
    }
  }

  [[nodiscard]] std::vector<Chosen> thresholded(const std::vector<Regressor>& regressors) const {
    Basis basis(rows());
    basis.take(fixed());
    const Eigen::VectorXd left = basis.remainder(residual_);
    std::vector<Chosen> chosen;
    for (const Candidate& candidate : candidates_.testable) {
      const Regressor* best = nullptr;
      double most = 0.0;
      for (const Regressor& regressor : regressors) {
        if (regressor.candidate != &candidate) continue;
        const double gain = explained(regressor, basis, left);
        if (gain <= most) continue;
        most = gain;
        best = &regressor;
      }
      if (best != nullptr) chosen.push_back({*best});
    }
    for (std::size_t turn = 0; turn < kStlsqTurns; ++turn) {
      const Fit fit = least_squares(joined(fixed(), chosen), residual_);
      const double limit = options_.threshold * std::sqrt(fit.square_sum);
      Eigen::Index column = fixed().cols();
      const std::size_t before = chosen.size();
      std::erase_if(chosen, [&](const Chosen& one) {
        const Eigen::Index width = one.regressor.columns.cols();
        const double size = (one.regressor.columns * fit.amplitudes.segment(column, width)).norm();
        column += width;
        return size < limit;
      });
      if (chosen.size() == before) break;
    }
    return chosen;
  }

  void weigh(std::vector<Chosen>& chosen) const {
    const double with = bic_of(chosen);
    for (std::size_t i = 0; i < chosen.size(); ++i) {
      std::vector<Chosen> without = chosen;
      without.erase(without.begin() + static_cast<std::ptrdiff_t>(i));
      chosen[i].log_evidence = 0.5 * (bic_of(without) - with);
    }
    std::stable_sort(chosen.begin(), chosen.end(), [](const Chosen& a, const Chosen& b) {
      return a.log_evidence > b.log_evidence;
    });
  }

  // Parameters and errors of one effect from its place in the joint fit.
  static void read(const Regressor& regressor, const Fit& fit, Eigen::Index column,
                   NamedEffect& effect) {
    const Candidate& candidate = *regressor.candidate;
    effect.name = candidate.definition->kind;
    for (const auto point : regressor.variant->inputs) effect.inputs.emplace_back(name(point));
    effect.parameters = candidate.conventions;
    for (const auto& [key, value] : regressor.variant->shapes) effect.parameters[key] = value;
    for (const std::string& amplitude : candidate.amplitudes) {
      effect.parameters[amplitude] = fit.amplitudes(column);
      effect.standard_errors[amplitude] = fit.standard_errors(column);
      ++column;
    }
    // Without an amplitude of its own a small delay is as large as its column has to be.
    if (effect.name == "clock_offset") effect.parameters["delay_s"] *= fit.amplitudes(column);
  }

  void take(const std::vector<Chosen>& chosen, diagnosis::AxisDiagnosis& result,
            twin::Model& repaired) const {
    const Fit fit = least_squares(joined(fixed(), chosen), residual_);
    Eigen::Index column = take_corrections(fit, !chosen.empty(), result, repaired);
    for (const Chosen& one : listed_) {
      NamedEffect effect;
      read(one.regressor, fit, column, effect);
      column += one.regressor.columns.cols();
      for (twin::EffectSpec& spec : repaired.effects) {
        if (spec.axis != axis_ || spec.kind != effect.name || !spec.parameters.empty()) continue;
        spec.parameters = effect.parameters;
        spec.standard_errors = effect.standard_errors;
        spec.inputs = effect.inputs;
      }
    }
    for (const Chosen& one : chosen) {
      NamedEffect effect;
      effect.probability = 1.0;
      effect.log_evidence = one.log_evidence;
      read(one.regressor, fit, column, effect);
      column += one.regressor.columns.cols();
      repaired.effects.push_back({.kind = effect.name,
                                  .axis = axis_,
                                  .parameters = effect.parameters,
                                  .standard_errors = effect.standard_errors,
                                  .inputs = effect.inputs,
                                  .origin = {.by = "baseline",
                                             .record = options_.record,
                                             .date = options_.date,
                                             .evidence = "least squares"}});
      result.effects.push_back(std::move(effect));
    }
    const auto& valid = series_.valid[core::index(axis_)];
    const auto left = diagnosis::difference(diagnosis::measured_drift(series_, axis_),
                                            playback_.drift(repaired, axis_), valid);
    double mean = 0.0;
    for (const std::size_t i : rows_) mean += left[i];
    diagnosis::shift_bias(repaired, axis_, mean / static_cast<double>(rows_.size()));
  }

  // What a correction must be worth to be told and, where nothing was chosen, to be made: BIC.
  Eigen::Index take_corrections(const Fit& fit, bool all, diagnosis::AxisDiagnosis& result,
                                twin::Model& repaired) const {
    const double limit = std::log(static_cast<double>(rows()));
    std::vector<CorrectionFinding> corrections;
    for (Eigen::Index i = 0; i < static_cast<Eigen::Index>(known_.size()); ++i) {
      const double t =
          fit.standard_errors(i) > 0.0 ? fit.amplitudes(i) / fit.standard_errors(i) : 0.0;
      corrections.push_back({.name = known_[static_cast<std::size_t>(i)].parameter,
                             .value = fit.amplitudes(i),
                             .standard_error = fit.standard_errors(i),
                             .log_evidence = 0.5 * (t * t - limit),
                             .significant = t * t > limit});
      all = all || corrections.back().significant;
    }
    if (all) result.recalibrated = diagnosis::recalibrate(repaired, known_, corrections);
    return static_cast<Eigen::Index>(known_.size());
  }

  const BaselineOptions& options_;
  const twin::Model& model_;
  const MeasuredSeries& series_;
  const Playback& playback_;
  core::Axis axis_;
  std::vector<std::size_t> rows_;
  Eigen::VectorXd residual_;
  std::vector<KnownParameter> known_;
  Eigen::MatrixXd known_columns_;
  diagnosis::Candidates candidates_;
  std::vector<Candidate> listed_candidates_;
  std::vector<Chosen> listed_;
};

diagnosis::Gap gap_on(const MeasuredSeries& series, const Playback& playback,
                      const twin::Model& before, const twin::Model& after, core::Axis axis) {
  const auto& valid = series.valid[core::index(axis)];
  const auto measured = diagnosis::measured_drift(series, axis);
  const auto block =
      static_cast<std::size_t>(std::max(1.0, std::round(kMeanS / series.interval_s)));
  const auto rms = [&](const twin::Model& model) {
    return diagnosis::rms_of_block_means(
               diagnosis::difference(measured, playback.drift(model, axis), valid), valid, block)
        .about_zero;
  };
  return {.before_rms_radps = rms(before), .after_rms_radps = rms(after)};
}

diagnosis::AllanDistance allan_on(const MeasuredSeries& series, const Playback& playback,
                                  const twin::Model& before, const twin::Model& after,
                                  core::Axis axis) {
  const auto measured = diagnosis::measured_drift(series, axis);
  const auto drift_before = playback.drift(before, axis);
  const auto drift_after = playback.drift(after, axis);
  const auto noise_before = diagnosis::model_noise(before, axis, series.interval_s, series.size);
  const auto noise_after = diagnosis::model_noise(after, axis, series.interval_s, series.size);
  return diagnosis::allan_distance(
      diagnosis::allan_curves(measured, series.valid[core::index(axis)], series.interval_s,
                              {drift_before, noise_before}, {drift_after, noise_after}));
}

void prove(diagnosis::AxisDiagnosis& result, const std::vector<MeasuredSeries>& validation,
           const std::vector<Playback>& playbacks, const twin::Model& before,
           const twin::Model& after, core::Axis axis) {
  double records = 0.0;
  const auto add_square = [](double& sum, double value) { sum += value * value; };
  for (std::size_t i = 0; i < validation.size(); ++i) {
    if (!validation[i].has(axis)) continue;
    const auto gap = gap_on(validation[i], playbacks[i], before, after, axis);
    const auto distance = allan_on(validation[i], playbacks[i], before, after, axis);
    add_square(result.held_out.before_rms_radps, gap.before_rms_radps);
    add_square(result.held_out.after_rms_radps, gap.after_rms_radps);
    result.allan_log_distance.before += distance.before;
    result.allan_log_distance.after += distance.after;
    records += 1.0;
  }
  if (records == 0.0) return;
  result.held_out_kind = diagnosis::HeldOut::kRecords;
  for (double* square : {&result.held_out.before_rms_radps, &result.held_out.after_rms_radps})
    *square = std::sqrt(*square / records);
  result.allan_log_distance.before /= records;
  result.allan_log_distance.after /= records;
}

void settle(diagnosis::AxisDiagnosis& result) {
  using diagnosis::Verdict;
  const bool named = !result.effects.empty();
  result.verdict = named                         ? Verdict::kEffectNamed
                   : result.recalibrated.empty() ? Verdict::kConsistent
                                                 : Verdict::kRecalibrated;
  result.acceptance = result.verdict == Verdict::kConsistent
                          ? diagnosis::Acceptance::kNothingToProve
                          : diagnosis::Acceptance::kAccepted;
  if (!result.sentence.empty()) return;
  result.sentence = named ? "Missing:" : "Nothing is missing.";
  for (const NamedEffect& effect : result.effects) result.sentence += " " + effect.name;
}

}  // namespace

std::optional<std::string> BaselineOptions::validate() const {
  if (!(threshold > 0.0 && threshold < 10.0))
    return "threshold is " + std::to_string(threshold) + ", must be inside (0, 10)";
  if (most_effects < 1 || most_effects > 40)
    return "most_effects is " + std::to_string(most_effects) + ", must be 1 to 40";
  return std::nullopt;
}

diagnosis::Diagnosis diagnose_by(const BaselineOptions& options, const twin::Model& model,
                                 const MeasuredSeries& series,
                                 const std::vector<MeasuredSeries>& validation) {
  if (const auto wrong = options.validate()) throw std::invalid_argument(*wrong);
  if (const auto wrong = model.validate()) throw std::invalid_argument("model: " + *wrong);
  diagnosis::Diagnosis diagnosis{.repaired = model};
  const Playback playback(series);
  std::vector<Playback> playbacks;
  for (const MeasuredSeries& record : validation) playbacks.emplace_back(record);
  for (const core::Axis axis : core::kAxes) {
    if (!series.has(axis)) continue;
    auto result = AxisRegression(options, model, series, playback, axis).run(diagnosis.repaired);
    result.fit = gap_on(series, playback, model, diagnosis.repaired, axis);
    result.allan_log_distance = allan_on(series, playback, model, diagnosis.repaired, axis);
    prove(result, validation, playbacks, model, diagnosis.repaired, axis);
    settle(result);
    diagnosis.verdict = std::max(diagnosis.verdict, result.verdict);
    diagnosis.axes[core::index(axis)] = std::move(result);
  }
  return diagnosis;
}

}  // namespace zerodrift::blind
