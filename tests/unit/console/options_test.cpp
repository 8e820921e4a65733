// SPDX-License-Identifier: Apache-2.0
#include <gtest/gtest.h>
#include <unistd.h>

#include <cstdlib>
#include <fstream>

#include "services/console/console_options.h"

namespace zerodrift::services {
namespace {

ConsoleOptions listening_at(const std::string& address, const std::string& token = "") {
  ConsoleOptions options;
  options.listen = address;
  if (token.empty()) return options;
  options.token_file =
      std::filesystem::temp_directory_path() / ("zerodrift_token_" + std::to_string(getpid()));
  std::ofstream(options.token_file) << token << "\nmore lines\n";
  return options;
}

TEST(ConsoleOptions, WhereOthersCanReachItATokenIsNeeded) {
  EXPECT_TRUE(access_options(listening_at("127.0.0.1:8765")).token.empty());
  EXPECT_TRUE(access_options(listening_at("[::1]:8765")).token.empty());
  for (const char* address : {"0.0.0.0:8765", "192.168.0.1:8765", "[::]:8765"}) {
    EXPECT_THROW(access_options(listening_at(address)), std::invalid_argument) << address;
    EXPECT_EQ(access_options(listening_at(address, "0123456789abcdef")).token, "0123456789abcdef");
  }
  setenv("ZERODRIFT_CONSOLE_TOKEN", "fedcba9876543210", 1);
  EXPECT_EQ(access_options(listening_at("0.0.0.0:8765")).token, "fedcba9876543210");
  unsetenv("ZERODRIFT_CONSOLE_TOKEN");
}

TEST(ConsoleOptionsAbuse, ATokenThatIsNoneIsToldWithoutSayingIt) {
  for (const std::string token : {"short-secret", "with a space in it", "with\ttab-in-the-token"}) {
    try {
      access_options(listening_at("127.0.0.1:1", token));
      FAIL() << token;
    } catch (const std::invalid_argument& error) {
      EXPECT_EQ(std::string(error.what()).find(token), std::string::npos);
    }
  }
  ConsoleOptions nowhere;
  nowhere.token_file = "/nowhere/token";
  EXPECT_THROW(access_options(nowhere), std::invalid_argument);
}

}  // namespace
}  // namespace zerodrift::services
