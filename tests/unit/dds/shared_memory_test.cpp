// SPDX-License-Identifier: Apache-2.0
#include "common/dds/shared_memory.h"

#include <fastdds/rtps/builtin/data/ParticipantProxyData.h>
#include <fastdds/rtps/participant/ParticipantDiscoveryInfo.h>
#include <fcntl.h>
#include <gtest/gtest.h>
#include <sys/file.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "common/dds/dds_error.h"
#include "common/dds/discovery.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::dds {
namespace {

namespace fs = std::filesystem;

constexpr std::uint32_t kDomain = 0;  // ports 7400 to 7649

class SharedMemoryFolder : public ScratchFolder {
 protected:
  ~SharedMemoryFolder() override {
    for (const int lock : locks_) ::close(lock);
  }
  void put(const std::string& name) { std::ofstream(folder_ / name) << "x"; }
  // As its owner holds it while it lives.
  void hold(const std::string& name, int how = LOCK_EX) {
    put(name);
    locks_.push_back(::open((folder_ / name).c_str(), O_RDWR | O_CLOEXEC));
    ASSERT_EQ(::flock(locks_.back(), how), 0);
  }
  [[nodiscard]] std::set<std::string> files() const {
    std::set<std::string> names;
    for (const auto& entry : fs::directory_iterator(folder_))
      names.insert(entry.path().filename().string());
    return names;
  }
  [[nodiscard]] std::string refusal() const {
    try {
      check_shared_memory(kDomain, folder_);
    } catch (const DdsError& error) {
      return error.what();
    }
    return "no error";
  }
  std::vector<int> locks_;
};

TEST_F(SharedMemoryFolder, WhatTheDeadLeftIsRemovedAndNothingElse) {
  const std::set<std::string> living{
      "fastrtps_00000000000000aa", "fastrtps_00000000000000aa_el", "fastrtps_port7413",
      "fastrtps_port7413_el",      "sem.fastrtps_port7413_mutex",  "fastrtps_port7400",
      "fastrtps_port7400_sl",      "sem.fastrtps_port7400_mutex",  "somebody.else",
      "fastrtps_00000000000000cc"};  // without a lock: it may be just in the making
  for (const auto& name : living) {
    if (name.ends_with("_el")) {
      hold(name);
    } else if (name.ends_with("_sl")) {
      hold(name, LOCK_SH);
    } else {
      put(name);
    }
  }
  for (const char* dead :
       {"fastrtps_00000000000000bb", "fastrtps_00000000000000bb_el", "fastrtps_port7415",
        "fastrtps_port7415_el", "sem.fastrtps_port7415_mutex"})
    put(dead);
  EXPECT_EQ(remove_stale_segments(folder_), 5U);
  EXPECT_EQ(files(), living);
  EXPECT_EQ(remove_stale_segments(folder_), 0U);
}

TEST_F(SharedMemoryFolder, AFolderThatIsNotThereIsNotCleanedButRefused) {
  const fs::path nowhere = folder_ / "no";
  EXPECT_EQ(remove_stale_segments(nowhere), 0U);
  EXPECT_THROW(check_shared_memory(kDomain, nowhere), DdsError);
  EXPECT_THROW(SharedMemoryPlace::here(nowhere), DdsError);
}

TEST_F(SharedMemoryFolder, AnotherUsersPortOfThisDomainIsRefused) {
  if (::geteuid() != 0) GTEST_SKIP() << "only root can make another user's file";
  put("fastrtps_port7650");  // of domain 1
  put("fastrtps_00000000000000aa");
  for (const char* name : {"fastrtps_port7650", "fastrtps_00000000000000aa"})
    ASSERT_EQ(::chown((folder_ / name).c_str(), 4242, 4242), 0);
  EXPECT_EQ(refusal(), "no error");
  put("fastrtps_port7412");
  ASSERT_EQ(::chown((folder_ / "fastrtps_port7412").c_str(), 4242, 4242), 0);
  const std::string line = refusal();
  for (const char* part : {"fastrtps_port7412", "user 4242", "runs as 0", "--transport udp"})
    EXPECT_NE(line.find(part), std::string::npos) << line;
}

TEST(SharedMemoryPlace, IsToldAndUnderstood) {
  const SharedMemoryPlace here = SharedMemoryPlace::here("/");
  EXPECT_EQ(here.computer.size(), 36U);  // a UUID
  EXPECT_EQ(here.user, std::to_string(::geteuid()));
  EXPECT_EQ(SharedMemoryPlace::parse(here.text()).text(), here.text());
  EXPECT_EQ(why_not_shared(here, SharedMemoryPlace::parse(here.text()), "x"), "");
  for (const char* nonsense : {"", "/", "a", "a/b"})
    EXPECT_EQ(SharedMemoryPlace::parse(nonsense).text(), "//") << nonsense;
}

TEST(SharedMemoryPlace, NotSharedIsSaidWithTheRemedyUnlessItIsAnotherComputer) {
  const SharedMemoryPlace here{.computer = "c", .filesystem = "1", .user = "10001"};
  SharedMemoryPlace other = here;
  other.filesystem = "2";
  EXPECT_NE(why_not_shared(here, other, "peer").find("with peer: its /dev/shm is another"),
            std::string::npos);
  other.computer = "d";
  EXPECT_EQ(why_not_shared(here, other, "peer"), "");
  other = here;
  other.user = "0";
  EXPECT_NE(why_not_shared(here, other, "peer").find("runs as user 0, this one as 10001"),
            std::string::npos);
}

// As a participant is announced by the middleware.
TEST(SharedMemoryDiscovery, APeerWithAnotherFolderIsAnEventOfItsOwn) {
  namespace rtps = eprosima::fastrtps::rtps;
  const SharedMemoryPlace here{.computer = "c", .filesystem = "1", .user = "10001"};
  const auto kinds_after = [&](const std::string& place, bool uses_shared_memory) {
    detail::Discovery discovery;
    if (uses_shared_memory) discovery.set_shared_memory(here);
    rtps::ParticipantProxyData data{{}};
    data.m_participantName = "far";
    if (!place.empty()) data.m_properties.push_back({detail::kSharedMemoryProperty, place});
    rtps::ParticipantDiscoveryInfo info(data);
    info.status = rtps::ParticipantDiscoveryInfo::DISCOVERED_PARTICIPANT;
    discovery.on_participant_discovery(nullptr, std::move(info));
    std::vector<EndpointEvent> reported;
    discovery.report([&](const EndpointEvent& event) { reported.push_back(event); });
    return reported;
  };
  const auto reported = kinds_after("c/2/10001", true);
  ASSERT_EQ(reported.size(), 1U);
  EXPECT_EQ(reported[0].kind, EndpointEvent::Kind::kSharedMemoryNotShared);
  EXPECT_NE(reported[0].detail.find("far"), std::string::npos) << reported[0].detail;
  EXPECT_TRUE(kinds_after("c/1/10001", true).empty());
  EXPECT_TRUE(kinds_after("d/2/10001", true).empty());
  EXPECT_TRUE(kinds_after("", true).empty());            // it uses UDP alone
  EXPECT_TRUE(kinds_after("c/2/10001", false).empty());  // so does this one
}

}  // namespace
}  // namespace zerodrift::dds
