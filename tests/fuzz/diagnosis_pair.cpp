// SPDX-License-Identifier: Apache-2.0
#include "tests/fuzz/diagnosis_pair.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>
#include <random>
#include <utility>

#include "common/twin/effect_catalogue.h"
#include "tests/fuzz/formula_generator.h"

namespace zerodrift::fuzz {
namespace {

using Values = std::vector<double>;

class Chance {
 public:
  explicit Chance(std::uint64_t seed) : random_(seed) {}

  double between(double low, double high) {
    return std::uniform_real_distribution<double>(low, high)(random_);
  }
  double log_between(double low, double high) {
    return std::exp(between(std::log(low), std::log(high)));
  }
  double normal() { return normal_(random_); }
  bool once_in(double times) { return between(0.0, times) < 1.0; }
  bool with(double probability) { return between(0.0, 1.0) < probability; }
  std::size_t below(std::size_t count) {
    return std::uniform_int_distribution<std::size_t>(0, count - 1)(random_);
  }
  template <typename Items>
  auto one_of(const Items& items) {
    return *(std::begin(items) + static_cast<std::ptrdiff_t>(below(std::size(items))));
  }

 private:
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
};

struct Digits {
  std::chars_format format = std::chars_format::general;
  int count = 9;
};

struct Column {
  std::string header;
  Values values{};
  Digits digits{};
};

// What both records of a pair have in common.
struct Layout {
  double period_s = 1.0;
  bool is_wild = false;  // readings beyond all sense
  std::vector<std::string> headers{};
};

class RecordMaker {
 public:
  RecordMaker(Chance& chance, Layout layout)
      : chance_(chance),
        layout_(std::move(layout)),
        rows_(static_cast<std::size_t>(chance.log_between(3.0, 3000.0))) {
    if (chance.with(0.5)) rows_ = static_cast<std::size_t>(chance.log_between(100.0, 1200.0));
  }

  std::string text() {
    add_time();
    Values inputs(rows_, 0.0);
    std::vector<std::size_t> rates;
    for (const std::string& header : layout_.headers) {
      if (header.starts_with("rate_")) {
        rates.push_back(columns_.size());
        columns_.push_back({header});
        continue;
      }
      columns_.push_back({header, header.starts_with("reference_") ? turns() : input(header)});
      take_part(inputs, columns_.back().values);
    }
    for (const std::size_t rate : rates) columns_[rate].values = rate_of(columns_[rate], inputs);
    spoil();
    return written();
  }

 private:
  void add_time() {
    Values time(rows_);
    double now = chance_.once_in(10.0) ? chance_.log_between(1.0, 2e9) : 0.0;
    const double lost = chance_.once_in(4.0) ? chance_.log_between(1e-3, 0.5) : 0.0;
    for (double& t : time) {
      t = now;
      now += layout_.period_s;
      while (chance_.with(lost)) now += layout_.period_s;
    }
    if (chance_.once_in(20.0) && rows_ > 4) time[chance_.below(rows_)] += 3.3 * layout_.period_s;
    columns_.push_back({"time_s", std::move(time), {std::chars_format::fixed, 6}});
  }

  // Constant, levels, waves, ramps, wandering.
  Values course(double offset, double size) {
    const std::size_t kind = chance_.below(7);
    const double period = chance_.log_between(3.0, 2.0 * static_cast<double>(rows_));
    Values values(rows_, offset);
    double walk = 0.0;
    for (std::size_t i = 0; i < rows_; ++i) {
      const double phase = 2.0 * M_PI * static_cast<double>(i) / period;
      walk += chance_.normal() / std::sqrt(static_cast<double>(rows_));
      const std::array shapes{0.0,
                              std::sin(phase),
                              std::sin(phase) > 0.0 ? 1.0 : 0.0,
                              static_cast<double>(i) / static_cast<double>(rows_),
                              i > rows_ / 2 ? 1.0 : 0.0,
                              walk,
                              2.0 / M_PI * std::asin(std::sin(phase))};
      values[i] += size * shapes[kind];
    }
    return values;
  }

  Values input(const std::string& header) {
    double offset = 25.0;
    double size = chance_.log_between(0.01, 40.0);
    if (header.starts_with("magnetic")) size = 50.0;
    if (header.starts_with("acceleration")) offset = 0.0, size = 9.8;
    if (header.starts_with("supply")) offset = 5.0, size = chance_.once_in(3.0) ? -5.0 : 0.1;
    if (header.starts_with("vibration")) offset = 0.0, size = 1.0;
    if (chance_.once_in(25.0)) size *= chance_.log_between(1e-12, 1e12);
    Values values = course(offset, size);
    if (chance_.with(0.7)) return values;
    const double noise = chance_.log_between(1e-6, 0.1) * std::abs(size);
    for (double& value : values) value += noise * chance_.normal();
    return values;
  }

