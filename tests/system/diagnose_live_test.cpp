// SPDX-License-Identifier: Apache-2.0
// `zerodrift diagnose --live`: hears of a running system what its record would have said, finds the
// same, and the model it repairs becomes the prior of the service that runs on.
#include <gtest/gtest.h>
#include <signal.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <string>

#include "common/core/units.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::ordered_json;

const std::filesystem::path kSource = ZERODRIFT_SOURCE_DIR;

// A gyro's five hours in the chamber: rates, true rates, temperatures and all that it was exposed
// to.
std::filesystem::path write_chamber_record(SystemUnderTest& system) {
  const auto record = system.path("record.csv");
  simulate(system,
           {.model = kSource / "config/models/lab_fog.yaml",
            .profile = kSource / "config/profiles/diagnosis_chamber.yaml",
            .rate_hz = 1},
           record, {"--reference"});
  return record;
}

// The factory's model without the Shupe effect of x.
std::filesystem::path write_lacking_model(const SystemUnderTest& system) {
  std::string text = content(kSource / "config/models/lab_fog.yaml");
  const std::string effect =
      "  - kind: shupe\n    axis: x\n    parameters: {coefficient_deg_h_min_per_degc: 0.9}\n";
  const std::size_t at = text.find(effect);
  if (at == std::string::npos) throw std::runtime_error("lab_fog.yaml lists no such effect");
  write(system.path("model.yaml"), text.erase(at, effect.size()));
  return system.path("model.yaml");
}

std::filesystem::path write_compensation_config(const SystemUnderTest& system) {
  write(system.path("compensation.yaml"),
        "features:\n"
        "  - {kind: temperature, probe: coil_outer}\n"
        "  - {kind: temperature_rate, probe: coil_outer}\n"
        "probes: [coil_outer, coil_inner, board]\n");
  return system.path("compensation.yaml");
}

std::string replaced(std::string text, const std::string& what, const std::string& with) {
  for (std::size_t at = text.find(what); at != std::string::npos;
       at = text.find(what, at + with.size()))
    text.replace(at, what.size(), with);
  return text;
}

