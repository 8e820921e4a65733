// SPDX-License-Identifier: Apache-2.0
// A running system recorded: what is in the file, what of it can be computed again, and what
// survives.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/system/files.h"
#include "tests/system/pipeline.h"
#include "tests/system/wall_clock.h"

namespace zerodrift::system_test {
namespace {

namespace fs = std::filesystem;
using namespace std::chrono_literals;

constexpr int kDurationS = 300;
constexpr std::uint64_t kSamples = 60000;  // at 200 Hz

Finished export_to(SystemUnderTest& system, const fs::path& from, const fs::path& to,
                   const Arguments& more = {}) {
  Arguments arguments{"export", from, "--out", to};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return system.run("zerodrift", arguments);
}

nlohmann::json info_of(SystemUnderTest& system, const fs::path& file, int exit_code = 0) {
  const fs::path json = system.path("info.json");
  const Finished done = system.run("zerodrift", {"info", file, "--json", json});
  EXPECT_EQ(done.exit_code, exit_code) << done.out << done.err;
  return nlohmann::json::parse(content(json));
}

std::uint64_t messages_of(const nlohmann::json& info, const std::string& topic) {
  std::uint64_t messages = 0;
  for (const auto& channel : info["channels"]) {
    if (channel["topic"] == topic) messages += channel["messages"].get<std::uint64_t>();
  }
  return messages;
}

// A simulated run into `out`, which takes all topics.
void record_live(SystemUnderTest& system, const fs::path& out) {
  const Simulation simulation{.profile = write_ramp_profile(system, kDurationS), .seed = 5};
  Arguments source{"--source", "simulation"};
  for (const auto& argument : simulation.arguments()) source.push_back(argument);
  run_live(system, {.source = source, .gyro = {"--rate", "200"}, .samples = kSamples, .out = out});
}

// The first rows of `b` are those of `a`, to the byte, but for those that a cut file may have had
// to answer without what was cut off.
void expect_prefix(const fs::path& a, const fs::path& b, std::size_t at_least) {
  const Table cut = read_table(a);
  const Table whole = read_table(b);
  ASSERT_GE(cut.rows.size(), at_least);
  ASSERT_LE(cut.rows.size(), whole.rows.size());
  // Temperatures of the last second may be missing behind the cut.
  for (std::size_t row = 0; row + 200 < cut.rows.size(); ++row)
    ASSERT_EQ(cut.rows[row], whole.rows[row]) << row;
}

// One live run, recorded, and everything that can be done with the recording: the run is what takes
// time.
TEST(Recording, OfALiveRunGivesBackItsInputsAndItsOutputsToTheBit) {
  SystemUnderTest system(Domain::kRecording);
  const fs::path live = system.path("live.mcap");
  record_live(system, live);
  ASSERT_FALSE(::testing::Test::HasFailure());

  // What is in it.
  const auto info = info_of(system, live);
  EXPECT_EQ(info["ending"], "whole");
  EXPECT_EQ(info["findings"], nlohmann::json::array());
  EXPECT_EQ(messages_of(info, "angular_rate"), kSamples);
  EXPECT_EQ(messages_of(info, "compensated_rate"), kSamples);
  EXPECT_EQ(info["metadata"]["recording"]["messages_lost"], "0");
  for (const auto& channel : info["channels"]) {
    if (channel["topic"] == "compensated_rate" || channel["topic"] == "angular_rate") {
      EXPECT_EQ(channel["missing"], 0U) << channel;
      EXPECT_EQ(channel["backward"], 0U) << channel;
    }
  }
  for (const char* topic :
       {"temperature", "service_status", "event", "allan_report", "replay_progress"})
    EXPECT_GT(messages_of(info, topic), 0U) << topic;

  // Computed again from its inputs: the outputs that are in it.
  const fs::path said = system.path("said.csv");
  ASSERT_EQ(export_to(system, live, said, {"--topic", "compensated_rate"}).exit_code, 0);
  run_offline(system, live, system.path("computed.csv"));
  EXPECT_EQ(first_difference(said, system.path("computed.csv")), "");
  const Table table = read_table(said);
  EXPECT_EQ(table.rows.back()[table.column("rung_x")], "stack") << "nothing was learned";

  // Cut in the middle: all that is before.
  const fs::path cut = system.path("cut.mcap");
  fs::copy_file(live, cut);
  fs::resize_file(cut, fs::file_size(cut) / 2);
  EXPECT_EQ(info_of(system, cut, 1)["ending"], "cut");
  run_offline(system, cut, system.path("computed_of_cut.csv"));
  expect_prefix(system.path("computed_of_cut.csv"), said, kSamples / 4);

  // Replayed through the services: the same outputs once more.
  ChildProcess& monitor = system.start("allan_monitor", {});
  ChildProcess& recorder = system.start("zerodrift", {"record", "--out", system.path("again.csv"),
                                                      "--samples", std::to_string(kSamples)});
  ChildProcess& compensation = system.start("compensation", {"--await-subscribers", "2"});
  ChildProcess& replay = system.start("zerodrift", {"replay", live, "--speed", "max", "--wait-for",
                                                    "compensation,allan_monitor,recorder"});
  EXPECT_EQ(recorder.wait(60s), 0);
  EXPECT_EQ(replay.wait(10s), 0) << replay.err();
  for (ChildProcess* process : {&compensation, &monitor}) {
    process->send(SIGTERM);
    process->wait(2s);
  }
  EXPECT_EQ(first_difference(system.path("again.csv"), said), "");
}

// Through CSV and back no bit is lost of what a CSV record holds.
TEST(Recording, MadeOfACsvRecordIsCompensatedTheSame) {
  SystemUnderTest system(Domain::kRecordingOfCsv);
  const Simulation simulation{.profile = write_ramp_profile(system, 120)};
  simulate(system, simulation, system.path("record.csv"), {"--reference"});
  for (const char* compression : {"none", "lz4", "zstd"}) {
    const Finished done = export_to(system, system.path("record.csv"), system.path("record.mcap"),
                                    {"--compression", compression});
    ASSERT_EQ(done.exit_code, 0) << done.err;
    run_offline(system, system.path("record.csv"), system.path("of_csv.csv"));
    run_offline(system, system.path("record.mcap"), system.path("of_mcap.csv"));
    EXPECT_EQ(first_difference(system.path("of_csv.csv"), system.path("of_mcap.csv")), "")
        << compression;
  }
  ASSERT_EQ(export_to(system, system.path("record.mcap"), system.path("back.csv")).exit_code, 0);
  const Table before = read_table(system.path("record.csv"));
  const Table after = read_table(system.path("back.csv"));
  ASSERT_EQ(before.rows.size(), after.rows.size());
}

// Messages of a gyro and events, written by the test.
class Publisher {
 public:
  explicit Publisher(const dds::NetworkOptions& network)
      : participant_("publisher", network), rates_(participant_), events_(participant_) {}

