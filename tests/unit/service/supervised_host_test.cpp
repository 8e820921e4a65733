// SPDX-License-Identifier: Apache-2.0
// A host that is watched: what it tells a supervisor, when it ends by itself, and that a command's
// answer arrives although its sender was matched late.
#include <gtest/gtest.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "common/service/command_server.h"
#include "common/service/exit_code.h"
#include "common/service/host.h"
#include "common/service/monotonic_clock.h"
#include "tests/unit/dds/test_domain.h"

namespace zerodrift::service {
namespace {

using dds::eventually;
using dds::TestDomain;
namespace fs = std::filesystem;

constexpr std::uint32_t kDomain = 109;

// Before any thread of this process, as a service does.
class StopSignals : public testing::Environment {
 public:
  void SetUp() override { take_signals(); }
};
const testing::Environment* const kStopSignals = testing::AddGlobalTestEnvironment(new StopSignals);

class Folder {
 public:
  Folder() {
    std::string name = (fs::temp_directory_path() / "zerodrift-host-XXXXXX").string();
    if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
    path_ = name;
  }
  ~Folder() { fs::remove_all(path_); }
  [[nodiscard]] fs::path operator/(const char* name) const { return path_ / name; }

 private:
  fs::path path_;
};

Status of_flow(std::uint64_t samples) {
  return {.state = State::kRunning,
          .summary = "well",
          .metrics = {},
          .flow = Flow{.topic = "angular_rate", .samples = samples}};
}

TEST(SupervisedHost, WithoutAnybodyItEndsWithOne) {
  const TestDomain domain(kDomain);
  Host host("alone", domain.network(), {.peer_within_s = 0.2});
  EXPECT_EQ(host.run([] { return of_flow(0); }), kExitNo);
}

TEST(SupervisedHost, WithSomebodyAtTheOtherEndItGoesOn) {
  const TestDomain domain(kDomain);
  dds::Participant other("other", domain.network());
  const dds::Writer<msg::AngularRate> writer(other);
  Host host("met", domain.network(), {.peer_within_s = 0.2});
  const dds::Reader<msg::AngularRate> reader(host.participant(),
                                             [](const msg::AngularRate&, const auto&) {});
  ASSERT_TRUE(eventually([&] { return reader.matched() > 0; }));
  int ticks = 0;
  EXPECT_EQ(host.run([] { return of_flow(0); },
                     [&] {
                       if (++ticks == 4) request_stop();  // a second, five times the limit
                     }),
            kExitDone);
}

// The main loop goes on all the while.
TEST(SupervisedHost, AReceivingThreadThatNeverComesBackIsNotHealthy) {
  const TestDomain domain(kDomain);
  const Folder folder;
  dds::Participant other("other", domain.network());
  dds::Writer<msg::AngularRate> writer(other);
  std::atomic<bool> hangs{true};
  Host host("hanging", domain.network(), {.health_file = folder / "health"});
  const dds::Reader<msg::AngularRate> reader(
      host.participant(), [&](const msg::AngularRate&, const auto&) {
        while (hangs) std::this_thread::sleep_for(std::chrono::milliseconds(1));
      });
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0 && reader.matched() > 0; }));
  const auto why = [&] {
    return why_unhealthy(read_health(folder / "health"), monotonic_ns(), std::chrono::hours(1));
  };
  msg::AngularRate sample;
  ASSERT_TRUE(writer.write(sample));
  std::string said;
  bool stopped = false;
  EXPECT_EQ(host.run([] { return of_flow(0); },
                     [&] {
                       if (hangs) {
                         said = why();
                         if (!said.empty()) hangs = false;
                       } else if (why().empty() && !std::exchange(stopped, true)) {
                         request_stop();
                       }
                     }),
            kExitDone);
  EXPECT_NE(said.find("receiving thread"), std::string::npos) << said;
}

// Told and degraded; ends only where that was asked for.
TEST(SupervisedHost, AStaleFlowIsToldAndEndsItIfAskedTo) {
  const TestDomain domain(kDomain);
  dds::Participant other("other", domain.network());
  const dds::Writer<msg::AngularRate> writer(other);
  std::mutex mutex;
  std::vector<msg::ServiceStatus> statuses;
  const dds::Reader<msg::ServiceStatus> heard(other, [&](const msg::ServiceStatus& m, const auto&) {
    const std::lock_guard lock(mutex);
    statuses.push_back(m);
  });
  for (const bool ends : {false, true}) {
    Host host("stale", domain.network(), {.stale_after_s = 0.3, .exit_when_stale = ends});
    const dds::Reader<msg::AngularRate> reader(host.participant(),
                                               [](const msg::AngularRate&, const auto&) {});
    ASSERT_TRUE(eventually([&] { return reader.matched() > 0; }));
    int ticks = 0;
    const int exit_code = host.run([] { return of_flow(5); },
                                   [&] {
                                     if (++ticks == 20) request_stop();
                                   });
    EXPECT_EQ(exit_code, ends ? kExitNo : kExitDone);
    EXPECT_EQ(ticks >= 20, !ends);
    // Only who was asked to end says that it stops.
    const auto last = static_cast<std::uint32_t>(ends ? State::kDegraded : State::kStopping);
    EXPECT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return !statuses.empty() && statuses.back().state() == last;
    })) << ends;
  }
  const std::lock_guard lock(mutex);
  EXPECT_TRUE(std::any_of(statuses.begin(), statuses.end(), [](const auto& status) {
    return status.state() == static_cast<std::uint32_t>(State::kDegraded) &&
           status.summary().to_string().find("no angular_rate for") != std::string::npos;
  }));
}

