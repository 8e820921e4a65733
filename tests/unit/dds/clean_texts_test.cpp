// SPDX-License-Identifier: Apache-2.0
#include "common/dds/clean_texts.h"

#include <gtest/gtest.h>

#include <filesystem>
#include <fstream>
#include <regex>
#include <sstream>
#include <string>

namespace zerodrift::dds {
namespace {

std::string content(const std::filesystem::path& path) {
  std::ostringstream text;
  text << std::ifstream(path).rdbuf();
  return text.str();
}

// Rule: every text of every message is cleaned. A field that is added to the IDL is missing here.
TEST(CleanTexts, AreAllTextsOfTheInterface) {
  const std::filesystem::path root(ZERODRIFT_SOURCE_DIR);
  const std::string header = content(root / "common/dds/clean_texts.h");
  const std::regex fields(R"(^ *(?:@key )?string<\d+> (\w+);)", std::regex::multiline);
  std::size_t found = 0;
  for (const auto& file : std::filesystem::directory_iterator(root / "idl/dds")) {
    if (file.path().filename() == "ros2_sensors.idl") continue;  // of ROS 2; its texts are not used
    const std::string idl = content(file.path());
    for (std::sregex_iterator field(idl.begin(), idl.end(), fields), end; field != end; ++field) {
      EXPECT_NE(header.find("." + (*field)[1].str() + "());"), std::string::npos)
          << file.path().filename() << ": " << (*field)[1];
      ++found;
    }
  }
  std::size_t cleaned = 0;
  for (std::size_t at = header.find("  clean_text("); at != std::string::npos;
       at = header.find("  clean_text(", at + 1)) {
    ++cleaned;
  }
  EXPECT_EQ(found, cleaned);
  EXPECT_GE(found, 20U);
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
  report.effects()[0].alternatives("\x1b");
  clean_texts(report);
  EXPECT_STREQ(report.effects()[0].alternatives().c_str(), "?");
}

}  // namespace
}  // namespace zerodrift::dds