  Values turns() { return course(chance_.between(-20.0, 20.0), chance_.log_between(1.0, 1e6)); }

  void take_part(Values& sum, const Values& values) {
    if (chance_.with(0.4)) return;
    const auto [low, high] = std::minmax_element(values.begin(), values.end());
    const double span = *high - *low;
    if (!(span > 0.0) || !std::isfinite(span)) return;
    const double power = chance_.one_of(std::array{1.0, 1.0, 2.0, 3.0});
    for (std::size_t i = 0; i < rows_; ++i)
      sum[i] += std::pow(std::abs((values[i] - *low) / span), power);
  }

  [[nodiscard]] const Column* column(const std::string& header) const {
    for (const Column& column : columns_) {
      if (column.header == header) return &column;
    }
    return nullptr;
  }

  // deg/h
  Values rate_of(Column& rate, const Values& inputs) {
    const double noise = chance_.log_between(1e-4, 10.0);
    const double walk = chance_.with(0.5) ? noise * chance_.log_between(1e-3, 1.0) : 0.0;
    const double of_inputs = chance_.with(0.8) ? noise * chance_.log_between(0.05, 50.0) : 0.0;
    const double bias = chance_.between(-5.0, 5.0);
    const Column* reference = column("reference_" + rate.header.substr(5));
    const bool moves = reference == nullptr && chance_.once_in(8.0);
    const Values motion = moves ? turns() : Values(rows_, 0.0);
    Values values(rows_);
    double slow = bias;
    for (std::size_t i = 0; i < rows_; ++i) {
      slow += walk * chance_.normal();
      values[i] = slow + noise * chance_.normal() + of_inputs * inputs[i] + motion[i];
      if (reference != nullptr) values[i] += reference->values[i];
    }
    if (chance_.once_in(40.0)) std::fill(values.begin(), values.end(), bias);
    if (chance_.once_in(40.0)) std::fill(values.begin(), values.end(), 0.0);
    if (chance_.once_in(10.0)) {
      const double limit = 0.7 * *std::max_element(values.begin(), values.end());
      for (double& value : values) value = std::min(value, limit);
    }
    if (chance_.once_in(6.0))
      rate.digits = {std::chars_format::general, static_cast<int>(chance_.below(4)) + 1};
    return values;
  }

  // Lost readings one by one and in blocks, wild ones, and what is no number.
  void spoil() {
    constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
    for (std::size_t c = 1; c < columns_.size(); ++c) {
      Values& values = columns_[c].values;
      if (chance_.once_in(5.0)) {
        const double lost = chance_.log_between(1e-3, 1.0);
        for (double& value : values) value = chance_.with(lost) ? kNone : value;
      }
      if (chance_.once_in(6.0)) {
        const std::size_t begin = chance_.below(rows_);
        const std::size_t end = begin + chance_.below(rows_ - begin + 1);
        for (std::size_t i = begin; i < end; ++i) values[i] = kNone;
      }
      if (chance_.once_in(50.0)) std::fill(values.begin(), values.end(), kNone);
      if (chance_.once_in(8.0)) {
        for (std::size_t n = chance_.below(4) + 1; n > 0; --n)
          values[chance_.below(rows_)] += wild();
      }
    }
  }

  double wild() {
    const double sign = chance_.with(0.5) ? 1.0 : -1.0;
    if (!layout_.is_wild) return sign * chance_.log_between(1e-3, 1e4);
    constexpr std::array kWild{1e8,   1e30,  1e154,
                               1e300, 1e308, std::numeric_limits<double>::infinity()};
    return sign * chance_.one_of(kWild);
  }

  static std::string written(double value, const Digits& digits) {
    std::array<char, 400> cell{};
    char* const end = cell.data() + cell.size();
    return {cell.data(), std::to_chars(cell.data(), end, value, digits.format, digits.count).ptr};
  }

  [[nodiscard]] std::string written() {
    std::string text;
    for (const Column& column : columns_) text += (text.empty() ? "" : ",") + column.header;
    const std::string missing = chance_.once_in(4.0) ? "nan" : "";
    for (std::size_t i = 0; i < rows_; ++i) {
      text += '\n';
      for (std::size_t c = 0; c < columns_.size(); ++c) {
        const double value = columns_[c].values[i];
        if (c > 0) text += ',';
        text += std::isnan(value) ? missing : written(value, columns_[c].digits);
      }
    }
    return text + '\n';
  }

