// SPDX-License-Identifier: Apache-2.0
// Formulas from bytes, by the grammar of twin/formula.h and a little beside it: what a mutation of
// text hardly ever reaches.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>
#include <string>

namespace zerodrift::fuzz {

class FormulaGenerator {
 public:
  explicit FormulaGenerator(std::span<const std::uint8_t> choices) : choices_(choices) {}

  // Of a few summands, most with an amplitude of their own. Where the bytes end, it ends.
  std::string formula() {
    std::string text = summand();
    while (draw(4) == 1 && text.size() < kLongest) text += sign() + summand();
    return text;
  }

 private:
  static constexpr std::size_t kLongest = 600;
  static constexpr int kDeepest = 20;

  // 0 once the bytes have ended.
  std::size_t draw(std::size_t below) {
    if (at_ == choices_.size()) return 0;
    return choices_[at_++] % below;
  }

  std::string sign() { return draw(2) == 0 ? " + " : "-"; }

  std::string summand() {
    const std::string own = "k" + std::to_string(++amplitudes_);
    switch (draw(8)) {
      case 0: return part(0);  // without an amplitude: mostly refused
      case 1: return "-" + own + " * " + part(0);
      case 2: return part(0) + " * " + own;
      case 3: return spline(own) + (draw(2) == 0 ? "" : " * " + part(0));
      default: return own + " * " + part(0);
    }
  }

  std::string part(int depth) {
    if (depth > kDeepest) return input();
    switch (draw(15)) {
      case 0:
      case 1:
      case 2: return input();
      case 3: return number();
      case 4: return constant();
      case 5: return "(" + part(depth + 1) + sign() + part(depth + 1) + ")";
      case 6: return part(depth + 1) + " * " + part(depth + 1);
      case 7: return part(depth + 1) + " / " + part(depth + 1);
      case 8: return "(" + part(depth + 1) + ")^" + std::to_string(draw(8));
      case 9: return "lag(" + part(depth + 1) + ", " + constant() + ")";
      case 10: return "play(" + part(depth + 1) + ", " + constant() + ")";
      case 11: return "rate(" + (draw(8) == 1 ? part(depth + 1) : input()) + ")";
      case 12: return "abs(" + part(depth + 1) + ")";
      case 13: return draw(8) == 1 ? spline("q") : input();
      default:
        return (draw(2) == 0 ? "tanh(" : "exp(") + part(depth + 1) + " / " + constant() + ")";
    }
  }

  // Mostly one that is taken: of three or more parameters of its own.
  std::string spline(const std::string& own) {
    std::string text = "spline(" + part(kDeepest) + ", " + (draw(2) == 0 ? "-" : "") + number() +
                       ", " + (draw(8) == 1 ? "-" : "") + number();
    const std::size_t count = 2 + draw(5);
    for (std::size_t i = 0; i < count; ++i) text += ", " + own + "_" + std::to_string(i);
    if (draw(8) == 1) text += ", " + constant();
    return text + ")";
  }

  std::string input() {
    static constexpr std::array kInputs{"T_coil", "B_x",     "a_z",     "w_x",      "vibration",
                                        "supply", "time_on", "T_board", "T_nowhere"};
    return kInputs[draw(kInputs.size())];
  }
  std::string number() {
    static constexpr std::array kNumbers{"18", "0", "2.5e-3", "1e12", "1e13", ".5", "1e-2"};
    return kNumbers[draw(kNumbers.size())];
  }
  std::string constant() { return draw(2) == 0 ? number() : "p" + std::to_string(draw(9)); }

  std::span<const std::uint8_t> choices_;
  std::size_t at_ = 0;
  int amplitudes_ = 0;
};

}  // namespace zerodrift::fuzz
