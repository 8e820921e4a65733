// SPDX-License-Identifier: Apache-2.0
// Who may ask: every combination of host, origin and token.
#include "common/web/access.h"

#include <gtest/gtest.h>

namespace zerodrift::web {
namespace {

constexpr const char* kToken = "0123456789abcdef";

struct Case {
  const char* name;
  const char* listen;
  const char* host;
  const char* origin;  // of an upgrade
  const char* authorization;
  const char* query_token;
  unsigned expected;  // 0: allowed
};

class AccessMatrix : public testing::TestWithParam<Case> {};

unsigned verdict(const Case& c, bool is_upgrade, Wants wants) {
  AccessOptions options;
  options.listen = {c.listen, 8765};
  options.token = kToken;
  options.allowed_origins = {"https://app.foxglove.dev"};
  const Access access(options);
  Request request;
  request.is_upgrade = is_upgrade;
  request.host = c.host;
  request.origin = c.origin;
  request.authorization = c.authorization;
  if (*c.query_token != '\0') request.target.query["token"] = c.query_token;
  const auto refusal = access.refusal(request, wants);
  return refusal ? refusal->status : 0;
}

TEST_P(AccessMatrix, DecidesEachUpgrade) {
  EXPECT_EQ(verdict(GetParam(), true, Wants::kData), GetParam().expected);
}

constexpr const char* kBearer = "Bearer 0123456789abcdef";
constexpr const char* kLoop = "127.0.0.1";
constexpr const char* kHost = "127.0.0.1:8765";

INSTANTIATE_TEST_SUITE_P(
    All, AccessMatrix,
    testing::Values(Case{"native", kLoop, kHost, "", kBearer, "", 0},
                    Case{"query", kLoop, kHost, "", "", kToken, 0},
                    Case{"lower_case_scheme", kLoop, kHost, "", "bearer 0123456789abcdef", "", 0},
                    Case{"no_token", kLoop, kHost, "", "", "", 401},
                    Case{"wrong_token", kLoop, kHost, "", "Bearer 0123456789abcdeF", "", 401},
                    Case{"prefix", kLoop, kHost, "", "Bearer 0123456789abcde", "", 401},
                    Case{"longer", kLoop, kHost, "", "Bearer 0123456789abcdefg", "", 401},
                    Case{"basic", kLoop, kHost, "", "Basic 0123456789abcdef", "", 401},
                    Case{"own_page", kLoop, kHost, "http://127.0.0.1:8765", kBearer, "", 0},
                    Case{"own_page_tls", kLoop, "localhost:8765", "https://localhost:8765", kBearer,
                         "", 0},
                    Case{"other_port", kLoop, kHost, "http://127.0.0.1:8000", kBearer, "", 403},
                    Case{"foreign_page", kLoop, kHost, "https://evil.example", kBearer, "", 403},
                    Case{"allowed_page", kLoop, kHost, "https://app.foxglove.dev", kBearer, "", 0},
                    Case{"suffix_of_allowed", kLoop, kHost, "https://app.foxglove.dev.evil.example",
                         kBearer, "", 403},
                    Case{"null_origin", kLoop, kHost, "null", kBearer, "", 403},
                    Case{"rebound_name", kLoop, "evil.example:8765", "http://evil.example:8765",
                         kBearer, "", 403},
                    Case{"loopback_prefix", kLoop, "127.0.0.1.evil.example", "", kBearer, "", 403},
                    Case{"no_host", kLoop, "", "", kBearer, "", 400},
                    Case{"v6_loopback", "::1", "[::1]:8765", "http://[::1]:8765", kBearer, "", 0},
                    Case{"wide_any_host", "0.0.0.0", "console.lab:8765", "http://console.lab:8765",
                         kBearer, "", 0},
                    Case{"wide_no_token", "0.0.0.0", "console.lab:8765", "http://console.lab:8765",
                         "", "", 401},
                    Case{"wide_foreign", "0.0.0.0", "console.lab:8765", "http://evil.example",
                         kBearer, "", 403}),
    [](const auto& of) { return std::string(of.param.name); });

TEST(Access, APageNeedsNoTokenAndItsDataDoes) {
  const Case bare{"", kLoop, kHost, "", "", "", 0};
  EXPECT_EQ(verdict(bare, false, Wants::kPage), 0U);
  EXPECT_EQ(verdict(bare, false, Wants::kData), 401U);
}

TEST(Access, ARefusalNeverSaysTheToken) {
  AccessOptions options;
  options.token = kToken;
  const Access access(options);
  Request request;
  request.host = kHost;
  request.authorization = "Bearer something-else";
  const auto refusal = access.refusal(request, Wants::kData);
  ASSERT_TRUE(refusal);
  EXPECT_EQ(refusal->body->find(kToken), std::string::npos);
  EXPECT_EQ(refusal->body->find("something-else"), std::string::npos);
}

TEST(Access, TokensAreEqualOrNot) {
  EXPECT_TRUE(equal_in_constant_time("", ""));
  EXPECT_TRUE(equal_in_constant_time("abc", "abc"));
  EXPECT_FALSE(equal_in_constant_time("abc", "abd"));
  EXPECT_FALSE(equal_in_constant_time("abc", "ab"));
}

}  // namespace
}  // namespace zerodrift::web
