// SPDX-License-Identifier: Apache-2.0
// What was learned outlives the process that learned it; a bad checkpoint changes nothing.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "common/core/mode.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;

constexpr auto kStack = static_cast<std::uint8_t>(core::Rung::kStack);

bool is_on_model(const msg::CompensatedRate& answer) {
  return std::all_of(answer.rung().begin(), answer.rung().end(),
                     [](std::uint8_t rung) { return rung == kStack; });
}

std::size_t times_of(const std::string& text, const std::string& what) {
  std::size_t times = 0;
  for (auto at = text.find(what); at != std::string::npos; at = text.find(what, at + 1)) ++times;
  return times;
}

// A simulation at 20 times real time, compensated by a service that may be started again.
class RestartedRun {
 public:
  explicit RestartedRun(Arguments compensation = {}, const Arguments& folders = {})
      : system(Domain::kCheckpoint),
        participant_("test", system.network()),
        arguments_(std::move(compensation)),
        answers(participant_) {
    Arguments source{"--source", "simulation", "--speed", "20"};
    for (const auto& argument :
         Simulation{.profile = write_ramp_profile(system, 100000)}.arguments()) {
      source.push_back(argument);
    }
    std::filesystem::create_directory(folder());
    for (const std::string& name : folders) std::filesystem::create_directory(folder() / name);
    start_compensation();
    system.start("thermal_publisher", source);
    source.insert(source.end(), {"--rate", "50"});
    system.start("gyro_publisher", source);
  }

  [[nodiscard]] std::filesystem::path folder() const { return system.path("checkpoints"); }

  void start_compensation() {
    compensation_ = &system.start("compensation",
                                  Arguments{"--checkpoint-dir", folder().string()} + arguments_);
  }
  void stop_compensation() {
    compensation_->send(SIGTERM);
    ASSERT_EQ(compensation_->wait(2s), 0);
  }

  [[nodiscard]] std::string log() const { return compensation_->err(); }
  [[nodiscard]] bool comes(std::size_t from,
                           const std::function<bool(const msg::CompensatedRate&)>& is_so) const {
    return eventually([&] { return answers.any(is_so, from); });
  }

  SystemUnderTest system;

 private:
  dds::Participant participant_;
  Arguments arguments_;
  ChildProcess* compensation_ = nullptr;

 public:
  Collector<msg::CompensatedRate> answers;
};

// Rule: after a restart and `ctl restore` the restored model compensates as soon as the temperature
// rate is known again (60 s), and the epoch goes on counting, which tells it from one learned anew:
// a stack is in force with its second label.
TEST(Checkpoint, OutlivesARestartOfTheService) {
  RestartedRun run;
  ASSERT_TRUE(run.comes(
      0, [](const auto& answer) { return is_on_model(answer) && answer.model_epoch() > 15; }));
  const Finished saved = run.system.control({"checkpoint"});
  ASSERT_EQ(saved.exit_code, 0) << saved.out << saved.err;
  EXPECT_NE(saved.out.find("saved 1-saved.ckpt"), std::string::npos) << saved.out;
  ASSERT_TRUE(std::filesystem::exists(run.folder() / "1-saved.ckpt"));
  const std::uint64_t saved_epoch = run.answers.newest().model_epoch();
  ASSERT_GT(saved_epoch, 10U);

  run.stop_compensation();
  const std::size_t stopped = run.answers.size();
  run.start_compensation();
  ASSERT_TRUE(run.comes(stopped, [](const auto&) { return true; }));
  const Finished restored = run.system.control({"restore"});
  ASSERT_EQ(restored.exit_code, 0) << restored.out << restored.err;
  EXPECT_NE(restored.out.find("restored"), std::string::npos) << restored.out;

  // The epoch that was saved may be some labels older than the last one seen.
  const auto is_restored = [&](const auto& answer) {
    return answer.model_epoch() + 5 > saved_epoch;
  };
  ASSERT_TRUE(run.comes(stopped, is_restored));
  const std::size_t since = run.answers.first(is_restored, stopped).value_or(0);
  ASSERT_TRUE(run.comes(since, is_on_model));
  const auto all = run.answers.all();
  const std::size_t on_model = run.answers.first(is_on_model, since).value_or(0);
  const auto apart_s = [&](std::size_t from, std::size_t to) {
    return 1e-9 * static_cast<double>(all[to].sensor_time_ns() - all[from].sensor_time_ns());
  };
  // Two seconds for blocks and readings that straddle the minute.
  EXPECT_LT(apart_s(stopped, on_model), std::max(62.0, apart_s(stopped, since) + 2.0));
  // Before, the last stationary minute of the saved model held: never nothing.
  for (std::size_t k = since; k < on_model; ++k) ASSERT_NE(all[k].rung()[0], 0) << k;
}

