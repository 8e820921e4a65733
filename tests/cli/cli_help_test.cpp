// SPDX-License-Identifier: Apache-2.0
// What every command of every program says of itself, found by its help.
#include <algorithm>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

#include "common/core/wrapped_text.h"
#include "tests/cli/command_line.h"

namespace zerodrift::cli_test {
namespace {

class Help : public CommandLine {
 protected:
  struct Said {
    Arguments command;
    std::string help;
  };

  // Of the program, of its commands and of theirs.
  std::vector<Said> every_help() {
    std::vector<Said> all;
    add_helps({}, all);
    return all;
  }

  static std::string name_of(const Arguments& command) {
    std::string name = "zerodrift";
    for (const auto& word : command) name += ' ' + word;
    return name;
  }

 private:
  void add_helps(const Arguments& command, std::vector<Said>& all) {
    const Finished asked = run(system_test::operator+(command, {"--help"}));
    EXPECT_EQ(asked.exit_code, 0) << name_of(command) << '\n' << asked.err;
    all.push_back({command, asked.out});
    for (const std::string& word : commands_in(asked.out))
      add_helps(system_test::operator+(command, {word}), all);
  }

  static std::vector<std::string> commands_in(const std::string& help) {
    std::vector<std::string> words;
    const std::regex line(R"(  ([a-z][a-z-]*) .*)");
    std::istringstream lines(help);
    bool lists_commands = false;
    std::smatch found;
    for (std::string text; std::getline(lines, text);) {
      if (!text.starts_with(' '))
        lists_commands = text == "Subcommands:" || text == "Programs of their own:";
      if (lists_commands && std::regex_match(text, found, line)) words.push_back(found[1]);
    }
    return words;
  }
};

TEST_F(Help, IsTextAlone) {
  const auto all = every_help();
  ASSERT_GE(all.size(), 35U) << "commands, programs, and commands of ctl, config and bench";
  for (const auto& [command, help] : all) {
    EXPECT_TRUE(std::none_of(help.begin(), help.end(),
                             [](unsigned char c) { return (c < ' ' && c != '\n') || c == 127; }))
        << name_of(command) << '\n'
        << help;
  }
}

TEST_F(Help, FitsEightyColumns) {
  for (const auto& [command, help] : every_help()) {
    std::istringstream lines(help);
    for (std::string line; std::getline(lines, line);) {
      // A word that can't be broken has a line of its own.
      const bool is_one_word = line.find(' ', line.find_first_not_of(' ')) == std::string::npos;
      EXPECT_TRUE(core::character_count(line) <= core::kTextWidth || is_one_word)
          << name_of(command) << ": " << line;
    }
  }
}

TEST_F(Help, OffersTheVersionWhichEveryCommandTells) {
  const std::string version = run({"--version"}).out;
  for (const auto& [command, help] : every_help()) {
    EXPECT_NE(help.find("--version"), std::string::npos) << name_of(command);
    const Finished asked = run(system_test::operator+(command, {"--version"}));
    EXPECT_EQ(asked.exit_code, 0) << name_of(command) << '\n' << asked.err;
    EXPECT_EQ(asked.out, version) << name_of(command);
  }
}

TEST_F(Help, ShowsADefaultOfATimeOrARateWithItsUnit) {
  const std::regex with_default(R"((60s\||20Hz\|)[^ \n]*=([^ \n]+))");
  const std::regex with_unit(R"(.*(s|Hz))");
  int seen = 0;
  for (const auto& [command, help] : every_help()) {
    const std::sregex_iterator end;
    for (std::sregex_iterator one(help.begin(), help.end(), with_default); one != end; ++one) {
      ++seen;
      EXPECT_TRUE(std::regex_match((*one)[2].str(), with_unit))
          << name_of(command) << ": " << one->str();
    }
  }
  EXPECT_GE(seen, 15) << "of ctl, compare, health, record, the services";
}

TEST_F(Help, ShowsWhatAnOptionIsWithoutIt) {
  const auto shows = [&](const Arguments& command, const std::string& text) {
    const std::string help = run(system_test::operator+(command, {"--help"})).out;
    EXPECT_NE(help.find(text), std::string::npos) << text << " isn't in\n" << help;
  };
  shows({"compensate"}, "=the file's, else stack");
  shows({"record"}, "--compression zstd|lz4|none [zstd]");
  shows({"export"}, "--compression zstd|lz4|none [zstd]");
  shows({"ctl", "freeze"}, "--service TEXT=the compensation that leads");
  shows({"ctl", "inject"}, "--service TEXT=gyro_publisher");
  shows({"gyro-publisher"}, "what the gyro sends; delta_angle_rad");
  shows({"gyro-publisher"}, "--temperature-unit ENUM:C|C_100|F|F_100=C\n");
}

// Before: --security "" ran unsecured, and --config "" by the defaults, without a word.
TEST_F(Help, OffersNoOptionThatTakesAnEmptyValueButWhoIsWaitedFor) {
  // A space and what the value is, where a flag has none or what it needs.
  const std::regex with_value(R"(  (?:-[a-zA-Z],)?(--[a-z0-9-]+) (?!Needs:)[^ ].*)");
  int seen = 0;
  for (const auto& [command, help] : every_help()) {
    std::istringstream lines(help);
    std::smatch found;
    for (std::string line; std::getline(lines, line);) {
      if (!std::regex_match(line, found, with_value)) continue;
      const std::string option = found[1];
      if (option == "--wait-for") continue;
      ++seen;
      const Finished asked = run(system_test::operator+(command, {option, ""}));
      EXPECT_EQ(asked.exit_code, 2) << name_of(command) << ' ' << option;
      EXPECT_NE(asked.err.find(": " + option +
                               ": found an empty value, expected one; without one leave the option "
                               "out (--help tells more)\n"),
                std::string::npos)
          << name_of(command) << '\n'
          << asked.err;
      EXPECT_EQ(lines_of(asked.err), 1U) << asked.err;
    }
  }
  EXPECT_GE(seen, 400) << "paths, addresses, times and what else is a value";
}

TEST_F(Help, AnEmptyArgumentIsRefusedAsAnEmptyOptionIs) {
  const Finished asked = run({"ctl", "inject", ""});
  EXPECT_EQ(asked.exit_code, 2);
  EXPECT_EQ(asked.err, "ctl: what: found an empty value, expected one (--help tells more)\n");
}

TEST_F(Help, ARateIsTakenWithItsUnit) {
  make_record(30);
  const std::string model = std::string(ZERODRIFT_SOURCE_DIR) + "/config/models/paper_fog.yaml";
  for (const std::string rate : {"10", "10Hz", "10 Hz", "0.01kHz"}) {
    const Finished made = run({"simulate", "--model", model, "--profile", "@profile.yaml", "--rate",
                               rate, "--reference", "--out", "@again.csv"});
    EXPECT_EQ(made.exit_code, 0) << made.err;
    EXPECT_EQ(content(path("again.csv")), content(path("record.csv"))) << rate;
  }
  const Finished refused = run({"simulate", "--model", model, "--profile", "@profile.yaml",
                                "--rate", "10s", "--out", "@again.csv"});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(
      refused.err.find("found '10s', expected a rate above 0 and up to 1 MHz, as 20, 20Hz or 1kHz"),
      std::string::npos)
      << refused.err;
}

}  // namespace
}  // namespace zerodrift::cli_test
