// SPDX-License-Identifier: Apache-2.0
// ZERODRIFT_DOMAIN stands in for --domain wherever that is, and nowhere else.
#include <gtest/gtest.h>

#include <cstdlib>
#include <optional>
#include <string>
#include <vector>

#include "common/service/main.h"

namespace zerodrift::service {
namespace {

struct Ran {
  int exit_code = -1;
  std::optional<std::uint32_t> domain;  // that the body saw
  std::string refusal;
};

class DomainVariable : public testing::Test {
 protected:
  ~DomainVariable() override { ::unsetenv("ZERODRIFT_DOMAIN"); }

  // `app live ...` joins a domain, `app offline` doesn't.
  static Ran run(const char* variable, std::vector<std::string> arguments) {
    if (variable == nullptr)
      ::unsetenv("ZERODRIFT_DOMAIN");
    else
      ::setenv("ZERODRIFT_DOMAIN", variable, 1);
    CLI::App app("", "app");
    dds::NetworkOptions network;
    bool is_live = false;
    auto* live = app.add_subcommand("live");
    add_network_options(*live, network);
    live->callback([&] { is_live = true; });
    app.add_subcommand("offline");
    arguments.insert(arguments.begin(), "app");
    std::vector<char*> argv;
    for (std::string& argument : arguments) argv.push_back(argument.data());
    Ran ran;
    testing::internal::CaptureStderr();
    ran.exit_code = run_version("v", app, static_cast<int>(argv.size()), argv.data(), [&] {
      if (is_live) ran.domain = network.domain;
      return kExitDone;
    });
    ran.refusal = testing::internal::GetCapturedStderr();
    return ran;
  }
};

TEST_F(DomainVariable, IsTheDomainWhereTheCommandLineSaysNone) {
  EXPECT_EQ(run(nullptr, {"live"}).domain, 0U);
  EXPECT_EQ(run("", {"live"}).domain, 0U);
  EXPECT_EQ(run("77", {"live"}).domain, 77U);
  EXPECT_EQ(run("77", {"live", "--domain", "5"}).domain, 5U);
  EXPECT_EQ(run("232", {"live"}).domain, 232U);
}

TEST_F(DomainVariable, IsNamedInOneLineWhereItIsNoDomain) {
  for (const std::string bad : {"abc", "233", "-1", "1.5", "7 7", "\xff\n", " "}) {
    const Ran ran = run(bad.c_str(), {"live"});
    EXPECT_EQ(ran.exit_code, kExitBadInput) << bad;
    EXPECT_EQ(ran.domain, std::nullopt) << bad;
    EXPECT_TRUE(ran.refusal.starts_with("app: ZERODRIFT_DOMAIN: found '")) << ran.refusal;
    EXPECT_NE(ran.refusal.find("expected a DDS domain, 0 to 232\n"), std::string::npos)
        << ran.refusal;
    EXPECT_EQ(ran.refusal.find('\n'), ran.refusal.size() - 1) << ran.refusal;
  }
}

TEST_F(DomainVariable, IsNotLookedAtByWhatJoinsNoDomainOrIsToldOne) {
  EXPECT_EQ(run("abc", {"offline"}).exit_code, kExitDone);
  EXPECT_EQ(run("abc", {"live", "--domain", "5"}).domain, 5U);
}

}  // namespace
}  // namespace zerodrift::service
