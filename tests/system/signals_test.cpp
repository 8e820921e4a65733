// SPDX-License-Identifier: Apache-2.0
// Every program under what a supervisor, a terminal and a log's reader may do to it: a hang-up, and
// a standard error whose reader stalls, goes away, or never was. All programs share one run of each
// trouble.
#include <fcntl.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <vector>

#include "tests/support/other_terms.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

// A reader of the status that no writer suits, which every service then reports in its log.
using JealousStatus = dds::OnOtherTerms<msg::ServiceStatus, dds::with_exclusive_ownership>;

constexpr auto kStopsWithin = 2000ms;

// A pipe that the test alone could read.
class Pipe {
 public:
  explicit Pipe(const std::filesystem::path& path)
      : path_(path.string()), is_made_(::mkfifo(path_.c_str(), 0600) == 0) {
    if (!is_made_) throw std::runtime_error("no pipe " + path_);
    reader_ = ::open(path_.c_str(), O_RDONLY | O_NONBLOCK | O_CLOEXEC);
    writer_ = ::open(path_.c_str(), O_WRONLY | O_NONBLOCK | O_CLOEXEC);
  }
  ~Pipe() {
    close_reader();
    ::close(writer_);
  }
  Pipe(const Pipe&) = delete;
  Pipe& operator=(const Pipe&) = delete;

  void fill() const {
    const std::array<char, 4096> block{};
    while (::write(writer_, block.data(), block.size()) > 0) {
    }
  }
  void close_reader() {
    if (reader_ >= 0) ::close(reader_);
    reader_ = -1;
  }
  [[nodiscard]] const std::string& path() const { return path_; }

 private:
  std::string path_;
  bool is_made_;
  int reader_ = -1;
  int writer_ = -1;
};

struct Service {
  std::string name;  // in its status
  std::string program;
  Arguments arguments;
};

class EveryProgram : public ::testing::Test {
 protected:
  EveryProgram() : system(Domain::kSignals), participant_("test", system.network()) {
    const Arguments source = Arguments{"--source", "simulation"} +
                             Simulation{.profile = write_ramp_profile(system, 3600)}.arguments();
    // No port of this domain's participants.
    const std::uint32_t port = 7400 + 250 * system.network().domain + 240;
    services_ = {{"compensation", "compensation", {}},
                 {"allan_monitor", "allan_monitor", {}},
                 {"navigation_filter", "navigation_filter", {"--latitude", "48"}},
                 {"discovery_server",
                  "discovery_server",
                  {"--discovery-server", "127.0.0.1:" + std::to_string(port)}},
                 {"console", "console", {"--listen", "127.0.0.1:" + std::to_string(port)}},
                 {"gyro_publisher", "gyro_publisher", source + Arguments{"--free-running"}},
                 {"thermal_publisher", "thermal_publisher", source},
                 {"recorder", "zerodrift", {"record", "--out", system.path("out.mcap")}}};
  }

  // `redirection` is the shell's.
  void start_all(const std::string& redirection) {
    for (const Service& service : services_) {
      const std::string program =
          (std::filesystem::path(ZERODRIFT_BIN_DIR) / service.program).string();
      processes_.push_back(&system.start_foreign(
          "/bin/sh", Arguments{"-c", "exec \"$0\" \"$@\" " + redirection, program} +
                         service.arguments +
                         Arguments{"--domain", std::to_string(system.network().domain)}));
    }
  }
  // A discovery server is in no domain: nobody hears it here.
  [[nodiscard]] static bool is_received(const Service& service) {
    return service.name != "discovery_server";
  }
  [[nodiscard]] bool each(const std::function<bool(const Service&)>& is_so) const {
    return eventually([&] {
      return std::all_of(services_.begin(), services_.end(), [&](const Service& service) {
        return !is_received(service) || is_so(service);
      });
    });
  }
  [[nodiscard]] bool all_are_up() const {
    return each([&](const Service& service) { return !std::isnan(uptime_ms(service)); });
  }
  [[nodiscard]] double uptime_ms(const Service& service) const {
    double newest = std::numeric_limits<double>::quiet_NaN();
    statuses_.for_each([&](const msg::ServiceStatus& status) {
      if (service.name == status.service().c_str())
        newest = static_cast<double>(status.uptime_ms());
    });
    return newest;
  }
  // Has each service write into its log, and sees that it goes on.
  void provoke() {
    const Collector<msg::Event> events(participant_);
    dds::Participant jealous("jealous", system.network());
    const dds::Reader<JealousStatus> reader(jealous,
                                            [](const JealousStatus&, const dds::SampleOrigin&) {});
    EXPECT_TRUE(each([&](const Service& service) {
      return events.any([&](const msg::Event& event) {
        return service.name == event.service().c_str() &&
               std::string(event.code().c_str()) == "incompatible_qos";
      });
    }));
    std::map<std::string, double> before;
    for (const Service& service : services_) before[service.name] = uptime_ms(service);
    EXPECT_TRUE(each([&](const Service& service) {
      return uptime_ms(service) > before[service.name] + 500.0;
    })) << newest_of_each(statuses_);
  }
  void expect_all_end(int signal) {
    for (ChildProcess* process : processes_) {
      EXPECT_TRUE(process->running()) << process->name();
      process->send(signal);
    }
    for (std::size_t k = 0; k < processes_.size(); ++k)
      EXPECT_EQ(processes_[k]->wait(kStopsWithin), 0) << services_[k].name;
  }

  SystemUnderTest system;

 private:
  dds::Participant participant_;
  Collector<msg::ServiceStatus> statuses_{participant_};
  std::vector<Service> services_;
  std::vector<ChildProcess*> processes_;
};

TEST_F(EveryProgram, EndsInOrderWhenItsTerminalHangsUp) {
  start_all("");
  ASSERT_TRUE(all_are_up());
  expect_all_end(SIGHUP);
}

TEST_F(EveryProgram, OutlivesTheReaderOfItsLog) {
  Pipe pipe(system.path("log"));
  start_all("2>'" + pipe.path() + "'");
  ASSERT_TRUE(all_are_up());
  pipe.close_reader();
  provoke();
  expect_all_end(SIGTERM);
}

TEST_F(EveryProgram, WaitsForNoReaderOfItsLogAndEndsAllTheSame) {
  const Pipe pipe(system.path("log"));
  pipe.fill();
  start_all("2>'" + pipe.path() + "'");
  ASSERT_TRUE(all_are_up());
  provoke();
  expect_all_end(SIGTERM);
}

TEST_F(EveryProgram, RunsWithItsStandardDescriptorsClosed) {
  start_all("0<&- 1>&- 2>&-");
  ASSERT_TRUE(all_are_up());
  provoke();
  expect_all_end(SIGTERM);
}

}  // namespace
}  // namespace zerodrift::system_test
