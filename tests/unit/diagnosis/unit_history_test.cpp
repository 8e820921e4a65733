// SPDX-License-Identifier: Apache-2.0
#include "common/diagnosis/unit_history.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>
#include <stdexcept>

namespace zerodrift::diagnosis {
namespace {

constexpr double kRate = 0.05;

std::string day(std::size_t i) {
  const std::string text = std::to_string(i % 28 + 1);
  const std::string month = std::to_string(i / 28 % 12 + 1);
  return "2026-" + std::string(2 - month.size(), '0') + month + "-" +
         std::string(2 - text.size(), '0') + text;
}

// Coefficients of units that differ by `between`, with records that scatter by `within` beyond a
// stated error of 1.
struct Lab {
  std::size_t units = 6;
  std::size_t records = 5;
  double between = 0.0;
  double within = 0.0;

  [[nodiscard]] Coefficient measure(std::mt19937_64& random) const {
    std::normal_distribution<double> normal;
    Coefficient coefficient{core::Axis::kX, "shupe", "k", {}, 0};
    std::vector<double> of_unit(units);
    for (double& value : of_unit) value = between * normal(random);
    for (std::size_t i = 0; i < records; ++i) {
      for (std::size_t u = 0; u < units; ++u) {
        const double value = of_unit[u] + normal(random) + within * normal(random);
        coefficient.records.push_back({"unit " + std::to_string(u), day(i), {value, 1.0}});
      }
    }
    return coefficient;
  }
};

void add_to(Coefficient& coefficient, const std::string& unit, const std::string& from,
            double value) {
  for (DatedEstimate& record : coefficient.records) {
    if (record.unit == unit && record.date >= from) record.estimate.value += value;
  }
}

std::size_t changes_in(const UnitHistory& history) {
  std::size_t count = 0;
  for (const CoefficientHistory& one : history.coefficients) count += one.changes.size();
  return count;
}

std::size_t unlike_in(const UnitHistory& history) {
  std::size_t count = 0;
  for (const CoefficientHistory& one : history.coefficients) count += one.unlike.size();
  return count;
}

// Where nothing changed, a history with any finding is a false discovery, so that its rate bounds
// their share: of 400 fleets 20 expected at most, 37 is four standard deviations more.
TEST(UnitHistory, WhereNothingChangedFindingsAreAsRareAsStated) {
  std::mt19937_64 random(1);
  int with_changes = 0;
  int with_unlike = 0;
  for (int fleet = 0; fleet < 400; ++fleet) {
    const Lab lab{.units = 5, .records = 4, .between = 3.0, .within = fleet % 2 == 0 ? 0.0 : 2.0};
    const UnitHistory history =
        history_of({lab.measure(random), lab.measure(random), lab.measure(random)}, kRate);
    EXPECT_GE(history.tests_of_change, 15U);  // a step that is found asks for one more
    EXPECT_EQ(history.tests_of_likeness, 15U);
    with_changes += changes_in(history) > 0 ? 1 : 0;
    with_unlike += unlike_in(history) > 0 ? 1 : 0;
  }
  EXPECT_LE(with_changes, 37);
  EXPECT_LE(with_unlike, 37);
}

// A step of ten standard errors between the second and the third of five records: its t is about
// 10 / sqrt(1/2 + 1/3) = 11 with 23 degrees of freedom.
TEST(UnitHistory, AChangeIsFoundWithItsDatesAndSizes) {
  std::mt19937_64 random(2);
  Coefficient coefficient = Lab{.between = 3.0}.measure(random);
  add_to(coefficient, "unit 4", day(2), 10.0);
  const UnitHistory history = history_of({coefficient}, kRate);
  ASSERT_EQ(history.coefficients[0].changes.size(), 1U);
  const UnitChange& change = history.coefficients[0].changes[0];
  EXPECT_EQ(change.unit, "unit 4");
  EXPECT_EQ(change.last_before, day(1));
  EXPECT_EQ(change.first_after, day(2));
  EXPECT_EQ(change.records_before, 2U);
  EXPECT_EQ(change.records_after, 3U);
  const double error = std::hypot(change.before.standard_error, change.after.standard_error);
  EXPECT_NEAR(change.after.value - change.before.value, 10.0, 4.0 * error);
  EXPECT_LT(change.false_discovery_rate, 1e-4);
}

// The scatter is of all units: one that jumps about would else hide another's change, and records
// that scatter more than they state would each be one.
TEST(UnitHistory, ScatterBeyondTheStatedErrorsIsNoChange) {
  std::mt19937_64 random(3);
  int found = 0;
  for (int fleet = 0; fleet < 100; ++fleet)
    found += changes_in(history_of({Lab{.within = 20.0}.measure(random)}, kRate)) > 0 ? 1 : 0;
  EXPECT_LE(found, 14);  // 5 expected at most, and four standard deviations
}

TEST(UnitHistory, TwoChangesOfAUnitAreBothFoundAndTheLastOneIsItsPresent) {
  std::mt19937_64 random(4);
  Coefficient coefficient = Lab{.records = 9, .between = 2.0}.measure(random);
  add_to(coefficient, "unit 1", day(3), 30.0);
  add_to(coefficient, "unit 1", day(6), -30.0);
  const UnitHistory history = history_of({coefficient}, kRate);
  ASSERT_EQ(history.coefficients[0].changes.size(), 2U);
  EXPECT_EQ(history.coefficients[0].changes[0].first_after, day(3));
  EXPECT_EQ(history.coefficients[0].changes[1].first_after, day(6));
  EXPECT_TRUE(history.coefficients[0].unlike.empty());
}

// Beside the way there alone the way back was scatter, so that one of the two was no finding and
// the unit's present was that of neither.
TEST(UnitHistory, OfARecordThatStandsAloneTheWayThereAndBackAreFound) {
  std::mt19937_64 random(7);
  Coefficient coefficient = Lab{.units = 8, .records = 6, .between = 2.0}.measure(random);
  add_to(coefficient, "unit 0", day(2), 25.0);
  add_to(coefficient, "unit 0", day(3), -25.0);
  const UnitHistory history = history_of({coefficient}, kRate);
  ASSERT_EQ(history.coefficients[0].changes.size(), 2U);
  EXPECT_EQ(history.coefficients[0].changes[0].first_after, day(2));
  EXPECT_EQ(history.coefficients[0].changes[1].first_after, day(3));
  EXPECT_TRUE(may_be_one_record(history.coefficients[0].changes[0]));
  EXPECT_TRUE(history.coefficients[0].unlike.empty());
}

TEST(UnitHistory, AUnitThatIsUnlikeTheOthersIsFoundByItsPresent) {
  std::mt19937_64 random(5);
  Coefficient coefficient = Lab{.units = 8, .between = 1.0}.measure(random);
  add_to(coefficient, "unit 2", day(0), 40.0);
  const UnitHistory history = history_of({coefficient}, kRate);
  ASSERT_EQ(history.coefficients[0].unlike.size(), 1U);
  const UnlikeUnit& unit = history.coefficients[0].unlike[0];
  EXPECT_EQ(unit.unit, "unit 2");
  EXPECT_NEAR(unit.mean.value, 40.0, 5.0);
  EXPECT_EQ(changes_in(history), 0U);
}

// Of 100 units and 400 degrees of freedom the standard deviations are good to 7 and 3.5 %.
TEST(UnitHistory, ScatterIsWhatItWasMadeWith) {
  std::mt19937_64 random(6);
  const Lab lab{.units = 100, .records = 5, .between = 4.0, .within = 2.0};
  const UnitHistory history = history_of({lab.measure(random)}, 1e-6);
  EXPECT_NEAR(history.coefficients[0].scatter_within_units.value(), 2.0, 0.3);
  EXPECT_NEAR(history.coefficients[0].scatter_between_units.value(), 4.0, 1.2);
}

// By hand, stated errors 1 and no scatter beyond (squares about the means .02 with 2 degrees of
// freedom): difference of the means 10, its error 1, t = 10 with 2 degrees of freedom,
// p = 1 - t / sqrt(t² + 2) = .00985, three dates to part at.
TEST(UnitHistory, FourRecordsOfOneUnitAsByHand) {
  Coefficient coefficient{core::Axis::kY, "bias", "bias_deg_h", {}, 0};
  for (const auto& [date, value] : std::vector<std::pair<std::string, double>>{
           {"2026-01-01", 0.0}, {"2026-02-01", 0.1}, {"2026-03-01", 10.1}, {"2026-04-01", 10.0}})
    coefficient.records.push_back({"a", date, {value, 1.0}});
  const UnitHistory history = history_of({coefficient}, kRate);
  ASSERT_EQ(history.coefficients[0].changes.size(), 1U);
  const UnitChange& change = history.coefficients[0].changes[0];
  EXPECT_NEAR(change.p_value, 3.0 * (1.0 - 10.0 / std::sqrt(102.0)), 1e-9);
  EXPECT_NEAR(change.before.value, 0.05, 1e-12);
  EXPECT_NEAR(change.after.standard_error, std::sqrt(0.5), 1e-12);
  EXPECT_EQ(history.tests_of_likeness, 0U);
}

TEST(UnitHistory, TooFewRecordsAreNoAnswer) {
  Coefficient coefficient{core::Axis::kX, "bias", "bias_deg_h", {}, 0};
  coefficient.records = {{"a", "2026-01-01", {0.0, 1.0}}, {"a", "2026-02-01", {99.0, 1.0}}};
  const UnitHistory two = history_of({coefficient}, kRate);
  EXPECT_EQ(two.tests_of_change, 0U);
  EXPECT_FALSE(two.coefficients[0].scatter_within_units);
  for (DatedEstimate& record : coefficient.records) record.date = "2026-01-01";
  coefficient.records.push_back({"a", "2026-01-01", {-99.0, 1.0}});
  EXPECT_EQ(history_of({coefficient}, kRate).tests_of_change, 0U);
  EXPECT_EQ(history_of({}, kRate).tests_of_change, 0U);
}

twin::EffectSpec measured(const std::string& kind, const std::map<std::string, double>& parameters,
                          const std::string& date) {
  twin::EffectSpec spec{.kind = kind, .axis = core::Axis::kX, .parameters = parameters};
  for (const auto& [name, value] : parameters) spec.standard_errors[name] = 0.1;
  spec.origin.by = "diagnose";
  spec.origin.record = date + ".csv";
  spec.origin.date = date;
  return spec;
}

RecordedModel model_of(const std::string& unit, std::vector<twin::EffectSpec> effects) {
  RecordedModel recorded{unit + "_" + effects.front().origin.date + ".yaml", {}};
  recorded.model.gyro_id = unit;
  recorded.model.effects = std::move(effects);
  return recorded;
}

std::string refusal_of(const std::vector<RecordedModel>& models) {
  try {
    static_cast<void>(measured_effects(models));
  } catch (const std::invalid_argument& error) {
    return error.what();
  }
  return "none";
}

TEST(UnitCoefficients, AreWhatRecordsGaveByDate) {
  auto factory = measured("bias", {{"bias_deg_h", 7.0}}, "2026-01-01");
  factory.origin.by = "factory";
  const std::vector<RecordedModel> models{
      model_of("b", {measured("bias", {{"bias_deg_h", 2.0}}, "2026-02-01")}),
      model_of("a", {measured("bias", {{"bias_deg_h", 1.0}}, "2026-01-01")}),
      model_of("c", {factory})};
  const auto coefficients = measured_effects(models).coefficients;
  ASSERT_EQ(coefficients.size(), 1U);
  EXPECT_EQ(coefficients[0].effect, "bias");
  EXPECT_EQ(coefficients[0].parameter, "bias_deg_h");
  ASSERT_EQ(coefficients[0].records.size(), 2U);
  EXPECT_EQ(coefficients[0].records[0].unit, "a");
  EXPECT_EQ(coefficients[0].records[1].estimate.value, 2.0);
  EXPECT_EQ(coefficients[0].records[1].estimate.standard_error, 0.1);
}

TEST(UnitCoefficients, AmplitudesOfOtherTimeConstantsAreNotComparable) {
  std::vector<RecordedModel> models;
  for (const auto& [date, tau_s] : std::vector<std::pair<std::string, double>>{
           {"2026-01-01", 300.0}, {"2026-02-01", 310.0}, {"2026-03-01", 900.0}}) {
    models.push_back(
        model_of("a", {measured("warm_up", {{"amplitude_deg_h", 1.0}, {"tau_s", tau_s}}, date)}));
  }
  const auto coefficients = measured_effects(models).coefficients;
  ASSERT_FALSE(coefficients.empty());
  EXPECT_EQ(coefficients[0].records.size(), 2U);
  EXPECT_EQ(coefficients[0].not_comparable, 1U);
}

TEST(UnitCoefficients, CoefficientsBesideOtherPowersAreNotComparable) {
  std::vector<RecordedModel> models;
  for (const auto& [date, beside] :
       std::vector<std::pair<std::string, std::string>>{{"2026-01-01", "c3_deg_h_per_degc3"},
                                                        {"2026-02-01", "c3_deg_h_per_degc3"},
                                                        {"2026-03-01", "c2_deg_h_per_degc2"}}) {
    models.push_back(model_of(
        "a", {measured("bias_temperature", {{"c1_deg_h_per_degc", 1.0}, {beside, 0.1}}, date)}));
  }
  const auto coefficients = measured_effects(models).coefficients;
  ASSERT_FALSE(coefficients.empty());
  EXPECT_EQ(coefficients[0].records.size(), 2U);
  EXPECT_EQ(coefficients[0].not_comparable, 1U);
}

TEST(UnitCoefficients, OtherTemperaturesAreOtherCoefficients) {
  auto by_board = measured("bias_temperature", {{"c1_deg_h_per_degc", 1.0}}, "2026-01-01");
  auto by_case = measured("bias_temperature", {{"c1_deg_h_per_degc", 1.0}}, "2026-02-01");
  by_board.inputs = {"board"};
  by_case.inputs = {"case"};
  const std::vector models{model_of("a", {by_board}), model_of("a", {by_case})};
  EXPECT_EQ(measured_effects(models).coefficients.size(), 2U);
}

// Only as many records as there are of the axis: `d` has none of it.
TEST(UnitCoefficients, AnEffectThatSomeRecordsLackIsToldWithThem) {
  const auto bias = [](const std::string& date) {
    return measured("bias", {{"bias_deg_h", 1.0}}, date);
  };
  const auto magnetic = [](const std::string& date) {
    return measured("magnetic", {{"x_deg_h_per_ut", 1.0}}, date);
  };
  auto elsewhere = bias("2026-01-01");
  elsewhere.axis = core::Axis::kY;
  const std::vector models{model_of("a", {bias("2026-03-01"), magnetic("2026-03-01")}),
                           model_of("a", {bias("2026-01-01")}),
                           model_of("a", {bias("2026-02-01")}),
                           model_of("b", {bias("2026-01-01"), magnetic("2026-01-01")}),
                           model_of("b", {bias("2026-03-01"), magnetic("2026-03-01")}),
                           model_of("c", {bias("2026-01-01")}),
                           model_of("d", {elsewhere}),
                           model_of("e", {bias("2026-01-01"), magnetic("2026-01-01")}),
                           model_of("e", {bias("2026-02-01")}),
                           model_of("e", {bias("2026-03-01"), magnetic("2026-03-01")})};
  const auto found = measured_effects(models).partly_sized;
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].axis, core::Axis::kX);
  EXPECT_EQ(found[0].effect, "magnetic");
  EXPECT_EQ(found[0].sized, 5U);
  EXPECT_EQ(found[0].records, 9U);
  ASSERT_EQ(found[0].units.size(), 3U);
  EXPECT_EQ(found[0].units[0].unit, "a");
  EXPECT_EQ(found[0].units[0].sized, 1U);
  EXPECT_EQ(found[0].units[0].records, 3U);
  EXPECT_EQ(found[0].units[0].first, "2026-03-01");
  EXPECT_TRUE(found[0].units[0].only_late);
  EXPECT_FALSE(found[0].units[0].only_early);
  EXPECT_EQ(found[0].units[1].sized, found[0].units[1].records);
  EXPECT_FALSE(found[0].units[2].only_late);
  EXPECT_FALSE(found[0].units[2].only_early);
}

