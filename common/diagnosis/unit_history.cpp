// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/unit_history.h"

#include <algorithm>
#include <boost/math/distributions/students_t.hpp>
#include <cmath>
#include <map>
#include <numeric>
#include <utility>

namespace zerodrift::diagnosis {
namespace {

constexpr std::size_t kLeastOtherUnits = 3;

// Estimates that share a mean, with a scatter beyond their stated errors.
struct Pool {
  double weight = 0.0;
  double mean = 0.0;

  [[nodiscard]] double variance() const { return 1.0 / weight; }
  [[nodiscard]] Estimate estimate() const { return {mean, std::sqrt(variance())}; }
};

Pool pool_of(std::span<const Estimate> estimates, double scatter_squared) {
  Pool pool;
  double sum = 0.0;
  for (const Estimate& one : estimates) {
    const double weight = 1.0 / (one.standard_error * one.standard_error + scatter_squared);
    pool.weight += weight;
    sum += weight * one.value;
  }
  pool.mean = sum / pool.weight;
  return pool;
}

using Parts = std::vector<std::vector<Estimate>>;

// Records less parts.
double freedom_of(const Parts& parts) {
  double freedom = 0.0;
  for (const auto& part : parts) freedom += static_cast<double>(part.size()) - 1.0;
  return freedom;
}

// The scatter² beyond stated errors at which the weighted squares about the parts' means are as
// many as the degrees of freedom; 0 where they are fewer without any. Needs one degree of freedom.
// Newton's method from 0: the squares fall and are convex, so that it never goes too far.
double scatter_squared_of(const Parts& parts) {
  constexpr int kMostSteps = 200;
  constexpr double kSettled = 1e-12;
  const double freedom = freedom_of(parts);
  double scatter_squared = 0.0;
  for (int step = 0; step < kMostSteps; ++step) {
    double squares = 0.0;
    double slope = 0.0;
    for (const auto& part : parts) {
      const double mean = pool_of(part, scatter_squared).mean;
      for (const Estimate& one : part) {
        const double variance = one.standard_error * one.standard_error + scatter_squared;
        const double square = (one.value - mean) * (one.value - mean) / variance;
        squares += square;
        slope += square / variance;
      }
    }
    if (!(squares > freedom)) return scatter_squared;
    const double change = (squares - freedom) / slope;
    scatter_squared += change;
    if (change <= kSettled * scatter_squared) break;
  }
  return scatter_squared;
}

double two_sided(double t, double freedom) {
  return 2.0 * boost::math::cdf(boost::math::complement(
                   boost::math::students_t_distribution<double>(freedom), std::abs(t)));
}

// A unit's records of one coefficient, by date, and where steps part them.
struct UnitRecords {
  std::string unit;
  std::vector<DatedEstimate> records;
  std::vector<std::size_t> steps;  // the first record of each later part, increasing

  [[nodiscard]] std::vector<Estimate> between(std::size_t begin, std::size_t end) const {
    std::vector<Estimate> part;
    for (std::size_t i = begin; i < end; ++i) part.push_back(records[i].estimate);
    return part;
  }
  void add_parts(Parts& parts) const {
    std::size_t begin = 0;
    for (const std::size_t step : steps) {
      parts.push_back(between(begin, step));
      begin = step;
    }
    parts.push_back(between(begin, records.size()));
  }
  void part(std::size_t at) { steps.insert(std::upper_bound(steps.begin(), steps.end(), at), at); }
  [[nodiscard]] std::vector<Estimate> latest() const {
    return between(steps.empty() ? 0 : steps.back(), records.size());
  }
  // Records of one date can't be told apart by time.
  [[nodiscard]] std::vector<std::size_t> possible_steps() const {
    std::vector<std::size_t> possible;
    for (std::size_t i = 1; i < records.size(); ++i) {
      if (records[i - 1].date < records[i].date) possible.push_back(i);
    }
    return possible;
  }
  [[nodiscard]] std::pair<std::size_t, std::size_t> part_around(std::size_t record) const {
    std::size_t begin = 0;
    std::size_t end = records.size();
    for (const std::size_t step : steps) {
      if (step <= record) begin = step;
      if (step > record) end = std::min(end, step);
    }
    return {begin, end};
  }
};

Parts parts_of(const std::vector<UnitRecords>& units) {
  Parts parts;
  for (const UnitRecords& unit : units) unit.add_parts(parts);
  return parts;
}

// 0 where no record says.
double scatter_squared_within(const std::vector<UnitRecords>& units) {
  const Parts parts = parts_of(units);
  return freedom_of(parts) >= 1.0 ? scatter_squared_of(parts) : 0.0;
}

std::vector<UnitRecords> by_unit(const Coefficient& coefficient) {
  std::map<std::string, std::vector<DatedEstimate>> units;
  for (const DatedEstimate& record : coefficient.records) units[record.unit].push_back(record);
  std::vector<UnitRecords> result;
  for (auto& [unit, records] : units) result.push_back({unit, std::move(records), {}});
  return result;
}

// The steps of one coefficient.
class StepSearch {
 public:
  StepSearch(std::vector<UnitRecords>& units, double taken_at_most)
      : units_(units), taken_at_most_(taken_at_most) {}

