// SPDX-License-Identifier: Apache-2.0
#include "tests/system/system_under_test.h"

#include <gtest/gtest.h>
#include <signal.h>

#include <cstdio>
#include <cstdlib>
#include <limits>
#include <map>
#include <stdexcept>

#include "tests/system/files.h"

namespace zerodrift::system_test {
namespace {

std::uint32_t number_of(Domain domain) {
  if (domain > kLastDomain) throw std::logic_error("domains.h: this domain belongs to others");
  return static_cast<std::uint32_t>(domain);
}

std::filesystem::path make_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "zerodrift-system-XXXXXX").string();
  if (::mkdtemp(name.data()) == nullptr) throw std::runtime_error("cannot make " + name);
  return name;
}

}  // namespace

SystemUnderTest::SystemUnderTest(Domain domain)
    : domain_(number_of(domain)),
      segments_before_(shared_memory_segments()),
      folder_(make_folder()) {}

SystemUnderTest::~SystemUnderTest() {
  for (const auto& process : processes_) process->send(SIGTERM);
  if (::testing::Test::HasFailure()) {
    for (const auto& process : processes_) {
      process->wait(std::chrono::seconds(2));
      std::printf("---- %s\n%s%s", process->name().c_str(), process->out().c_str(),
                  process->err().c_str());
    }
  }
  processes_.clear();
  std::string left;  // what belongs to a test beside this one goes with it
  EXPECT_TRUE(eventually([&] {
    left.clear();
    for (const auto& name : shared_memory_segments()) {
      if (!segments_before_.contains(name)) left += ' ' + name;
    }
    return left.empty();
  })) << "left in /dev/shm:"
      << left;
  std::filesystem::remove_all(folder_);
}

ChildProcess& SystemUnderTest::start_foreign(const std::string& program, const Arguments& arguments,
                                             const Environment& environment) {
  const std::string name =
      std::to_string(processes_.size()) + "-" + std::filesystem::path(program).filename().string();
  processes_.push_back(std::make_unique<ChildProcess>(Program{
      std::filesystem::path(ZERODRIFT_BIN_DIR) / program, arguments, environment, path(name)}));
  return *processes_.back();
}

ChildProcess& SystemUnderTest::start(const std::string& program, const Arguments& arguments) {
  Arguments all = arguments;
  all.insert(all.end(), {"--domain", std::to_string(network().domain)});
  return start_foreign(program, all);
}

Finished SystemUnderTest::run(const std::string& program, const Arguments& arguments,
                              std::chrono::milliseconds at_most) {
  ChildProcess& process = start_foreign(program, arguments);
  const auto code = process.wait(at_most);
  if (!code) process.send(SIGKILL);
  return {code.value_or(-1), process.out(), process.err()};
}

Finished SystemUnderTest::control(const Arguments& arguments) {
  Arguments all{"ctl"};
  all.insert(all.end(), arguments.begin(), arguments.end());
  all.insert(all.end(), {"--domain", std::to_string(network().domain)});
  if (std::find(all.begin(), all.end(), "--wait") == all.end()) {
    all.insert(all.end(), {"--wait", "30"});  // a slow machine is no fault
  }
  return run("zerodrift", all);
}

bool told(const Collector<msg::Event>& events, const std::string& code, const std::string& text) {
  return events.any([&](const msg::Event& event) {
    return code == event.code().c_str() &&
           std::string(event.text().c_str()).find(text) != std::string::npos;
  });
}

double metric(const Collector<msg::ServiceStatus>& statuses, const std::string& service,
              const std::string& name) {
  double value = std::numeric_limits<double>::quiet_NaN();
  statuses.for_each([&](const msg::ServiceStatus& status) {
    if (service != status.service().c_str()) return;
    for (const auto& metric : status.metrics()) {
      if (name == metric.name().c_str()) value = metric.value();
    }
  });
  return value;
}

std::string newest_of_each(const Collector<msg::ServiceStatus>& statuses) {
  std::map<std::string, std::string> lines;
  statuses.for_each([&](const msg::ServiceStatus& status) {
    std::string& line = lines[status.service().c_str()];
    line = status.summary().c_str();
    for (const auto& metric : status.metrics())
      line += std::string(", ") + metric.name().c_str() + ' ' + std::to_string(metric.value());
  });
  std::string text;
  for (const auto& [service, line] : lines) text += service + ": " + line + '\n';
  return text;
}

}  // namespace zerodrift::system_test
