// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/coarse_readings.h"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "common/core/not_known.h"
#include "common/diagnosis/natural_spline.h"
#include "common/diagnosis/smallest_step.h"

namespace zerodrift::diagnosis {
namespace {

// Readings that are the same, by their places; holes in between belong to it.
struct Stay {
  std::size_t first = 0;
  std::size_t last = 0;

  [[nodiscard]] std::size_t length() const { return last - first; }
};

// Of `fewest` places and more from first to last, in order.
std::vector<Stay> stays_of(const std::vector<double>& readings, std::size_t fewest) {
  std::vector<Stay> stays;
  std::optional<Stay> now;
  const auto keep = [&] {
    if (now && now->length() + 1 >= fewest) stays.push_back(*now);
  };
  for (std::size_t i = 0; i < readings.size(); ++i) {
    if (std::isnan(readings[i])) continue;
    if (now && readings[now->last] == readings[i]) {
      now->last = i;
      continue;
    }
    keep();
    now = Stay{.first = i, .last = i};
  }
  keep();
  return stays;
}

// The passage from one reading to another.
struct Change {
  double level_degc = 0.0;  // midway between the two
  double place = 0.0;       // as many readings are early as late
  double flips = 0.0;       // from one reading to another
};

// Between two stays of different readings. Nothing where it takes longer than `longest` and goes to
// other readings than these two.
std::optional<Change> change_between(const std::vector<double>& readings, const Stay& before,
                                     const Stay& after, std::size_t longest) {
  const double was = readings[before.last];
  const double is = readings[after.first];
  const bool is_clear = after.first - before.last <= longest;
  bool of_two = true;
  double early = 0.0, late = 0.0, flips = 0.0, last = was;
  for (std::size_t i = before.last + 1; i <= after.first; ++i) {
    if (std::isnan(readings[i])) continue;
    if (readings[i] != last) flips += 1.0;
    last = readings[i];
    if (i == after.first) break;
    if (last == was) late += 1.0;
    if (last == is) early += 1.0;
    of_two = of_two && (last == was || last == is);
  }
  if (!is_clear && !of_two) return std::nullopt;
  return Change{.level_degc = 0.5 * (was + is),
                .place = 0.5 * (static_cast<double>(before.last + after.first) + late - early),
                .flips = flips};
}

// Another reading in between, and the same again.
bool is_return(const std::vector<double>& readings, const Stay& before, const Stay& after) {
  if (readings[before.last] != readings[after.first]) return false;
  std::optional<double> other;
  for (std::size_t i = before.last + 1; i < after.first; ++i) {
    if (std::isnan(readings[i]) || readings[i] == readings[before.last]) continue;
    if (other && *other != readings[i]) return false;
    other = readings[i];
  }
  return true;
}

// Between which temperatures the readings of a stay are.
struct Band {
  Stay stay;
  double lowest = 0.0;
  double highest = 0.0;
  double step = 0.0;
};

// Stays from change to change, and the smoothest course through the changes that keeps within the
// steps.
class Chain {
 public:
  // `changes`: between the stays.
  Chain(const std::vector<double>& readings, std::span<const Stay> stays,
        std::span<const Change> changes)
      : readings_(readings) {
    const auto from = into(stays.front());
    const auto to = out_of(stays.back());
    if (from) cross(*from);
    for (const Change& change : changes) cross(change);
    if (to) cross(*to);
    if (knots_.size() < 2) level(stays.front(), stays.back());
    for (std::size_t s = 0; s < stays.size(); ++s)
      bound(stays[s], s > 0 ? std::optional(changes[s - 1]) : from,
            s < changes.size() ? std::optional(changes[s]) : to);
  }

  void draw(WithoutSteps& course) {
    rate_errors(course.variance_degc2);
    constexpr int kRounds = 30;  // the last ones move it by thousandths of a step
    for (int round = 0; round < kRounds && hold(); ++round) {
    }
    const NaturalSpline spline(knots_);
    for (std::size_t i = bands_.front().stay.first; i <= bands_.back().stay.last; ++i) {
      if (!std::isnan(readings_[i])) course.degc[i] = spline.at(static_cast<double>(i));
    }
    for (const Band& band : bands_) {
      for (std::size_t i = band.stay.first; i <= band.stay.last; ++i)
        course.degc[i] = std::clamp(course.degc[i], band.lowest, band.highest);
    }
  }

 private:
  // From the reading before the first stay or to the one behind the last.
  [[nodiscard]] std::optional<Change> into(const Stay& first) const {
    for (std::size_t i = first.first; i-- > 0;)
      if (!std::isnan(readings_[i])) return at_once(i, first.first);
    return std::nullopt;
  }
  [[nodiscard]] std::optional<Change> out_of(const Stay& last) const {
    for (std::size_t i = last.last + 1; i < readings_.size(); ++i)
      if (!std::isnan(readings_[i])) return at_once(last.last, i);
    return std::nullopt;
  }
  [[nodiscard]] Change at_once(std::size_t from, std::size_t to) const {
    return {.level_degc = 0.5 * (readings_[from] + readings_[to]),
            .place = 0.5 * static_cast<double>(from + to),
            .flips = 1.0};
  }

  void cross(const Change& change) {
    knots_.push_back({change.place, change.level_degc});
    flips_.push_back(change.flips);
  }

