// SPDX-License-Identifier: Apache-2.0
// How often `zerodrift compensate` changes its mode over the default five hours.
#include <algorithm>
#include <array>
#include <fstream>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

const std::string kConfig = std::string(ZERODRIFT_SOURCE_DIR) + "/config/";

std::vector<std::string> cells_of(const std::string& line) {
  std::vector<std::string> cells;
  std::istringstream in(line);
  for (std::string cell; std::getline(in, cell, ',');) cells.push_back(cell);
  return cells;
}

class Modes : public CommandLine {
 protected:
  void SetUp() override {
    ASSERT_EQ(run({"simulate", "--model", kConfig + "models/paper_fog.yaml", "--profile",
                   kConfig + "profiles/paper_chamber.yaml", "--rate", "20", "--out", "@r.csv"})
                  .exit_code,
              0);
  }

  // By axis.
  std::array<int, 3> changes_with(const std::string& scheme) {
    EXPECT_EQ(
        run({"compensate", "--record", "@r.csv", "--scheme", scheme, "--out", "@c.csv"}).exit_code,
        0);
    std::ifstream in(path("c.csv"));
    std::vector<std::string> header;
    std::array<std::string, 3> before;
    std::array<int, 3> changes{};
    for (std::string line; std::getline(in, line);) {
      if (line.starts_with('#')) continue;
      const auto cells = cells_of(line);
      if (header.empty()) {
        header = cells;
        continue;
      }
      for (std::size_t axis = 0; axis < 3; ++axis) {
        const std::string column = std::string("mode_") + "xyz"[axis];
        const auto place = std::find(header.begin(), header.end(), column) - header.begin();
        const std::string& mode = cells.at(static_cast<std::size_t>(place));
        if (!before[axis].empty() && mode != before[axis]) ++changes[axis];
        before[axis] = mode;
      }
    }
    return changes;
  }
};

// Rule: nothing, the first mean, the model; what it does after is to learn. Noise changes no mode.
TEST_F(Modes, ChangeAtMost25TimesInTheDefaultFiveHours) {
  for (const int changes : changes_with("stack")) {
    EXPECT_GE(changes, 2);
    EXPECT_LE(changes, 25);
  }
}

// Rule: the SVR alone stays in force until it is 5 % worse than holding. Without that leeway it
// changed 125, 194 and 106 times.
TEST_F(Modes, OfTheSvrAloneChangeRarelyForItHasToBeClearlyWorseThanHoldingToLeave) {
  for (const int changes : changes_with("online-svr")) {
    EXPECT_GE(changes, 2);
    EXPECT_LE(changes, 75);
  }
}

}  // namespace
}  // namespace zerodrift::cli_test