  [[nodiscard]] bool is_received() const { return rates_.matched() > 0 && events_.matched() > 0; }
  void rate() {
    msg::AngularRate message;
    message.gyro_id(1);
    message.validity(7);
    message.sequence_number(sequence_++);
    message.sensor_time_ns(static_cast<std::int64_t>(sequence_) * 10'000'000);
    message.interval_s(0.01);
    EXPECT_TRUE(rates_.write(message));
  }
  void event(const char* code, std::uint32_t severity) {
    msg::Event event;
    event.service("test");
    event.code(code);
    event.text("text");
    event.severity(severity);
    event.wall_time_ns(std::chrono::duration_cast<std::chrono::nanoseconds>(
                           std::chrono::system_clock::now().time_since_epoch())
                           .count());
    EXPECT_TRUE(events_.write(event));
  }
  // At 100 Hz.
  void rates_for(std::chrono::milliseconds time) {
    for (auto passed = 0ms; passed < time; passed += 10ms) {
      rate();
      std::this_thread::sleep_for(10ms);
    }
  }
  [[nodiscard]] std::uint64_t sent() const { return sequence_; }
  void wait_until_received() { EXPECT_TRUE(rates_.wait_until_received(10s)); }

 private:
  dds::Participant participant_;
  dds::Writer<msg::AngularRate> rates_;
  dds::Writer<msg::Event> events_;
  std::uint64_t sequence_ = 0;
};

std::vector<fs::path> recordings_in(const fs::path& folder, const std::string& begin) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().filename().string().starts_with(begin)) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

TEST(Recording, WithAPreTriggerHoldsWhatWasBeforeTheEvent) {
  SystemUnderTest system(Domain::kRecordingTrigger);
  // Its clock is a minute ahead of everybody's, and is then set forward once more.
  WallClock clock(system.path("clock"));
  clock.set_ahead(60s);
  ChildProcess& recorder = system.start_foreign(
      "zerodrift",
      {"record", "--out", system.path("fault.mcap"), "--pre-trigger", "2", "--post-trigger", "0.3",
       "--domain", std::to_string(system.network().domain)},
      clock.environment());
  Publisher publisher(system.network());
  ASSERT_TRUE(eventually([&] { return publisher.is_received(); }));
  clock.set_ahead(120s);
  publisher.rates_for(4000ms);
  publisher.event("calm", 0);  // information is no reason
  publisher.rates_for(300ms);
  EXPECT_TRUE(recordings_in(system.path(""), "fault").empty());
  const std::uint64_t before = publisher.sent();
  publisher.event("trouble", 1);
  publisher.rates_for(1500ms);
  recorder.send(SIGTERM);
  EXPECT_EQ(recorder.wait(5s), 0) << recorder.err();
  const auto files = recordings_in(system.path(""), "fault");
  ASSERT_EQ(files.size(), 1U);
  EXPECT_EQ(files[0].filename(), "fault_0001.mcap");
  const auto info = info_of(system, files[0]);
  EXPECT_EQ(info["ending"], "whole");
  EXPECT_GE(messages_of(info, "event"), 2U) << "the one before is in the buffer, too";
  // 2 s before are 200 samples at 100 Hz; the sleeps between them are rather longer, by how much
  // depends on the machine, and so may the 0.3 s since the calm event be. None of the 200 samples
  // of the first seconds is there.
  ASSERT_EQ(export_to(system, files[0], system.path("fault.csv")).exit_code, 0);
  const Table table = read_table(system.path("fault.csv"));
  const std::size_t sequence = table.column("sequence");
  const auto first = std::stoull(table.rows.front()[sequence]);
  const auto last = std::stoull(table.rows.back()[sequence]);
  EXPECT_LT(first, before);
  EXPECT_GE(first, before - 220);
  EXPECT_GT(last, before);
  EXPECT_LT(last, publisher.sent() - 1) << "the recording goes on after the post-trigger time";
}

TEST(Recording, LastsAsLongAsAskedForWhoeverSetsTheClock) {
  SystemUnderTest system(Domain::kRecordingClock);
  const auto start = std::chrono::steady_clock::now();
  WallClock clock(system.path("clock"));
  clock.set_ahead(60s);
  ChildProcess& recorder =
      system.start_foreign("zerodrift",
                           {"record", "--out", system.path("run.mcap"), "--duration", "4",
                            "--domain", std::to_string(system.network().domain)},
                           clock.environment());
  EXPECT_TRUE(eventually([&] { return recorder.out().find("recording to") != std::string::npos; }));
  clock.set_ahead(120s);
  EXPECT_EQ(recorder.wait(60s), 0) << recorder.err();
  EXPECT_GE(std::chrono::steady_clock::now() - start, 4s);
}

// A recorder that stood still longer than the history of the rates lasts; and one that was not yet
// heard of when a source began.
TEST(Recording, SaysToTheMessageWhatIsMissing) {
  SystemUnderTest system(Domain::kRecordingLoss);
  const fs::path out = system.path("run.mcap");
  ChildProcess& recorder = system.start("zerodrift", {"record", "--out", out});
  ASSERT_TRUE(eventually(
      [&] { return recorder.out().find("recording to " + out.string()) != std::string::npos; }));
  Publisher late(system.network());
  for (int i = 0; i < 100; ++i) late.rate();  // into the void
  ASSERT_TRUE(eventually([&] { return late.is_received(); }));
  recorder.send(SIGSTOP);
  for (int i = 0; i < 20000; ++i) late.rate();
  recorder.send(SIGCONT);
  // It goes on: the last ones arrive, and tell of the hole before them.
  late.rates_for(1000ms);
  late.wait_until_received();
  recorder.send(SIGTERM);
  EXPECT_EQ(recorder.wait(10s), 1) << recorder.out() << recorder.err();
  const auto info = info_of(system, out, 1);
  EXPECT_EQ(info["ending"], "whole");
  const std::uint64_t lost = late.sent() - messages_of(info, "angular_rate");
  EXPECT_GE(lost, 100U) << "nothing was lost, so nothing was tried";
  EXPECT_EQ(info["metadata"]["recording"]["messages_lost/angular_rate"], std::to_string(lost));
  const auto all_lost = info["messages_lost"].get<std::uint64_t>();
  EXPECT_GE(all_lost, lost);
  EXPECT_NE(recorder.out().find(std::to_string(all_lost) + " lost"), std::string::npos)
      << recorder.out();
}

// The same as CSV, of one gyro of two: what it says is what is missing among the numbers in it.
TEST(Recording, AsCsvSaysToTheSampleWhatIsMissing) {
  SystemUnderTest system(Domain::kRecordingCsvLoss);
  const fs::path out = system.path("run.csv");
  dds::Participant participant("publisher", system.network());
  dds::Writer<msg::CompensatedRate> answers(participant);
  std::uint64_t sequence = 0;
  const auto answer = [&] {
    for (const std::uint32_t gyro_id : {1U, 2U}) {
      msg::CompensatedRate message;
      message.gyro_id(gyro_id);
      message.run_id(7);
      message.sequence_number(sequence);
      message.sensor_time_ns(static_cast<std::int64_t>(sequence) * 1'000'000);
      EXPECT_TRUE(answers.write(message));
    }
    ++sequence;
  };
  answer();  // what was before it came is nobody's loss
  ChildProcess& recorder = system.start("zerodrift", {"record", "--out", out});
  ASSERT_TRUE(eventually([&] { return answers.matched() > 0; }));
  for (int i = 0; i < 100; ++i) answer();
  EXPECT_TRUE(answers.wait_until_received(10s));
  recorder.send(SIGSTOP);
  for (int i = 0; i < 8000; ++i) answer();
  recorder.send(SIGCONT);
  for (int i = 0; i < 100; ++i) {
    answer();
    std::this_thread::sleep_for(10ms);
  }
  EXPECT_TRUE(answers.wait_until_received(10s));
  recorder.send(SIGTERM);
  EXPECT_EQ(recorder.wait(10s), 1) << recorder.out() << recorder.err();
  const Table table = read_table(out);
  const std::size_t column = table.column("sequence");
  const auto first = std::stoull(table.rows.front()[column]);
  const auto last = std::stoull(table.rows.back()[column]);
  EXPECT_EQ(last, sequence - 1);
  const std::uint64_t lost = last - first + 1 - table.rows.size();
  EXPECT_GE(lost, 100U) << "nothing was lost, so nothing was tried";
  EXPECT_NE(recorder.out().find("run.csv: " + std::to_string(table.rows.size()) + " samples, " +
                                std::to_string(lost) + " lost: they did not arrive"),
            std::string::npos)
      << recorder.out() << lost;
}

TEST(Recording, IsSplitWithoutLosingASample) {
  SystemUnderTest system(Domain::kRecordingSplit);
  ChildProcess& recorder =
      system.start("zerodrift", {"record", "--out", system.path("run.mcap"), "--split-duration",
                                 "0.5", "--attach", write_ramp_profile(system, 1)});
  Publisher publisher(system.network());
  ASSERT_TRUE(eventually([&] { return publisher.is_received(); }));
  std::this_thread::sleep_for(300ms);  // matched here is matched there a little later
  publisher.rates_for(2000ms);
  std::this_thread::sleep_for(300ms);
  recorder.send(SIGTERM);
  EXPECT_EQ(recorder.wait(5s), 0) << recorder.err();
  const auto files = recordings_in(system.path(""), "run_");
  EXPECT_GE(files.size(), 4U);
  std::uint64_t rates = 0;
  for (const auto& file : files) {
    const auto info = info_of(system, file);
    EXPECT_EQ(info["ending"], "whole") << file;
    rates += messages_of(info, "angular_rate");
  }
  EXPECT_EQ(rates, publisher.sent());
  const Finished done = export_to(system, files.front(), system.path("attached.yaml"),
                                  {"--attachment", "profile.yaml"});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_EQ(first_difference(system.path("attached.yaml"), system.path("profile.yaml")), "");
}

TEST(Recording, OfAKilledRecorderIsReadableAndNotLostToTheNextOne) {
  SystemUnderTest system(Domain::kRecordingKilled);
  const Arguments record{"record", "--out", system.path("run.mcap")};
  ChildProcess& killed = system.start("zerodrift", record);
  Publisher publisher(system.network());
  ASSERT_TRUE(eventually([&] { return publisher.is_received(); }));
  std::this_thread::sleep_for(300ms);
  publisher.rates_for(3000ms);
  killed.send(SIGKILL);
  killed.wait(2s);
  EXPECT_FALSE(fs::exists(system.path("run.mcap")));
  const auto info = info_of(system, system.path("run.mcap.active"), 1);
  EXPECT_EQ(info["ending"], "cut");
  // Of 3 s all but the last is there for sure: what is a second old is in the file.
  EXPECT_GT(messages_of(info, "angular_rate"), publisher.sent() / 2);

  ChildProcess& next = system.start("zerodrift", record);
  EXPECT_TRUE(eventually([&] { return fs::exists(system.path("run.cut1.mcap")); }));
  EXPECT_TRUE(eventually([&] { return publisher.is_received(); }));
  publisher.rates_for(200ms);
  next.send(SIGTERM);
  EXPECT_EQ(next.wait(5s), 0) << next.err();
  EXPECT_EQ(info_of(system, system.path("run.mcap"))["ending"], "whole");
  EXPECT_EQ(messages_of(info_of(system, system.path("run.cut1.mcap"), 1), "angular_rate"),
            messages_of(info, "angular_rate"));
}

// A second recorder, or an export, with the name of a recording under way: one line, and the
// recording has all that it would have had.
TEST(Recording, UnderWayIsNotTakenByAnotherOfItsName) {
  SystemUnderTest system(Domain::kRecordingShared);
  const fs::path out = system.path("run.mcap");
  ChildProcess& first = system.start("zerodrift", {"record", "--out", out});
  ASSERT_TRUE(eventually([&] { return first.out().find("recording to") != std::string::npos; }));
  Publisher publisher(system.network());
  ASSERT_TRUE(eventually([&] { return publisher.is_received(); }));
  publisher.rates_for(500ms);
  write(system.path("rates.csv"), "time_s,rate_x_deg_h\n0,1\n1,2\n");
  for (const Arguments& second : {Arguments{"record", "--out", out},
                                  Arguments{"export", system.path("rates.csv"), "--out", out}}) {
    const Finished done = system.run("zerodrift", second);
    EXPECT_EQ(done.exit_code, 2) << done.out;
    EXPECT_NE(done.err.find("run.mcap.active: another process is writing it"), std::string::npos)
        << done.err;
    EXPECT_TRUE(fs::exists(out.string() + ".active"));
  }
  publisher.rates_for(500ms);
  publisher.wait_until_received();
  first.send(SIGTERM);
  EXPECT_EQ(first.wait(5s), 0) << first.out() << first.err();
  EXPECT_EQ(recordings_in(system.path(""), "run").size(), 1U);
  EXPECT_EQ(messages_of(info_of(system, out), "angular_rate"), publisher.sent());
}

// A file may not grow beyond 256 kB here, as on a disk that is full: the recorder says so, goes on
// trying and ends with "no"; what is in the file stays readable.
TEST(Recording, OntoAFullDiskSaysSoAndKeepsWhatIsThere) {
  SystemUnderTest system(Domain::kRecordingFull);
  const fs::path out = system.path("full.mcap");
  const std::string command =
      std::string("trap '' XFSZ; ulimit -f 256; exec '") + ZERODRIFT_BIN_DIR +
      "/zerodrift' record --compression none --chunk-size 16 --out '" + out.string() +
      "' --domain " + std::to_string(system.network().domain);
  ChildProcess recorder(Program{"/bin/bash", {"-c", command}, {}, system.path("recorder")});
  dds::Participant participant("observer", system.network());
  Collector<msg::Event> events(participant);
  Publisher publisher(system.network());
  ASSERT_TRUE(eventually([&] { return publisher.is_received(); }));
  // 256 blocks of 1024 bytes hold less than 2000 samples of 160 bytes each with their head.
  EXPECT_TRUE(eventually([&] {
    for (int i = 0; i < 20; ++i) publisher.rate();
    std::this_thread::sleep_for(10ms);
    return told(events, "recording_failed", "writing fails: File too large");
  }));
  recorder.send(SIGTERM);
  EXPECT_EQ(recorder.wait(5s), 1) << recorder.err();
  const auto info = info_of(system, out.string() + ".active", 1);
  EXPECT_GT(messages_of(info, "angular_rate"), 800U);
  ASSERT_EQ(info["findings"].size(), 1U);
  EXPECT_NE(info["findings"][0].get<std::string>().find("ends without a footer"), std::string::npos)
      << "no half of a chunk: " << info["findings"];
}

// The same as CSV: the recording ends, and what was written is there under a name that is told.
TEST(Recording, AsCsvOntoAFullDiskEndsWithWhatIsThere) {
  SystemUnderTest system(Domain::kRecordingCsvFull);
  const fs::path out = system.path("full.csv");
  const std::string command = std::string("trap '' XFSZ; ulimit -f 300; exec '") +
                              ZERODRIFT_BIN_DIR + "/zerodrift' record --out '" + out.string() +
                              "' --domain " + std::to_string(system.network().domain);
  ChildProcess recorder(Program{"/bin/bash", {"-c", command}, {}, system.path("recorder")});
  dds::Participant participant("publisher", system.network());
  dds::Writer<msg::CompensatedRate> answers(participant);
  ASSERT_TRUE(eventually([&] { return answers.matched() > 0; }));
  // A row has some hundred characters: 300 kB are full after a few thousand.
  msg::CompensatedRate answer;
  answer.gyro_id(1);
  ASSERT_TRUE(eventually([&] {
    for (int i = 0; i < 200; ++i) {
      answer.sequence_number(answer.sequence_number() + 1);
      answer.sensor_time_ns(static_cast<std::int64_t>(answer.sequence_number()) * 1'000'000);
      EXPECT_TRUE(answers.write(answer));
    }
    return !recorder.running();
  }));
  EXPECT_EQ(recorder.wait(5s), 1) << recorder.err();
  const fs::path kept = system.path("full.cut1.csv");
  EXPECT_NE(recorder.err().find("full.csv: writing fails: File too large; what was written before "
                                "is in " +
                                kept.string()),
            std::string::npos)
      << recorder.err();
  EXPECT_FALSE(fs::exists(out));
  EXPECT_GT(fs::file_size(kept), 200'000U);
  EXPECT_TRUE(recordings_in(system.path(""), ".full").empty());
}

TEST(Recording, WrongOptionsAreOneLine) {
  SystemUnderTest system(Domain::kRecordingUsage);
  const auto line = [&](const Arguments& arguments) {
    const Finished done = system.run("zerodrift", arguments);
    EXPECT_EQ(done.exit_code, 2) << done.out;
    return done.err;
  };
  EXPECT_NE(line({"record", "--out", system.path("a.csv"), "--pre-trigger", "5"})
                .find("--pre-trigger: is for recordings, so --out must end in .mcap"),
            std::string::npos);
  EXPECT_NE(line({"record", "--out", system.path("a.mcap"), "--topics", "angular_rat"})
                .find("--topics: found 'angular_rat', expected some of angular_rate, temperature"),
            std::string::npos);
  EXPECT_NE(line({"record", "--out", system.path("a.mcap"), "--attach", system.path("none.yaml")})
                .find("none.yaml: cannot open: No such file or directory"),
            std::string::npos);
  // What was recorded is not written over by the next one.
  write(system.path("there.mcap"), "recorded before");
  EXPECT_NE(line({"record", "--out", system.path("there.mcap")})
                .find("there.mcap: is there, and a recording is not written over; expected another "
                      "name, or move it away"),
            std::string::npos);
  EXPECT_EQ(fs::file_size(system.path("there.mcap")), 15U);
  EXPECT_NE(line({"replay", system.path("none.mcap")}).find("none.mcap"), std::string::npos);
}

}  // namespace
}  // namespace zerodrift::system_test