  // Of two stays that are all there is: from the middle of one to that of the other.
  void level(const Stay& first, const Stay& last) {
    const auto middle = [&](const Stay& stay) {
      return Knot{0.5 * static_cast<double>(stay.first + stay.last), readings_[stay.first]};
    };
    knots_ = {middle(first), knots_.front(), middle(last)};
    flips_ = {1.0, flips_.front(), 1.0};
  }

  void bound(const Stay& stay, const std::optional<Change>& before,
             const std::optional<Change>& after) {
    const double degc = readings_[stay.first];
    double half = std::numeric_limits<double>::infinity();
    bool from_below = false, from_above = false;
    for (const auto* change : {&before, &after}) {
      if (!*change) continue;
      const double away = (*change)->level_degc - degc;
      half = std::min(half, std::abs(away));
      (away < 0.0 ? from_below : from_above) = true;
    }
    bands_.push_back({.stay = stay,
                      .lowest = from_below ? degc - half : degc,
                      .highest = from_above ? degc + half : degc,
                      .step = 2.0 * half});
  }

  // A passage is known to a reading, with noise to half of its flips (the variance of how many
  // readings are early).
  void rate_errors(std::vector<double>& variances) const {
    for (const Band& band : bands_) {
      const auto after = std::upper_bound(
          knots_.begin(), knots_.end(), 0.5 * static_cast<double>(band.stay.first + band.stay.last),
          [](double place, const Knot& knot) { return place < knot.place; });
      if (after == knots_.begin() || after == knots_.end()) continue;
      const auto k = static_cast<std::size_t>(after - knots_.begin());
      const double begin = knots_[k - 1].place;
      const double end = knots_[k].place;
      const double flips = 0.5 * (flips_[k - 1] + flips_[k]);
      const double variance =
          band.step * band.step / (end - begin) * (1.0 / 12.0 + 0.5 * (flips - 1.0));
      for (auto i = static_cast<std::size_t>(std::ceil(begin)); static_cast<double>(i) <= end; ++i)
        variances[i] = variance;
    }
  }

  // A knot on the edge of each band where the course leaves it farthest. False: nowhere.
  bool hold() {
    constexpr double kNoticed = 0.01;  // of a step
    const NaturalSpline spline(knots_);
    const std::size_t before = knots_.size();
    for (const Band& band : bands_) {
      double farthest = kNoticed * band.step;
      std::optional<Knot> knot;
      for (std::size_t i = band.stay.first; i <= band.stay.last; ++i) {
        const auto place = static_cast<double>(i);
        const double degc = spline.at(place);
        const double inside = std::clamp(degc, band.lowest, band.highest);
        if (std::abs(degc - inside) <= farthest || is_near_knot(place, before)) continue;
        farthest = std::abs(degc - inside);
        knot = Knot{place, inside};
      }
      if (knot) knots_.push_back(*knot);
    }
    if (knots_.size() == before) return false;
    std::sort(knots_.begin(), knots_.end(),
              [](const Knot& a, const Knot& b) { return a.place < b.place; });
    return true;
  }

  // Of the first `count`, which are in order.
  [[nodiscard]] bool is_near_knot(double place, std::size_t count) const {
    const auto end = knots_.begin() + static_cast<std::ptrdiff_t>(count);
    const auto next = std::lower_bound(knots_.begin(), end, place - 1.0,
                                       [](const Knot& knot, double p) { return knot.place < p; });
    return next != end && next->place <= place + 1.0;
  }

  const std::vector<double>& readings_;
  std::vector<Knot> knots_;
  std::vector<double> flips_;  // at the changes among them, before the first hold()
  std::vector<Band> bands_;
};

// Of readings of which only their steps and their noise are known.
std::vector<double> errors_as_read(const std::vector<double>& readings, double variance_degc2) {
  std::vector<std::uint8_t> valid(readings.size());
  std::transform(readings.begin(), readings.end(), valid.begin(),
                 [](double value) -> std::uint8_t { return std::isnan(value) ? 0 : 1; });
  const double step = smallest_step(readings, valid);
  std::vector<double> variances(readings.size(), core::kNaN);
  for (const Stay& stay : stays_of(readings, 1)) {
    const double of_step = step * step / (12.0 * static_cast<double>(stay.length() + 1));
    for (std::size_t i = stay.first; i <= stay.last; ++i)
      variances[i] = std::max(of_step, variance_degc2);
  }
  return variances;
}

}  // namespace

WithoutSteps without_steps(const std::vector<double>& readings, std::size_t longest_stay,
                           double variance_degc2) {
  WithoutSteps course{.degc = readings, .variance_degc2 = errors_as_read(readings, variance_degc2)};
  std::vector<Stay> stays;
  std::vector<Change> changes;
  const auto draw = [&] {
    if (!changes.empty()) Chain(readings, stays, changes).draw(course);
    stays.clear();
    changes.clear();
  };
  for (const Stay& stay : stays_of(readings, longest_stay + 2)) {
    if (!stays.empty() && is_return(readings, stays.back(), stay)) {
      stays.back().last = stay.last;
      continue;
    }
    const auto change =
        stays.empty() ? std::nullopt : change_between(readings, stays.back(), stay, longest_stay);
    if (change) {
      changes.push_back(*change);
    } else {
      draw();
    }
    stays.push_back(stay);
  }
  draw();
  return course;
}

}  // namespace zerodrift::diagnosis
