// SPDX-License-Identifier: Apache-2.0
// Names and permissions. Whole participants with keys are the system tests'
// (tests/system/security_test.cpp).
#include "common/dds/security.h"

#include <gtest/gtest.h>

#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "common/dds/topics.h"

namespace zerodrift::dds {
namespace {

TEST(SecurityIdentity, IsTheServiceOrTheCommandLine) {
  EXPECT_EQ(security_identity("compensation"), "compensation");
  EXPECT_EQ(security_identity("compensation/2"), "compensation");
  for (const char* name : {"recorder", "recorder_data", "replay", "diagnose", "zerodrift_ctl"})
    EXPECT_EQ(security_identity(name), "zerodrift") << name;
}

std::string certificates_script() {
  std::ifstream file(std::string(ZERODRIFT_SOURCE_DIR) + "/deploy/security/make_certificates.sh");
  std::ostringstream whole;
  whole << file.rdbuf();
  return whole.str();
}

// Rule: whoever the script makes a certificate for uses it.
TEST(SecurityIdentity, OfEachServiceOfTheScriptIsItsOwn) {
  const std::string script = certificates_script();
  const std::string before = "readonly services=\"";
  const std::size_t begin = script.find(before) + before.size();
  std::istringstream services(script.substr(begin, script.find('"', begin) - begin));
  std::size_t count = 0;
  for (std::string service; services >> service; ++count)
    EXPECT_EQ(security_identity(service), service);
  EXPECT_EQ(count, 7U);
}

// The words of a function of the script, `<name>() { ... }`.
std::set<std::string> words_of(const std::string& script, const std::string& name) {
  std::set<std::string> words;
  const auto begin = script.find('\n' + name + "() {");
  if (begin == std::string::npos) return words;
  std::istringstream text(script.substr(begin, script.find("\n}", begin) - begin));
  for (std::string word; text >> word;) words.insert(word);
  return words;
}

// Rule: a new topic gets its permissions, or security shuts it without a word here.
TEST(SecurityPermissions, NameAWriterAndAReaderForEveryTopic) {
  const std::string script = certificates_script();
  for (const TopicSpec& topic : kAllTopics) {
    const std::string name(topic.name);
    if (script.find("of_all=\"service_status event\"") != std::string::npos &&
        (name == kServiceStatus.name || name == kEvent.name)) {
      continue;
    }
    for (const char* table : {"writes", "reads"}) {
      EXPECT_TRUE(words_of(script, table).contains(name)) << table << ' ' << name;
    }
  }
}

}  // namespace
}  // namespace zerodrift::dds
