// SPDX-License-Identifier: Apache-2.0
// The coefficients of several gyros over months, from the model that each record gave: which unit
// changed, and between which of its dates; which unit is unlike the others.
//
//   coefficient of record i of unit u = m_u + the steps of u before i + r e + s_i e'
//     s the stated standard error, r what records of one unit scatter beyond it; e, e' normal
//   a step parts a unit's records in two: t = difference / its standard error, r by the method of
//     Paule and Mandel (1982) from all records of all units about the means of their parts,
//     Student's t with as many degrees of freedom as that leaves, two-sided, times the number of
//     dates at which the unit's records could be parted (Bonferroni); the likeliest step of all
//     units first, then the next beside it, which vouches for its neighbours too
//   a unit is unlike others by its mean since its last step against the mean of theirs, the
//     scatter between units by the same method from them alone
//   a finding is a step, or a unit, whose false-discovery rate among all tests of its sort is at
//     most the one asked for (Benjamini and Hochberg 1995)
//
// A course that is no step shows as one or more of them. Pure; O(records² coefficients).
#pragma once

#include <cstddef>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "common/core/axis.h"
#include "common/twin/model.h"

namespace zerodrift::diagnosis {

// In the unit that the parameter's name ends in; so are all figures below.
struct Estimate {
  double value = 0.0;
  double standard_error = 0.0;
};

struct DatedEstimate {
  std::string unit;
  std::string date;  // "2026-03-31": dates compare as their texts do
  Estimate estimate;
};

// One parameter of one effect of one axis, as every record that judged it gave it.
struct Coefficient {
  core::Axis axis = core::Axis::kX;
  std::string effect;  // its label, with the temperatures that it reads
  std::string parameter;
  std::vector<DatedEstimate> records;  // by date
  std::size_t not_comparable = 0;      // records whose effect has another shape, left out
};

// Where a side has one record, that record itself may be the odd one (may_be_one_record()).
struct UnitChange {
  std::string unit;
  std::string last_before;  // the dates of the records on either side
  std::string first_after;
  std::size_t records_before = 0;
  std::size_t records_after = 0;
  Estimate before;
  Estimate after;
  double p_value = 1.0;
  double false_discovery_rate = 1.0;
};

// A record that scatters as no other does looks like a change to it: only a second one beside it
// tells the two apart.
[[nodiscard]] inline bool may_be_one_record(const UnitChange& change) {
  return change.records_before == 1 || change.records_after == 1;
}

struct UnlikeUnit {
  std::string unit;
  Estimate mean;                // since its last change
  Estimate others;              // the mean of the other units, and the standard error of that
  double others_scatter = 0.0;  // standard deviation between them
  double p_value = 1.0;
  double false_discovery_rate = 1.0;
};

struct CoefficientHistory {
  Coefficient coefficient;
  std::size_t units = 0;
  double mean = 0.0;  // of the units' means since their last change
  // Standard deviations beyond the stated errors; nothing where too few records tell.
  std::optional<double> scatter_within_units;
  std::optional<double> scatter_between_units;
  std::vector<UnitChange> changes;  // by unit, then date
  std::vector<UnlikeUnit> unlike;   // by unit
};

struct UnitHistory {
  std::vector<CoefficientHistory> coefficients;
  // How many questions could be asked: 0 is "too few records", not "nothing changed".
  std::size_t tests_of_change = 0;
  std::size_t tests_of_likeness = 0;
};

// A gyro's model as one record of it gave it.
struct RecordedModel {
  std::string source;  // its file, for errors
  twin::Model model;
};

// Whether it is a day of the calendar since 1900, as 2026-03-31.
[[nodiscard]] bool is_date(const std::string& text);

// Of a unit's records that judged an axis, those that sized one effect.
struct UnitShare {
  std::string unit;
  std::size_t sized = 0;
  std::size_t records = 0;
  std::string first;  // dates of those that sized it
  std::string last;
  bool only_late = false;   // none before `first`, all from it on
  bool only_early = false;  // all until `last`, none behind it
};

// An effect that not all records of its axis sized. What is not in a model has no amplitude that
// could be compared: it may have come, or gone, or that record couldn't show it.
struct PartlySized {
  core::Axis axis = core::Axis::kX;
  std::string effect;  // as of a Coefficient
  std::size_t sized = 0;
  std::size_t records = 0;
  std::vector<UnitShare> units{};  // in whose records it was sized, by unit
};

// What records gave, by axis and effect: parameters with a standard error, of effects that
// diagnosis or calibration sized, one effect of a kind on an axis. Effects of one kind that read
// other temperatures are other coefficients; terms of a polynomial have to be those of most
// records, shapes (time constants, widths) to lie within a tenth of the records' median.
struct MeasuredEffects {
  std::vector<Coefficient> coefficients;
  std::vector<PartlySized> partly_sized;
};

// Throws std::invalid_argument with source and key where a model with such effects has no gyro_id
// or one of them no date ("2026-03-31"), and where a record of a unit or a source is given twice.
[[nodiscard]] MeasuredEffects measured_effects(std::span<const RecordedModel> models);

// `false_discovery_rate`: within 0 and 1.
[[nodiscard]] UnitHistory history_of(std::vector<Coefficient> coefficients,
                                     double false_discovery_rate);

}  // namespace zerodrift::diagnosis
