// SPDX-License-Identifier: Apache-2.0
#include "common/dds/clean_texts.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>
#include <vector>

namespace zerodrift::dds {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// The first group of each match.
std::vector<std::string> all_of(const std::string& text, const std::regex& pattern) {
  std::vector<std::string> found;
  for (std::sregex_iterator match(text.begin(), text.end(), pattern), end; match != end; ++match)
    found.push_back((*match)[1].str());
  return found;
}

// Rule: every text of every message is cleaned. A field that is added to the IDL is missing here.
TEST(CleanTexts, AreAllTextsOfTheInterface) {
  const std::filesystem::path root(ZERODRIFT_SOURCE_DIR);
  std::vector<std::string> fields;
  for (const auto& file : std::filesystem::directory_iterator(root / "idl/dds")) {
    if (file.path().filename() == "ros2_sensors.idl") continue;  // of ROS 2; its texts are not used
    const std::regex field(R"(^ *(?:@key )?string<\d+> (\w+);)", std::regex::multiline);
    for (const std::string& name : all_of(content(file.path()), field)) fields.push_back(name);
  }
  std::vector<std::string> cleaned;
  const std::regex call(R"(\bclean\(([^;{]*)\);)");
  const std::regex argument(R"(\.(\w+)\(\))");
  for (const std::string& arguments : all_of(content(root / "common/dds/clean_texts.h"), call))
    for (const std::string& name : all_of(arguments, argument)) cleaned.push_back(name);
  EXPECT_GE(fields.size(), 20U);
  std::sort(fields.begin(), fields.end());
  std::sort(cleaned.begin(), cleaned.end());
  EXPECT_EQ(cleaned, fields);
}

TEST(CleanTexts, AForgedCommandIsOneHarmlessLine) {
  msg::Command command;
  command.service("compensation");
  command.name("x\n2026 error\x1b[2J");
  command.argument("\xff");
  command.issuer("25 °C");
  clean_texts(command);
  EXPECT_STREQ(command.service().c_str(), "compensation");
  EXPECT_STREQ(command.name().c_str(), "x 2026 error?[2J");
  EXPECT_STREQ(command.argument().c_str(), "?");
  EXPECT_STREQ(command.issuer().c_str(), "25 °C");
}

TEST(CleanTexts, OfListsWithinAMessageAreCleanToo) {
  msg::ServiceStatus status;
  status.metrics().resize(2);
  status.metrics()[1].name("a\nb");
  clean_texts(status);
  EXPECT_STREQ(status.metrics()[1].name().c_str(), "a b");
  msg::TwinReport report;
  report.effects().resize(1);
  report.effects()[0].alternatives().emplace_back().name("\x1b");
  clean_texts(report);
  EXPECT_STREQ(report.effects()[0].alternatives()[0].name().c_str(), "?");
}

}  // namespace
}  // namespace zerodrift::dds