  // Parts the units' records at the steps that were found.
  void run() {
    for (;;) {
      p_values_of_none_.clear();
      std::optional<Step> best;
      for (std::size_t u = 0; u < units_.size(); ++u) {
        const std::optional<Step> step = likeliest(u);
        if (!step) continue;
        if (units_[u].steps.empty()) p_values_of_none_.push_back(step->p_value);
        if (!best || step->p_value < best->p_value) best = step;
      }
      if (!best || best->p_value > taken_at_most_) return;
      take(*best);
    }
  }

  // Of the units that could be asked and have no step, each one's likeliest.
  [[nodiscard]] const std::vector<double>& p_values_of_none() const { return p_values_of_none_; }

  [[nodiscard]] std::vector<UnitChange> changes() const {
    std::vector<UnitChange> changes;
    const double scatter_squared = scatter_squared_within(units_);
    for (const auto& [place, p_value] : p_values_) {
      const auto [u, at] = place;
      const UnitRecords& unit = units_[u];
      const std::size_t begin = unit.part_around(at - 1).first;
      const std::size_t end = unit.part_around(at).second;
      changes.push_back({.unit = unit.unit,
                         .last_before = unit.records[at - 1].date,
                         .first_after = unit.records[at].date,
                         .records_before = at - begin,
                         .records_after = end - at,
                         .before = pool_of(unit.between(begin, at), scatter_squared).estimate(),
                         .after = pool_of(unit.between(at, end), scatter_squared).estimate(),
                         .p_value = p_value});
    }
    return changes;
  }

 private:
  struct Step {
    std::size_t unit = 0;
    std::size_t at = 0;
    double p_value = 1.0;
  };

  // A step that was found beside another one stands on it: without the way there a way back is
  // none.
  void take(const Step& step) {
    std::vector<std::size_t>& steps = units_[step.unit].steps;
    units_[step.unit].part(step.at);
    p_values_[{step.unit, step.at}] = step.p_value;
    const auto place = std::find(steps.begin(), steps.end(), step.at);
    const auto support = [&](std::size_t at) {
      double& p_value = p_values_[{step.unit, at}];
      p_value = std::min(p_value, step.p_value);
    };
    if (place != steps.begin()) support(*(place - 1));
    if (place + 1 != steps.end()) support(*(place + 1));
  }

  [[nodiscard]] std::optional<Step> likeliest(std::size_t u) const {
    const UnitRecords& unit = units_[u];
    const std::vector<std::size_t> possible = unit.possible_steps();
    std::optional<Step> best;
    for (const std::size_t at : possible) {
      if (std::find(unit.steps.begin(), unit.steps.end(), at) != unit.steps.end()) continue;
      const std::optional<double> p = p_value_at(u, at);
      if (p && (!best || *p < best->p_value)) best = Step{u, at, *p};
    }
    if (best) best->p_value = std::min(1.0, best->p_value * static_cast<double>(possible.size()));
    return best;
  }

  [[nodiscard]] std::optional<double> p_value_at(std::size_t u, std::size_t at) const {
    const UnitRecords& unit = units_[u];
    const auto [begin, end] = unit.part_around(at);
    const std::vector<Estimate> first = unit.between(begin, at);
    const std::vector<Estimate> second = unit.between(at, end);
    Parts parts;
    UnitRecords parted = unit;
    parted.part(at);
    for (std::size_t i = 0; i < units_.size(); ++i) (i == u ? parted : units_[i]).add_parts(parts);
    const double freedom = freedom_of(parts);
    if (freedom < 1.0) return std::nullopt;
    const double scatter_squared = scatter_squared_of(parts);
    const Pool before = pool_of(first, scatter_squared);
    const Pool after = pool_of(second, scatter_squared);
    return two_sided((after.mean - before.mean) / std::sqrt(before.variance() + after.variance()),
                     freedom);
  }