// Rule: what can't be restored is refused with the reason, and the model at work goes on.
TEST(Checkpoint, ABadOneIsRefusedAndTheModelGoesOn) {
  RestartedRun run;
  ASSERT_TRUE(run.comes(0, is_on_model));
  ASSERT_EQ(run.system.control({"checkpoint", "good"}).exit_code, 0);
  std::string bytes = content(run.folder() / "1-good.ckpt");
  ASSERT_GT(bytes.size(), 1000U);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] ^ 1);
  write(run.folder() / "1-flipped.ckpt", bytes);
  write(run.folder() / "1-cut.ckpt", bytes.substr(0, 500));

  const std::size_t from = run.answers.size();
  const std::uint64_t epoch = run.answers.newest().model_epoch();
  for (const auto& [name, reason] :
       {std::pair{"flipped", "is damaged"}, std::pair{"cut", "truncated"},
        std::pair{"none", "no such file"}, std::pair{"../1-good", "found name '../1-good'"}}) {
    const Finished refused = run.system.control({"restore", name});
    EXPECT_EQ(refused.exit_code, 1) << name;
    EXPECT_NE(refused.out.find(reason), std::string::npos) << refused.out;
  }
  EXPECT_EQ(run.system.control({"checkpoint", "a/b"}).exit_code, 1);
  EXPECT_EQ(run.system.control({"checkpoint", "latest"}).exit_code, 1);
  ASSERT_TRUE(
      run.comes(from, [&](const auto& answer) { return answer.model_epoch() > epoch + 3; }));
  const auto all = run.answers.all();
  for (std::size_t k = from; k < all.size(); ++k) {
    ASSERT_NE(all[k].rung()[0], 0) << k;
    ASSERT_GE(all[k].model_epoch(), all[k - 1].model_epoch()) << k;
  }

  const Finished restored = run.system.control({"restore", "good"});
  EXPECT_EQ(restored.exit_code, 0) << restored.out;
  EXPECT_NE(restored.out.find("model epoch"), std::string::npos) << restored.out;
}

// Rule: what was saved by command is still there when the service has saved itself again. Before:
// both had one name, so that `checkpoint`, `reset`, a minute and `restore` gave nothing back.
TEST(Checkpoint, WhatWasSavedByCommandOutlivesWhatTheServiceSavesOfItself) {
  RestartedRun run({"--checkpoint-period", "1"});
  ASSERT_TRUE(run.comes(0, is_on_model));
  ASSERT_EQ(run.system.control({"checkpoint"}).exit_code, 0);
  const auto saved = run.folder() / "1-saved.ckpt";
  const auto latest = run.folder() / "1-latest.ckpt";
  const std::string bytes = content(saved);
  ASSERT_EQ(run.system.control({"reset"}).exit_code, 0);
  const std::string before = std::filesystem::exists(latest) ? content(latest) : "";
  ASSERT_TRUE(eventually(
      [&] { return std::filesystem::exists(latest) && content(latest) != before; }, 30s));
  EXPECT_EQ(content(saved), bytes);
  const Finished restored = run.system.control({"restore"});
  EXPECT_NE(restored.out.find("1-saved.ckpt"), std::string::npos) << restored.out;
}

// Rule: a command is saved at once, whatever the period. Before: what was forgotten by command was
// there again where the process ended within a minute.
TEST(Checkpoint, WhatWasForgottenByCommandStaysForgottenWhereTheProcessEnds) {
  RestartedRun run({"--checkpoint-period", "24h"});
  ASSERT_TRUE(run.comes(0, is_on_model));
  const auto latest = run.folder() / "1-latest.ckpt";
  ASSERT_TRUE(eventually([&] { return std::filesystem::exists(latest); }));
  const std::string before = content(latest);
  ASSERT_EQ(run.system.control({"reset"}).exit_code, 0);
  EXPECT_TRUE(eventually([&] { return content(latest) != before; }));
}

// Rule: what could not be saved of itself is told once, tried again although nothing changed since,
// and told again when it is saved; each time, in the log, too. Before: the log had the first time
// alone, so that its last line said the opposite of what was so.
TEST(Checkpoint, OneThatFailsIsTriedAgainUntilItIsSaved) {
  RestartedRun run({"--checkpoint-period", "1"}, {"1-latest.ckpt"});  // a folder takes its name
  dds::Participant participant("test", run.system.network());
  const Collector<msg::Event> events(participant);
  const auto file = run.folder() / "1-latest.ckpt";
  const auto comes = [&](const std::string& code, const std::string& text, std::size_t times) {
    return eventually([&] { return times_of(run.log(), code + ": gyro 1: ") == times; }) &&
           eventually([&] { return told(events, code, text); });
  };
  ASSERT_TRUE(comes("checkpoint_failed", "is a folder", 1)) << run.log();
  std::filesystem::remove(file);
  ASSERT_TRUE(comes("checkpoint_saved", "saved again", 1)) << run.log();
  std::error_code exists;
  ASSERT_TRUE(eventually([&] {
    std::filesystem::remove(file);
    return std::filesystem::create_directory(file, exists);
  }));
  ASSERT_TRUE(comes("checkpoint_failed", "is a folder", 2)) << run.log();
  ASSERT_EQ(run.system.control({"freeze"}).exit_code, 0);
  std::filesystem::remove(file);
  EXPECT_TRUE(comes("checkpoint_saved", "saved again", 2)) << run.log();
  EXPECT_TRUE(std::filesystem::is_regular_file(file));
}

