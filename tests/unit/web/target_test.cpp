// SPDX-License-Identifier: Apache-2.0
// What may be asked for, and addresses to listen at.
#include "common/web/target.h"

#include <gtest/gtest.h>

#include "common/web/address.h"
#include "common/web/web_error.h"

namespace zerodrift::web {
namespace {

TEST(Target, IsAPathAndNamedValuesBothDecoded) {
  const auto target = parse_target("/assets/a%20b.js?token=a%26b+c&x&token=second#part");
  ASSERT_TRUE(target);
  EXPECT_EQ(target->path, "/assets/a b.js");
  EXPECT_EQ(target->query.at("token"), "a&b+c");
  EXPECT_EQ(target->query.at("x"), "");
  EXPECT_EQ(target->query.size(), 2U);
}

TEST(TargetAbuse, NothingThatLeavesTheFolderIsAPathHoweverItIsWritten) {
  for (const char* target : {"/../etc/passwd",
                             "/a/../../b",
                             "/%2e%2e/etc/passwd",
                             "/a/%2E%2e/b",
                             "/..",
                             "/.",
                             "/a/./b",
                             "/..%2fetc",
                             "/a%2f..%2fb",
                             "//etc/passwd",
                             "/a//b",
                             "/%2fetc/passwd",
                             "/a\\..\\b",
                             "/%5c..%5cb",
                             "/a%00.js",
                             "/%0d%0aSet-Cookie:x",
                             "",
                             "a",
                             "*",
                             "http://host/a",
                             "/%",
                             "/%4",
                             "/%zz",
                             "/?a=%"}) {
    EXPECT_FALSE(parse_target(target)) << target;
  }
  EXPECT_FALSE(parse_target(std::string_view("/a\0b", 4)));
}

TEST(Target, DotsInANameAreAName) {
  for (const char* target : {"/...", "/a..b", "/.well-known/x", "/a.b/c"})
    EXPECT_TRUE(parse_target(target)) << target;
}

TEST(Address, ReadsWhatItWrites) {
  for (const char* text : {"127.0.0.1:8765", "0.0.0.0:80", "[::1]:8765", "[fe80::1]:65535"})
    EXPECT_EQ(parse_address(text).text(), text);
  EXPECT_EQ(parse_address("localhost:1").host, "127.0.0.1");
}

TEST(AddressAbuse, AnythingElseIsRefusedByOneLine) {
  for (const char* text : {"", ":", "8765", "127.0.0.1", "127.0.0.1:", "127.0.0.1:x",
                           "127.0.0.1:65536", "127.0.0.1:-1", "300.0.0.1:80", "::1:80", "[::1]",
                           "[127.0.0.1]:80", "host:80", "127.0.0.1:80 "})
    EXPECT_THROW(parse_address(text), WebError) << text;
}

TEST(Address, LoopbackIsWhatNobodyElseReaches) {
  for (const char* host : {"127.0.0.1", "127.1.2.3", "::1"}) EXPECT_TRUE(is_loopback(host)) << host;
  for (const char* host : {"0.0.0.0", "::", "192.168.0.1", "127.0.0.1.example.org", "127.", ""})
    EXPECT_FALSE(is_loopback(host)) << host;
}

}  // namespace
}  // namespace zerodrift::web