TEST(SupervisedHost, ItsHealthFileFollowsIt) {
  const TestDomain domain(kDomain);
  const Folder folder;
  const fs::path file = folder / "health";
  Host host("healthy", domain.network(), {.health_file = file});
  EXPECT_EQ(read_health(file).state, "starting");
  int ticks = 0;
  host.run([] { return of_flow(0); },
           [&] {
             if (++ticks == 7) {  // more than a second: it was written again
               EXPECT_EQ(read_health(file).state, "running");
               EXPECT_EQ(read_health(file).summary, "well");
               EXPECT_EQ(read_health(file).process_id, ::getpid());
               EXPECT_LE(read_health(file).monotonic_ns, monotonic_ns());
               request_stop();
             }
           });
  EXPECT_EQ(read_health(file).state, "stopping");
}

TEST(SupervisedHost, AHealthFileThatCannotBeWrittenIsRefusedAtOnce) {
  const TestDomain domain(kDomain);
  const Folder folder;
  EXPECT_THROW(Host("unhealthy", domain.network(), {.health_file = folder / "no/health"}),
               std::runtime_error);
}

// What systemd would hear (sd_notify(3)).
TEST(SupervisedHost, SaysWhenItIsReadyThatItLivesAndThatItStops) {
  const TestDomain domain(kDomain);
  const Folder folder;
  const std::string path = (folder / "notify").string();
  const int socket = ::socket(AF_UNIX, SOCK_DGRAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  ASSERT_GE(socket, 0);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  path.copy(address.sun_path, sizeof address.sun_path - 1);
  ASSERT_EQ(::bind(socket, reinterpret_cast<const sockaddr*>(&address), sizeof address), 0);
  ::setenv("NOTIFY_SOCKET", path.c_str(), 1);
  {
    Host host("notifying", domain.network());
    int ticks = 0;
    host.run([] { return of_flow(0); },
             [&] {
               if (++ticks == 3) request_stop();
             });
  }
  ::unsetenv("NOTIFY_SOCKET");
  std::vector<std::string> heard;
  std::array<char, 512> buffer{};
  for (ssize_t size = 0; (size = ::recv(socket, buffer.data(), buffer.size(), 0)) > 0;)
    heard.emplace_back(buffer.data(), static_cast<std::size_t>(size));
  ::close(socket);
  ASSERT_GE(heard.size(), 3U);
  EXPECT_EQ(heard.front(), "READY=1\nWATCHDOG=1\nSTATUS=running: well");
  EXPECT_EQ(heard[1], "WATCHDOG=1\nSTATUS=running: well");
  EXPECT_EQ(heard.back().rfind("STOPPING=1\n", 0), 0U) << heard.back();
}

// Its sender hears answers only after the command was obeyed: obeyed once, and answered again.
TEST(CommandServer, RepeatsItsAnswerToACommandThatIsRepeated) {
  const TestDomain domain(kDomain);
  Host host("obedient", domain.network());
  std::atomic<int> obeyed{0};
  CommandServer server(host, [&](const msg::Command&) -> CommandVerdict {
    ++obeyed;
    return {.outcome = CommandVerdict::Outcome::kAccepted, .text = "done"};
  });
  dds::Participant commander("commander", domain.network());
  dds::Writer<msg::Command> writer(commander);
  ASSERT_TRUE(eventually([&] { return writer.matched() > 0; }));
  msg::Command command;
  command.service("obedient");
  command.name("inject");
  command.issuer("test");
  command.request_id(7);
  writer.write(command);
  ASSERT_TRUE(eventually([&] { return obeyed == 1; }));
  std::atomic<int> answers{0};
  const dds::Reader<msg::CommandReply> reader(commander,
                                              [&](const msg::CommandReply& reply, const auto&) {
                                                EXPECT_EQ(reply.request_id(), 7U);
                                                EXPECT_EQ(reply.accepted(), 1U);
                                                EXPECT_EQ(reply.text().to_string(), "done");
                                                ++answers;
                                              });
  EXPECT_TRUE(eventually([&] {
    if (answers > 0) return true;
    writer.write(command);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
    return false;
  }));
  EXPECT_EQ(obeyed, 1);
}

}  // namespace
}  // namespace zerodrift::service