// Rule: what runs is diagnosed as its record is, to the byte; the finding is an event; the repaired
// model is adopted with a new epoch and taken back.
TEST(DiagnoseLive, FindsWhatTheRecordShowsAndItsModelIsAdopted) {
  SystemUnderTest system(Domain::kDiagnoseLive);
  const auto record = write_chamber_record(system);
  const auto model = write_lacking_model(system);
  const Arguments common{"diagnose", "--model", model, "--axis", "x", "--date", "2026-03-31"};
  const auto with = [&](Arguments more) {
    more.insert(more.begin(), common.begin(), common.end());
    return more;
  };
  const Finished offline =
      system.run("zerodrift", with({"--record", record, "--json", system.path("offline.json"),
                                    "--out-model", system.path("offline.yaml")}));
  ASSERT_EQ(offline.exit_code, 0) << offline.err;

  dds::Participant participant("test", system.network());
  Collector<msg::Event> events(participant);
  Collector<msg::TwinReport> reports(participant);
  Collector<msg::CompensatedRate> answers(participant);
  Collector<msg::Temperature> temperatures(participant);
  Collector<msg::Environment> environment(participant);
  ChildProcess& live = system.start(
      "zerodrift", with({"--live", "--duration", "5h", "--json", system.path("live.json"), "--html",
                         system.path("live.html"), "--out-model", system.path("live.yaml")}));
  system.start("compensation",
               {"--config", write_compensation_config(system), "--model-dir", system.path("")});
  const Arguments source{"--source", "record", "--record", record, "--speed", "max"};
  const auto plus = [](Arguments a, const Arguments& b) {
    a.insert(a.end(), b.begin(), b.end());
    return a;
  };
  ChildProcess& thermal = system.start("thermal_publisher", source);
  ASSERT_TRUE(eventually([&] { return temperatures.size() > 0 && environment.size() > 0; }));
  ChildProcess& gyro =
      system.start("gyro_publisher", plus(source, {"--wait-for", "compensation,diagnose"}));
  ASSERT_EQ(live.wait(90s), 0) << live.err();
  EXPECT_EQ(gyro.wait(10s), 0);
  EXPECT_EQ(thermal.wait(10s), 0);

  const auto as_live = [&](const std::string& file) {
    return replaced(content(system.path(file)), record.string(), "gyro 1 live");
  };
  const auto without_provenance = [](const std::string& text) {
    Json json = Json::parse(text);
    json.erase("provenance");
    return json.dump();
  };
  EXPECT_EQ(without_provenance(as_live("offline.json")),
            without_provenance(content(system.path("live.json"))));
  EXPECT_EQ(as_live("offline.yaml"), content(system.path("live.yaml")));
  EXPECT_TRUE(content(system.path("live.html")).ends_with("</html>\n"));
  const Json x = Json::parse(content(system.path("live.json"))).at("axis").at("x");
  ASSERT_FALSE(x.at("effects").empty()) << live.out();
  EXPECT_EQ(x.at("effects").at(0).at("name"), "shupe");
  EXPECT_EQ(content(system.path("live.json")).find("left out"), std::string::npos);
  const std::string code = "diagnosis_" + x.at("verdict").get<std::string>();
  EXPECT_TRUE(eventually([&] { return told(events, code, "gyro 1; axis x: missing shupe"); }));
  EXPECT_TRUE(told(events, code, "gap"));
  ASSERT_TRUE(eventually([&] { return reports.size() == 1; }));
  const msg::TwinReport report = reports.all().front();
  EXPECT_EQ(report.verdict(), x.at("verdict").get<std::string>());
  ASSERT_FALSE(report.effects().empty());
  EXPECT_STREQ(report.effects().front().name().c_str(), "shupe");
  const Json& gap = x.at("gap").at("held_out");
  EXPECT_LT(report.after_rms_radps(), report.before_rms_radps());
  EXPECT_NEAR(core::deg_h_from_radps(report.before_rms_radps()),
              gap.at("before_rms_deg_h").get<double>(),
              1e-3 * gap.at("before_rms_deg_h").get<double>());

  // Samples to be compensated with the repaired model: the record once more, 200 times as fast.
  const Arguments again{"--source", "record", "--record", record, "--speed", "200"};
  system.start("thermal_publisher", again);
  system.start("gyro_publisher", again);
  const std::size_t before = answers.size();
  ASSERT_TRUE(eventually([&] { return answers.size() > before + 400; }));
  // Which rung of the ladder is used depends on what was learned by then; that a sample is answered
  // under a newer epoch does not. (What a prior takes off: prior_test.cpp.)
  const auto answered_after = [&](std::uint64_t epoch) {
    return eventually([&] { return answers.newest().model_epoch() > epoch; });
  };
  const std::uint64_t epoch = answers.newest().model_epoch();
  const Finished adopted = system.control({"adopt", "--model", "live.yaml"});
  ASSERT_EQ(adopted.exit_code, 0) << adopted.out << adopted.err;
  EXPECT_NE(adopted.out.find("adopted lab_fog"), std::string::npos) << adopted.out;
  EXPECT_NE(adopted.out.find("model epoch"), std::string::npos) << adopted.out;
  EXPECT_TRUE(answered_after(epoch));
  const std::uint64_t adopted_epoch = answers.newest().model_epoch();
  const Finished reverted = system.control({"revert"});
  EXPECT_EQ(reverted.exit_code, 0) << reverted.out << reverted.err;
  EXPECT_NE(reverted.out.find("reverted to no prior"), std::string::npos) << reverted.out;
  EXPECT_TRUE(answered_after(adopted_epoch));
}

