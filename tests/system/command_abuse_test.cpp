// SPDX-License-Identifier: Apache-2.0
// Commands as anybody in the domain may write them: what they name, and what their texts do to the
// answer, the event and the log. The kinds of files and names are tried one by one in tests/unit
// (named_file_test.cpp, command_files_test.cpp).
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <string>

#include "common/core/one_line.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
namespace fs = std::filesystem;

class CommandAbuse : public ::testing::Test {
 protected:
  CommandAbuse() {
    for (const char* folder : {"models", "checkpoints"}) fs::create_directory(system.path(folder));
    write(system.path("key.pem"), "-----BEGIN EC PRIVATE KEY-----\nsecret\n");
    write(system.path("models/key.yaml"), "secret: -----BEGIN EC PRIVATE KEY-----\n");
    fs::create_symlink("../key.pem", system.path("models/link.yaml"));
    fs::create_symlink("/dev/zero", system.path("checkpoints/1-zero.ckpt"));
    fs::create_symlink("../key.pem", system.path("checkpoints/1-key.ckpt"));
    service_ = &system.start("compensation", {"--model-dir", system.path("models"),
                                              "--checkpoint-dir", system.path("checkpoints")});
    system.start("gyro_publisher",
                 Arguments{"--source", "simulation", "--rate", "100", "--free-running"} +
                     Simulation{.profile = write_ramp_profile(system, 3600)}.arguments());
  }
  // The answer's text.
  std::string send(const std::string& name, const std::string& argument) {
    msg::Command command;
    command.service("compensation");
    command.name(name.c_str());
    command.argument(argument.c_str());
    command.issuer("\x1b]0;test\n");
    command.request_id(++last_id_);
    const auto is_it = [&](const auto& reply) { return reply.request_id() == last_id_; };
    EXPECT_TRUE(eventually([&] {
      writer_.write(command);
      return replies_.any(is_it);
    })) << name;
    std::string text;
    replies_.for_each([&](const msg::CommandReply& reply) {
      if (is_it(reply)) text = reply.text().c_str();
    });
    return text;
  }

  SystemUnderTest system{Domain::kCommandAbuse};
  dds::Participant participant_{"test", system.network()};
  Collector<msg::Event> events_{participant_};
  Collector<msg::CompensatedRate> answers_{participant_};
  ChildProcess* service_ = nullptr;

 private:
  Collector<msg::CommandReply> replies_{participant_};
  dds::Writer<msg::Command> writer_{participant_};
  std::uint64_t last_id_ = 0;
};

// Rule: neither answer, event nor log quotes a file, and each is one clean line, whatever is sent.
TEST_F(CommandAbuse, ReadsNoForeignFileAndForgesNoLine) {
  ASSERT_TRUE(eventually([&] { return answers_.size() > 0; }));
  const std::string key = system.path("key.pem").string();
  for (const std::string& argument :
       {key, "1:" + key, std::string("../key.pem"), std::string("key.yaml"),
        std::string("link.yaml"), std::string("/etc/passwd"), std::string("/dev/zero"),
        std::string("a\nb\x1b[2J"), std::string(255, 'a'), std::string()}) {
    const std::string text = send("adopt", argument);
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
    EXPECT_EQ(text.find("BEGIN"), std::string::npos) << text;
    EXPECT_EQ(text.find("root:"), std::string::npos) << text;
    EXPECT_TRUE(core::is_one_line(text)) << text;
    EXPECT_EQ(text.find("adopted"), std::string::npos) << text;
  }
  for (const char* argument : {"zero", "key", "../1-zero", "\n"}) {
    const std::string text = send("restore", argument);
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
    EXPECT_EQ(text.find("restored"), std::string::npos) << text;
  }
  EXPECT_NE(send("freeze", "").find("frozen"), std::string::npos);
  send("x\n2026-01-01T00:00:00 error", "");
  ASSERT_TRUE(eventually(
      [&] { return told(events_, "command_x 2026-01-01T00:00:00 error", "unknown command"); }));
  events_.for_each([](const msg::Event& event) {
    const std::string text = event.text().c_str();
    EXPECT_EQ(text.find("secret"), std::string::npos) << text;
    EXPECT_EQ(text.find("root:"), std::string::npos) << text;
  });
  service_->send(SIGTERM);
  ASSERT_EQ(service_->wait(2s), 0);
  const std::string log = service_->err();
  EXPECT_NE(log.find("command_adopt"), std::string::npos);
  EXPECT_EQ(log.find("secret"), std::string::npos) << log;
  EXPECT_EQ(log.find("root:"), std::string::npos) << log;
  std::string lines = log;
  std::replace(lines.begin(), lines.end(), '\n', ' ');
  EXPECT_TRUE(core::is_one_line(lines)) << log;
  EXPECT_EQ(log.find("\n2026-01-01"), std::string::npos) << log;
}

}  // namespace
}  // namespace zerodrift::system_test