  std::vector<UnitRecords>& units_;
  double taken_at_most_;
  std::vector<double> p_values_of_none_;
  std::map<std::pair<std::size_t, std::size_t>, double> p_values_;  // of steps: unit, record
};

std::vector<UnlikeUnit> tests_of_likeness(const std::vector<UnitRecords>& units,
                                          const std::vector<Estimate>& means) {
  std::vector<UnlikeUnit> tests;
  if (units.size() < kLeastOtherUnits + 1) return tests;
  for (std::size_t u = 0; u < units.size(); ++u) {
    std::vector<Estimate> others = means;
    others.erase(others.begin() + static_cast<std::ptrdiff_t>(u));
    const double scatter_squared = scatter_squared_of({others});
    const Pool pool = pool_of(others, scatter_squared);
    const double variance =
        means[u].standard_error * means[u].standard_error + scatter_squared + pool.variance();
    tests.push_back({.unit = units[u].unit,
                     .mean = means[u],
                     .others = pool.estimate(),
                     .others_scatter = std::sqrt(scatter_squared),
                     .p_value = two_sided((means[u].value - pool.mean) / std::sqrt(variance),
                                          static_cast<double>(others.size()) - 1.0)});
  }
  return tests;
}

// For each p value, the least false-discovery rate at which it is a finding.
std::vector<double> false_discovery_rates(const std::vector<double>& p_values) {
  std::vector<std::size_t> order(p_values.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t a, std::size_t b) { return p_values[a] < p_values[b]; });
  std::vector<double> rates(p_values.size(), 1.0);
  double least = 1.0;
  for (std::size_t rank = order.size(); rank > 0; --rank) {
    const double rate =
        p_values[order[rank - 1]] * static_cast<double>(order.size()) / static_cast<double>(rank);
    least = std::min(least, rate);
    rates[order[rank - 1]] = least;
  }
  return rates;
}

// Tests of one sort over all coefficients: those that stay are findings. How many were made.
template <typename Test>
std::size_t keep_findings(const std::vector<std::vector<Test>*>& tests,
                          const std::vector<double>& p_values_of_none,
                          double false_discovery_rate) {
  std::vector<double> p_values;
  for (const auto* of_one : tests) {
    for (const Test& test : *of_one) p_values.push_back(test.p_value);
  }
  p_values.insert(p_values.end(), p_values_of_none.begin(), p_values_of_none.end());
  const std::vector<double> rates = false_discovery_rates(p_values);
  auto rate = rates.begin();
  for (auto* of_one : tests) {
    for (Test& test : *of_one) test.false_discovery_rate = *rate++;
    std::erase_if(*of_one, [&](const Test& test) {
      return test.false_discovery_rate > false_discovery_rate;
    });
  }
  return p_values.size();
}

// Only what is a finding parts a unit's records.
void part_at(std::vector<UnitRecords>& units, const std::vector<UnitChange>& changes) {
  for (UnitRecords& unit : units) {
    std::erase_if(unit.steps, [&](std::size_t at) {
      return std::none_of(changes.begin(), changes.end(), [&](const UnitChange& change) {
        return change.unit == unit.unit && change.first_after == unit.records[at].date;
      });
    });
  }
}

std::vector<Estimate> latest_means(const std::vector<UnitRecords>& units) {
  const double scatter_squared = scatter_squared_within(units);
  std::vector<Estimate> means;
  for (const UnitRecords& unit : units)
    means.push_back(pool_of(unit.latest(), scatter_squared).estimate());
  return means;
}

void summarise(CoefficientHistory& history, const std::vector<UnitRecords>& units,
               const std::vector<Estimate>& means) {
  constexpr double kLeastFreedom = 2.0;
  const Parts parts = parts_of(units);
  if (freedom_of(parts) >= kLeastFreedom)
    history.scatter_within_units = std::sqrt(scatter_squared_of(parts));
  double scatter_squared = 0.0;
  if (freedom_of({means}) >= kLeastFreedom) {
    scatter_squared = scatter_squared_of({means});
    history.scatter_between_units = std::sqrt(scatter_squared);
  }
  history.units = units.size();
  history.mean = pool_of(means, scatter_squared).mean;
}

}  // namespace

UnitHistory history_of(std::vector<Coefficient> coefficients, double false_discovery_rate) {
  UnitHistory history;
  std::vector<std::vector<UnitRecords>> units;
  std::vector<double> p_values_of_none;
  for (Coefficient& coefficient : coefficients) {
    auto& of_one = units.emplace_back(by_unit(coefficient));
    StepSearch search(of_one, false_discovery_rate);
    search.run();
    p_values_of_none.insert(p_values_of_none.end(), search.p_values_of_none().begin(),
                            search.p_values_of_none().end());
    history.coefficients.push_back({.coefficient = std::move(coefficient),
                                    .scatter_within_units = {},
                                    .scatter_between_units = {},
                                    .changes = search.changes(),
                                    .unlike = {}});
  }
  std::vector<std::vector<UnitChange>*> changes;
  for (CoefficientHistory& one : history.coefficients) changes.push_back(&one.changes);
  history.tests_of_change = keep_findings(changes, p_values_of_none, false_discovery_rate);

  std::vector<std::vector<UnlikeUnit>*> unlike;
  for (std::size_t i = 0; i < units.size(); ++i) {
    CoefficientHistory& one = history.coefficients[i];
    part_at(units[i], one.changes);
    const std::vector<Estimate> means = latest_means(units[i]);
    summarise(one, units[i], means);
    one.unlike = tests_of_likeness(units[i], means);
    unlike.push_back(&one.unlike);
  }
  history.tests_of_likeness = keep_findings(unlike, {}, false_discovery_rate);
  return history;
}

}  // namespace zerodrift::diagnosis