// Rule: at any speed, what belongs to a rate is in its row; here is three times what may wait.
TEST(DiagnoseLive, OfADenseRecordAtFullSpeedNothingIsLeftBehind) {
  SystemUnderTest system(Domain::kDiagnoseLiveDense);
  const auto record = system.path("record.csv");
  simulate(system,
           {.model = kSource / "config/models/lab_fog.yaml",
            .profile = kSource / "config/profiles/diagnosis_chamber.yaml",
            .rate_hz = 20},
           record, {"--reference", "--duration", "2500"});
  const Arguments common{"diagnose",  "--model", kSource / "config/models/lab_fog.yaml",
                         "--axis",    "x",       "--date",
                         "2026-03-31"};
  const auto with = [&](Arguments more) {
    more.insert(more.begin(), common.begin(), common.end());
    return more;
  };
  const Finished offline =
      system.run("zerodrift", with({"--record", record, "--json", system.path("offline.json")}));
  ASSERT_EQ(offline.exit_code, 0) << offline.err;

  dds::Participant participant("test", system.network());
  Collector<msg::Environment> environment(participant);
  ChildProcess& live = system.start(
      "zerodrift", with({"--live", "--duration", "5h", "--json", system.path("live.json")}));
  system.start("compensation", {});
  const Arguments source{"--source", "record", "--record", record, "--speed", "max"};
  system.start("thermal_publisher", source);
  ASSERT_TRUE(eventually([&] { return environment.size() > 0; }));
  Arguments rates = source;
  rates.insert(rates.end(), {"--wait-for", "diagnose"});
  system.start("gyro_publisher", rates);
  ASSERT_EQ(live.wait(120s), 0) << live.err();
  EXPECT_EQ(live.err().find("left out"), std::string::npos) << live.err();
  const auto diagnosed = [&](const std::string& file) {
    Json json = Json::parse(replaced(content(system.path(file)), record.string(), "gyro 1 live"));
    json.erase("provenance");
    return json.dump();
  };
  EXPECT_EQ(diagnosed("offline.json"), diagnosed("live.json"));
}

class DiagnoseLiveStop : public ::testing::Test {
 protected:
  DiagnoseLiveStop() {
    // 7200 s of a chamber that ramps.
    simulate(system_,
             {.model = kSource / "config/models/lab_fog.yaml",
              .profile = write_ramp_profile(system_, 7200),
              .rate_hz = 1},
             record_);
  }

  ChildProcess& listen(const Arguments& more = {}) {
    Arguments arguments{"diagnose", "--live", "--model",    kSource / "config/models/lab_fog.yaml",
                        "--axis",   "x",      "--duration", "5h",
                        "--json",   json_};
    arguments.insert(arguments.end(), more.begin(), more.end());
    return system_.start("zerodrift", arguments);
  }
  void publish(const Arguments& more) {
    Arguments source{"--source", "record", "--record", record_, "--wait-for", "diagnose"};
    source.insert(source.end(), more.begin(), more.end());
    system_.start("thermal_publisher", source);
    system_.start("gyro_publisher", source);
  }

  SystemUnderTest system_{Domain::kDiagnoseLiveStop};
  const std::filesystem::path record_ = system_.path("record.csv");
  const std::filesystem::path json_ = system_.path("d.json");
};

TEST_F(DiagnoseLiveStop, CtrlCDiagnosesWhatIsThere) {
  dds::Participant participant("test", system_.network());
  Collector<msg::ServiceStatus> statuses(participant);
  ChildProcess& live = listen();
  publish({"--speed", "1000"});
  ASSERT_TRUE(eventually([&] { return metric(statuses, "diagnose", "listened") > 1000.0; }));
  live.send(SIGINT);
  ASSERT_EQ(live.wait(30s), 0) << live.err();
  EXPECT_TRUE(Json::parse(content(json_)).at("axis").contains("x"));
}

TEST_F(DiagnoseLiveStop, TheEndOfAReplayIsTheEndOfTheWatch) {
  ChildProcess& live = listen();
  publish({"--speed", "max", "--duration", "1500"});
  ASSERT_EQ(live.wait(40s), 0) << live.err();
  EXPECT_TRUE(Json::parse(content(json_)).at("axis").contains("x"));
}

TEST_F(DiagnoseLiveStop, TooLittleToDecideIsSaidToBe) {
  ChildProcess& brief = listen();
  publish({"--speed", "max", "--duration", "300"});
  ASSERT_EQ(brief.wait(40s), 0) << brief.err();
  EXPECT_NE(brief.err().find("diagnosis_undecidable"), std::string::npos) << brief.err();
  const Json diagnosis = Json::parse(content(json_));
  EXPECT_EQ(diagnosis.at("verdict"), "undecidable");
  EXPECT_NE(diagnosis.at("axis").at("x").at("sentence").get<std::string>().find("too short"),
            std::string::npos);
}

