// SPDX-License-Identifier: Apache-2.0
// Names, permissions and files. Whole participants with keys are the system tests'
// (tests/system/security_test.cpp).
#include "common/dds/security.h"

#include <gtest/gtest.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <string>

#include "common/dds/participant.h"
#include "common/dds/topics.h"
#include "tests/support/scratch_folder.h"

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

class SecurityFolder : public ScratchFolder {
 protected:
  using Clock = std::chrono::system_clock;

  void make(const std::string& arguments) const {
    const std::string call = std::string(ZERODRIFT_SOURCE_DIR) +
                             "/deploy/security/make_certificates.sh " + arguments + ' ' +
                             security().string() + " > " + (folder_ / "said").string();
    ASSERT_EQ(std::system(call.c_str()), 0) << call;
  }
  // Why the files of the compensation are refused; empty: they aren't.
  [[nodiscard]] std::string refusal(std::uint32_t domain, Clock::time_point now) const {
    try {
      static_cast<void>(find_security_files(security(), "compensation", domain, now));
    } catch (const DdsError& error) {
      return error.what();
    }
    return "";
  }
  [[nodiscard]] std::filesystem::path security() const { return folder_ / "security"; }
  [[nodiscard]] std::string of(const std::string& file) const {
    return "security: " + (security() / file).string() + ' ';
  }
};

std::string utc(std::chrono::system_clock::time_point time) {
  const std::time_t seconds = std::chrono::system_clock::to_time_t(time);
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  std::array<char, 32> text{};
  std::strftime(text.data(), text.size(), "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text.data();
}

// Rule: what is made now is valid on a computer whose clock is behind by hours. Before: the
// permissions alone were, and the line named the day that both clocks said.
TEST_F(SecurityFolder, CountsFromADayAgoAndALineSaysWhatTheClockSays) {
  using std::chrono::hours;
  const auto before = Clock::now();
  make("--days 2");
  const auto after = Clock::now();
  EXPECT_EQ(refusal(0, before - hours(24) + (after - before) + std::chrono::seconds(1)), "");
  EXPECT_EQ(refusal(0, before + hours(47)), "");

  const auto early = before - hours(25);
  const std::string too_early = refusal(0, early);
  EXPECT_TRUE(too_early.starts_with(of("compensation/certificate.pem") + "is not valid before " +
                                    utc(before - hours(24)).substr(0, 11)))
      << too_early;
  EXPECT_TRUE(too_early.ends_with("Z; this computer's clock says " + utc(early))) << too_early;
  const auto late = after + hours(49);
  const std::string too_late = refusal(0, late);
  EXPECT_TRUE(too_late.starts_with(of("compensation/certificate.pem") + "has expired on "))
      << too_late;
  EXPECT_TRUE(too_late.ends_with("Z; this computer's clock says " + utc(late))) << too_late;
}

TEST_F(SecurityFolder, IsForItsDomainsAlone) {
  make("--domains 5-7");
  const auto now = Clock::now();
  EXPECT_EQ(refusal(5, now), "");
  EXPECT_EQ(refusal(7, now), "");
  EXPECT_EQ(refusal(74, now), of("governance.p7s") + "is for domains 5 to 7, found domain 74");
  // Renewed without --domains: those of the governance. Before: all.
  make("--only compensation");
  EXPECT_EQ(refusal(5, now), "");
  make("--only compensation --domains 6-6");
  EXPECT_EQ(refusal(6, now), "");
  EXPECT_EQ(refusal(5, now),
            of("compensation/permissions.p7s") + "is for domains 6 to 6, found domain 5");
  std::filesystem::copy_file(security() / "compensation/permissions.p7s",
                             security() / "governance.p7s",
                             std::filesystem::copy_options::overwrite_existing);
  make("--only compensation");
  EXPECT_EQ(refusal(6, now), "") << "of the governance that is there";
}

TEST_F(SecurityFolder, MayBeForDomainZeroAlone) {
  make("--domains 0-0");
  EXPECT_EQ(refusal(0, Clock::now()), "");
  EXPECT_NE(refusal(1, Clock::now()), "");
}

}  // namespace
}  // namespace zerodrift::dds