TEST(UnitCoefficients, BadInputIsToldByFileAndKey) {
  const auto bias = [](const std::string& date) {
    return measured("bias", {{"bias_deg_h", 1.0}}, date);
  };
  EXPECT_EQ(refusal_of({model_of("", {bias("2026-01-01")})}),
            "_2026-01-01.yaml: gyro_id: a unit needs an identity, found none");
  EXPECT_EQ(refusal_of({model_of("a", {bias("March")})}),
            "a_March.yaml: effects[0].origin.date: has to be a day as 2026-03-31, found 'March'");
  EXPECT_EQ(refusal_of({model_of("a", {bias("2026-02-30")})}),
            "a_2026-02-30.yaml: effects[0].origin.date: has to be a day as 2026-03-31, found "
            "'2026-02-30'");
  EXPECT_EQ(refusal_of({model_of("a", {bias("2026-01-01")}), model_of("a", {bias("2026-01-01")})}),
            "a_2026-01-01.yaml: given twice, expected one model a record");
  auto again = model_of("a", {bias("2026-01-01")});
  again.source = "copy.yaml";
  EXPECT_EQ(refusal_of({model_of("a", {bias("2026-01-01")}), again}),
            "copy.yaml: effects[0].origin.record: '2026-01-01.csv' of 2026-01-01 is in "
            "a_2026-01-01.yaml too");
}

}  // namespace
}  // namespace zerodrift::diagnosis