// Before: all but the rates were used of everybody, true rates that disagree as well.
TEST_F(DiagnoseLiveStop, OfTwoPublishersOfAStreamTheFirstIsUsed) {
  simulate(system_,
           {.model = kSource / "config/models/lab_fog.yaml",
            .profile = write_ramp_profile(system_, 7200),
            .rate_hz = 1},
           record_, {"--reference"});
  dds::Participant participant("others", system_.network());
  Collector<msg::AngularRate> rates(participant);
  Collector<msg::RateReference> true_rates(participant);
  Collector<msg::Temperature> temperatures(participant);
  dds::Writer<msg::RateReference> table(participant);
  dds::Writer<msg::Temperature> thermometer(participant);
  ChildProcess& live = listen();
  publish({"--speed", "1000"});
  std::size_t k = 0;
  for (int times = 0; times < 20; ++times) {
    ASSERT_TRUE(eventually(
        [&] { return rates.size() > k && true_rates.size() > k && temperatures.size() > 0; }));
    auto said = true_rates.all()[k];
    for (double& rate : said.rate_radps()) rate += 1e-4;
    ASSERT_TRUE(table.write(said));
    auto read = temperatures.all().front();
    read.sensor_time_ns(said.sensor_time_ns());
    read.temperature_degc(90.0);
    ASSERT_TRUE(thermometer.write(read));
    k = true_rates.size();
  }
  ASSERT_EQ(live.wait(60s), 0) << live.err();
  for (const char* stream : {"true rates", "temperatures of coil_outer"})
    EXPECT_NE(live.err().find(stream + std::string(" of a second publisher")), std::string::npos)
        << live.err();

  const std::filesystem::path offline = system_.path("offline.json");
  const Finished end =
      system_.run("zerodrift", {"diagnose", "--model", kSource / "config/models/lab_fog.yaml",
                                "--axis", "x", "--record", record_, "--json", offline});
  ASSERT_EQ(end.exit_code, 0) << end.err;
  EXPECT_EQ(Json::parse(content(json_)).at("axis"), Json::parse(content(offline)).at("axis"));
}

// They are looked at before it listens.
TEST_F(DiagnoseLiveStop, RecordsToProveOnAreReadByTheColumnsThatWereNamed) {
  std::string foreign = content(record_);
  foreign.replace(foreign.find("\ntime_s,"), 8, "\nwhen,");
  const std::filesystem::path file = system_.path("foreign.csv");
  write(file, foreign);
  ChildProcess& live = listen({"--validate", file, "--columns", "time=when[s]"});
  ASSERT_TRUE(eventually([&] { return live.heeds_stop_signals(); })) << live.err();
  live.send(SIGINT);
  ASSERT_EQ(live.wait(5s), 2);
  EXPECT_NE(live.err().find("found no angular_rate"), std::string::npos) << live.err();
}

TEST_F(DiagnoseLiveStop, NothingHeardEndsWithCodeTwoAndOneLine) {
  ChildProcess& nothing = listen();
  ASSERT_TRUE(eventually([&] { return nothing.heeds_stop_signals(); }));
  nothing.send(SIGINT);
  ASSERT_EQ(nothing.wait(5s), 2) << nothing.err();
  EXPECT_NE(nothing.err().find("found no angular_rate"), std::string::npos) << nothing.err();
  EXPECT_FALSE(std::filesystem::exists(json_));

  for (const auto& [arguments, named] :
       {std::pair{Arguments{"--live", "--record", record_}, "--record"},
        std::pair{Arguments{"--live", "--duration", "60"}, "--duration"},
        std::pair{Arguments{}, "--live"}}) {
    Arguments all{"diagnose", "--model", kSource / "config/models/lab_fog.yaml"};
    all.insert(all.end(), arguments.begin(), arguments.end());
    const Finished end = system_.run("zerodrift", all);
    EXPECT_EQ(end.exit_code, 2);
    EXPECT_NE(end.err.find(named), std::string::npos) << end.err;
  }
}

}  // namespace
}  // namespace zerodrift::system_test