TEST(Checkpoint, WithoutAFolderTheServiceSaysHowToEnableIt) {
  SystemUnderTest system(Domain::kCheckpoint);
  system.start("compensation", {});
  for (const char* command : {"checkpoint", "restore"}) {
    const Finished refused = system.control({command});
    EXPECT_EQ(refused.exit_code, 1);
    EXPECT_NE(refused.out.find("--checkpoint-dir"), std::string::npos) << refused.out;
  }
  EXPECT_EQ(system.run("compensation", {"--checkpoint-dir", "/no/such/folder"}).exit_code, 2);
  const Finished unwritable = system.run("compensation", {"--checkpoint-dir", "/proc"});
  EXPECT_EQ(unwritable.exit_code, 2);
  EXPECT_NE(unwritable.err.find("--checkpoint-dir: found '/proc', in which no file can be created"),
            std::string::npos)
      << unwritable.err;
}

// Rule: a record that goes on where what a checkpoint knows ended is compensated as if the gyro had
// been off between the two where that is said, and only there.
TEST(Checkpoint, OfflineAGyroWasOffWhereThatIsSaid) {
  SystemUnderTest system(Domain::kCheckpoint);
  const auto record = system.path("record.csv");
  simulate(system, {.profile = write_ramp_profile(system, 300), .rate_hz = 20}, record);
  const std::string rows = content(record);
  const std::size_t head = rows.find("\n", rows.find("rate_x")) + 1;
  const std::size_t middle = rows.find('\n', rows.size() / 2) + 1;
  write(system.path("before.csv"), rows.substr(0, middle));
  write(system.path("after.csv"), rows.substr(0, head) + rows.substr(middle));
  const auto known = system.path("known.ckpt");
  run_offline(system, system.path("before.csv"), system.path("a.csv"),
              {"--save-checkpoint", known});
  const auto first_sigma = [&](const Arguments& more) {
    const auto out = system.path("out.csv");
    run_offline(system, system.path("after.csv"), out, Arguments{"--checkpoint", known} + more);
    const Table table = read_table(out);
    return std::stod(table.rows.front()[table.column("drift_sigma_x_rad_s")]);
  };
  EXPECT_GT(first_sigma({"--after-power-on"}), 2.0 * first_sigma({}));
}

// Rule: on a bad checkpoint `compensate` does not start, and leaves no output behind.
TEST(Checkpoint, OfflineABadOneIsRefusedBeforeAnythingIsWritten) {
  SystemUnderTest system(Domain::kCheckpoint);
  const auto record = system.path("record.csv");
  simulate(system, {.profile = write_ramp_profile(system, 300), .rate_hz = 20}, record);
  const auto first = system.path("first.ckpt");
  run_offline(system, record, system.path("first.csv"), {"--save-checkpoint", first});
  run_offline(system, record, system.path("second.csv"), {"--checkpoint", first});
  const Table table = read_table(system.path("second.csv"));
  EXPECT_EQ(table.rows.front()[table.column("rung_x")], "stack") << "before the first temperature";

  const auto refused = [&](const Arguments& more, const char* reason) {
    Arguments arguments{"compensate", "--record", record, "--out", system.path("none.csv")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished done = system.run("zerodrift", arguments);
    EXPECT_EQ(done.exit_code, 2);
    EXPECT_NE(done.err.find(reason), std::string::npos) << done.err;
    EXPECT_EQ(std::count(done.err.begin(), done.err.end(), '\n'), 1) << done.err;
    EXPECT_FALSE(std::filesystem::exists(system.path("none.csv")));
  };
  refused({"--checkpoint", first, "--gyro-id", "2"}, "gyro 1, expected one of gyro 2");
  write(system.path("cut.ckpt"), content(first).substr(0, 1000));
  refused({"--checkpoint", system.path("cut.ckpt")}, "truncated");
  refused({"--checkpoint", system.path("none.ckpt")}, "No such file");
}

}  // namespace
}  // namespace zerodrift::system_test