  Chance& chance_;
  Layout layout_;
  std::size_t rows_;
  std::vector<Column> columns_{};
};

Layout layout(Chance& chance) {
  Layout layout;
  layout.period_s = chance.one_of(std::array{0.1, 0.5, 1.0, 1.0, 2.0, 6.0, 6.0, 20.0, 60.0});
  layout.is_wild = chance.once_in(8.0);
  const auto perhaps = [&](const std::string& header, double probability) {
    if (chance.with(probability)) layout.headers.push_back(header);
  };
  const double channels = chance.between(0.0, 0.7);
  for (const char* probe : {"coil_outer", "coil_inner", "coil", "board", "case", "chamber", "fan"})
    perhaps("temperature_" + std::string(probe) + "_degC", channels);
  const bool has_reference = chance.with(0.5);
  for (const char* axis : {"x", "y", "z"}) {
    const std::string of(axis);
    if (has_reference) perhaps("reference_" + of + "_deg_h", 0.7);
    perhaps("magnetic_" + of + "_uT", channels);
    perhaps("acceleration_" + of + "_m_s2", channels);
    perhaps("rate_" + of + "_deg_h", of == "x" ? 0.95 : 0.15);
  }
  perhaps("vibration_g", channels);
  perhaps("source_current_mA", channels);
  perhaps("supply_V", channels);
  return layout;
}

double value_of(Chance& chance, const twin::ParameterDefinition& parameter) {
  const double usual = parameter.default_value * std::exp(chance.normal());
  const double low = std::max(parameter.minimum, -1e9);
  const double high = std::min(parameter.maximum, 1e9);
  const std::array values{usual, usual, usual, usual, usual, -usual, 0.0, low, high, 1e-300};
  return std::clamp(chance.one_of(values), parameter.minimum, parameter.maximum);
}

twin::EffectSpec formula(Chance& chance) {
  std::vector<std::uint8_t> choices(40);
  for (auto& choice : choices) choice = static_cast<std::uint8_t>(chance.below(256));
  return {.kind = "formula", .formula = FormulaGenerator(choices).formula()};
}

twin::EffectSpec spec_of(Chance& chance, const twin::EffectDefinition& definition,
                         double with_values) {
  twin::EffectSpec spec{.kind = definition.kind};
  if (!chance.with(with_values)) return spec;
  for (const twin::ParameterDefinition& parameter : definition.parameters) {
    if (chance.with(0.2)) continue;
    const double value = value_of(chance, parameter);
    spec.parameters[parameter.name] = value;
    if (chance.with(0.2))
      spec.standard_errors[parameter.name] = std::abs(value) * chance.log_between(1e-6, 1e3);
  }
  if (chance.with(0.2)) {
    for (std::size_t i = 0; i < definition.inputs.size(); ++i)
      spec.inputs.push_back(chance.one_of(twin::temperature_point_names()));
  }
  return spec;
}

// What is not sound on its own is left out: models that are refused say nothing of the diagnosis.
twin::Model model(Chance& chance) {
  twin::Model model;
  const double listed = chance.between(0.0, 0.5);
  const double with_values = chance.one_of(std::array{0.0, 0.5, 1.0, 1.0});
  const auto add = [&](twin::EffectSpec spec) {
    spec.axis = chance.with(0.8) ? core::Axis::kX : core::Axis::kY;
    model.effects.push_back(std::move(spec));
    if (model.find_problem()) model.effects.pop_back();
  };
  for (const twin::EffectDefinition& definition : twin::effect_catalogue()) {
    const bool is_noise = definition.family == twin::Family::kStochastic;
    if (chance.with(is_noise ? std::max(listed, 0.3) : listed))
      add(spec_of(chance, definition, with_values));
  }
  while (chance.once_in(4.0)) add(formula(chance));
  return model;
}

}  // namespace

DiagnosisPair diagnosis_pair(std::uint64_t seed) {
  Chance chance(seed);
  const Layout of = layout(chance);
  DiagnosisPair pair;
  pair.record = RecordMaker(chance, of).text();
  if (chance.once_in(8.0)) pair.validation = RecordMaker(chance, of).text();
  pair.model = model(chance);
  return pair;
}

}  // namespace zerodrift::fuzz
