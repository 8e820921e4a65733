// SPDX-License-Identifier: Apache-2.0
// A model of the twin as prior, of the command line and of the running service: the same bytes, a
// residual that falls, and a model that is adopted and taken back.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <functional>
#include <optional>
#include <string>

#include "common/core/mode.h"
#include "tests/system/files.h"
#include "tests/system/pipeline.h"

namespace zerodrift::system_test {
namespace {

const std::filesystem::path kModel =
    std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/models/paper_fog.yaml";

// All that the paper's gyro does on x but its Shupe effect.
std::filesystem::path write_partial_model(const SystemUnderTest& system) {
  const auto file = system.path("partial.yaml");
  write(file,
        "format_version: 1\ngyro_id: partial\neffects:\n"
        "  - {kind: bias, axis: x, parameters: {bias_deg_h: -1.5715}}\n"
        "  - {kind: bias_temperature, axis: x, parameters: {c1_deg_h_per_degc: 0.06657}}\n"
        "  - {kind: angle_random_walk, axis: x, parameters: {coefficient_deg_per_sqrt_h: 2e-4}}\n");
  return file;
}

double rms_of_minute_means(const Table& table, const std::string& column, double rate_hz) {
  const std::size_t cell = table.column(column);
  const auto minute = static_cast<std::size_t>(60.0 * rate_hz);
  double squares = 0.0;
  double minutes = 0.0;
  // From the third minute on: before, the temperature rate is not known.
  for (std::size_t k = 2 * minute; k + minute <= table.rows.size(); k += minute) {
    double sum = 0.0;
    for (std::size_t j = k; j < k + minute; ++j)
      sum += std::strtod(table.rows[j][cell].c_str(), nullptr);
    const double mean = sum / static_cast<double>(minute);
    squares += mean * mean;
    minutes += 1.0;
  }
  return std::sqrt(squares / minutes);
}

// Rule: with a prior, given by the configuration with a path beside it, live output is that of
// `zerodrift compensate --prior`, byte for byte.
TEST(Prior, LiveEqualsOfflineToTheByte) {
  SystemUnderTest system(Domain::kPrior);
  constexpr std::uint64_t kSamples = 30000;  // 600 s at 50 Hz
  const auto record = system.path("record.csv");
  simulate(system, {.profile = write_ramp_profile(system, 600), .rate_hz = 50}, record);
  write(system.path("model.yaml"), content(kModel));
  const auto config = system.path("compensation.yaml");
  write(config, "prior: model.yaml\n");
  run_offline(system, record, system.path("offline.csv"), {"--prior", kModel});
  run_live(system, {.source = {"--source", "record", "--record", record},
                    .compensation = {"--config", config},
                    .samples = kSamples,
                    .out = system.path("live.csv")});
  EXPECT_EQ(first_difference(system.path("live.csv"), system.path("offline.csv")), "");
  const Table table = read_table(system.path("live.csv"));
  ASSERT_EQ(table.rows.size(), kSamples);
  EXPECT_EQ(table.rows.back()[table.column("rung_x")], "stack");
  run_offline(system, record, system.path("without.csv"));
  EXPECT_NE(first_difference(system.path("offline.csv"), system.path("without.csv")), "");
}

// Rule: the model that made a record, as its prior, leaves less than learning alone does.
TEST(Prior, OfflineTheRecordsOwnModelLeavesLess) {
  SystemUnderTest system(Domain::kPrior);
  const auto record = system.path("record.csv");
  const auto left = [&](const Arguments& more) {
    run_offline(system, record, system.path("left.csv"), more);
    return rms_of_minute_means(read_table(system.path("left.csv")), "rate_x_rad_s", 10.0);
  };
  double log_ratio = 0.0;
  constexpr int kSeeds = 6;
  for (int seed = 1; seed <= kSeeds; ++seed) {
    simulate(system, {.profile = write_ramp_profile(system, 1800), .seed = seed, .rate_hz = 10},
             record);
    log_ratio += std::log(left({"--prior", kModel}) / left({})) / kSeeds;
  }
  // .88 of it, between .80 and 1.04: what is left is the gyro's own noise and random walk.
  EXPECT_LT(std::exp(log_ratio), 0.95);
}

// Rule: of a gyro with a thermometer on each face of its coil, a prior that reads the coil is
// refused with the words that make it read their mean, and runs with them.
TEST(Prior, OfflineTheMeanOfTheCoilsFacesIsReadWhereTheConfigurationNamesThem) {
  SystemUnderTest system(Domain::kPrior);
  const auto record = system.path("record.csv");
  const auto lab = std::filesystem::path(ZERODRIFT_SOURCE_DIR) / "config/models/lab_fog.yaml";
  simulate(system, {.model = lab, .profile = write_ramp_profile(system, 200), .rate_hz = 1},
           record);
  const Finished refused = system.run("zerodrift", {"compensate", "--record", record, "--prior",
                                                    lab, "--out", system.path("c.csv")});
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_NE(refused.err.find("has no temperature of probe 'coil', which the prior reads; it would "
                             "read the mean of coil_outer and coil_inner where the configuration "
                             "has probes: [coil_outer, coil_inner] and features of these, none of "
                             "'coil'"),
            std::string::npos)
      << refused.err;
  write(system.path("faces.yaml"),
        "probes: [coil_outer, coil_inner]\nfeatures: [{kind: temperature, probe: coil_outer}, "
        "{kind: temperature_rate, probe: coil_outer}]\n");
  run_offline(system, record, system.path("c.csv"),
              {"--config", system.path("faces.yaml"), "--prior", lab});
}

// Rule: what can't be a prior, or lacks its thermometer, is refused in one line before anything is
// written; effects that take no part are named; and a checkpoint learned under another prior is
// refused by that name.
TEST(Prior, OfflineABadOneIsRefusedByName) {
  SystemUnderTest system(Domain::kPrior);
  const auto record = system.path("record.csv");
  simulate(system, {.profile = write_ramp_profile(system, 200), .rate_hz = 10}, record);
  const auto refused = [&](const Arguments& more, const std::string& reason) {
    Arguments arguments{"compensate", "--record", record, "--out", system.path("none.csv")};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const Finished done = system.run("zerodrift", arguments);
    EXPECT_EQ(done.exit_code, 2) << reason;
    EXPECT_NE(done.err.find(reason), std::string::npos) << done.err;
    EXPECT_FALSE(std::filesystem::exists(system.path("none.csv")));
  };
  const auto model = [&](const std::string& effect) {
    write(system.path("bad.yaml"), "format_version: 1\neffects:\n  - {" + effect + "}\n");
    return system.path("bad.yaml");
  };
  refused({"--prior", system.path("none.yaml")}, "none.yaml");
  refused({"--prior", model("kind: shoop, axis: x, parameters: {a: 1}")}, "shoop");
  refused({"--prior", model("kind: magnetic, axis: x, parameters: {x_deg_h_per_ut: 1}")},
          "found no effect that temperature or the time since power-on drives");
  refused({"--prior", model("kind: shupe, axis: x, parameters: {coefficient_deg_h_min_per_degc: "
                            "1}, inputs: [chamber]")},
          "has no temperature of probe 'chamber', which the prior reads");

  const auto partial = write_partial_model(system);
  const Finished done =
      system.run("zerodrift", {"compensate", "--record", record, "--prior", partial,
                               "--save-checkpoint", system.path("partial.ckpt")});
  EXPECT_EQ(done.exit_code, 0) << done.err;
  EXPECT_NE(done.err.find("temperature and time alone: angle_random_walk of axis x"),
            std::string::npos)
      << done.err;
  refused({"--checkpoint", system.path("partial.ckpt")},
          "made with prior, which is not configured");
  refused({"--checkpoint", system.path("partial.ckpt"), "--prior", kModel},
          "found a checkpoint made with prior 'partial, 2 effects, ");
  run_offline(system, record, system.path("again.csv"),
              {"--checkpoint", system.path("partial.ckpt"), "--prior", partial});
}

// Rule: `ctl adopt` makes a model the prior, acknowledged with a new epoch, with an event; `ctl
// revert` brings back what was there before, with another; what can't be done is refused and
// changes nothing.
TEST(Prior, IsAdoptedAndTakenBackLive) {
  SystemUnderTest system(Domain::kPrior);
  dds::Participant participant("test", system.network());
  Collector<msg::CompensatedRate> answers(participant);
  Collector<msg::Event> events(participant);
  Arguments source{"--source", "simulation", "--speed", "20"};
  for (const auto& argument :
       Simulation{.profile = write_ramp_profile(system, 100000)}.arguments()) {
    source.push_back(argument);
  }
  std::filesystem::create_directory(system.path("checkpoints"));
  std::filesystem::create_directory(system.path("models"));
  system.start("compensation", {"--checkpoint-dir", system.path("checkpoints"), "--model-dir",
                                system.path("models")});
  system.start("thermal_publisher", source);
  source.insert(source.end(), {"--rate", "50"});
  system.start("gyro_publisher", source);
  const auto comes = [&](std::size_t from, core::Rung rung) {
    const auto is_so = [&](const msg::CompensatedRate& answer) {
      return answer.rung()[0] == static_cast<std::uint8_t>(rung);
    };
    return eventually([&] { return answers.any(is_so, from); });
  };
  ASSERT_TRUE(comes(0, core::Rung::kStack));

  const Finished early = system.control({"revert"});
  EXPECT_EQ(early.exit_code, 1);
  EXPECT_NE(early.out.find("no model was adopted"), std::string::npos) << early.out;
  std::filesystem::copy_file(kModel, system.path("models/paper_fog.yaml"));
  write(system.path("models/broken.yaml"), "format_version: 1\nnominal_rate_hz: secret\n");
  for (const auto& [model, reason] :
       {std::pair{"none.yaml", "'none.yaml': no such file"},
        std::pair{"paper_fog.yaml",
                  "temperatures that are not configured; name the probes under probes"},
        std::pair{"broken.yaml", "'broken.yaml' can't be a prior: line 2"}}) {
    const Finished refused = system.control({"adopt", "--model", model});
    EXPECT_EQ(refused.exit_code, 1) << refused.out;
    EXPECT_NE(refused.out.find(reason), std::string::npos) << refused.out;
  }
  const Finished path = system.control({"adopt", "--model", kModel.string()});
  EXPECT_EQ(path.exit_code, 2) << path.out;
  EXPECT_NE(path.err.find("--model-dir"), std::string::npos) << path.err;
  const std::string partial = "partial.yaml";
  std::filesystem::rename(write_partial_model(system), system.path("models/" + partial));
  EXPECT_EQ(system.control({"adopt", "--model", partial, "--gyro-id", "7"}).exit_code, 1);
  EXPECT_FALSE(answers.any([](const auto& answer) {
    return answer.rung()[0] == static_cast<std::uint8_t>(core::Rung::kPrior);
  }));
  ASSERT_EQ(system.control({"checkpoint"}).exit_code, 0);

  const std::size_t before = answers.size();
  const Finished adopted = system.control({"adopt", "--model", partial, "--gyro-id", "1"});
  ASSERT_EQ(adopted.exit_code, 0) << adopted.out << adopted.err;
  EXPECT_NE(adopted.out.find("adopted partial, 2 effects"), std::string::npos) << adopted.out;
  EXPECT_NE(adopted.out.find("model epoch"), std::string::npos) << adopted.out;
  ASSERT_TRUE(comes(before, core::Rung::kPrior));
  EXPECT_TRUE(eventually([&] { return told(events, "command_adopt", "adopted partial"); }));
  const Finished foreign = system.control({"restore"});
  EXPECT_EQ(foreign.exit_code, 1);
  EXPECT_NE(foreign.out.find("was made with another prior than is configured"), std::string::npos)
      << foreign.out;

  const std::size_t during = answers.size();
  const Finished reverted = system.control({"revert"});
  ASSERT_EQ(reverted.exit_code, 0) << reverted.out << reverted.err;
  EXPECT_NE(reverted.out.find("reverted to no prior, model epoch"), std::string::npos)
      << reverted.out;
  ASSERT_TRUE(comes(during, core::Rung::kStack));
  EXPECT_TRUE(eventually([&] { return told(events, "command_revert", "reverted"); }));
  EXPECT_EQ(system.control({"restore"}).exit_code, 0);
  const auto all = answers.all();
  for (std::size_t k = 1; k < all.size(); ++k)
    ASSERT_GE(all[k].model_epoch(), all[k - 1].model_epoch()) << k;
}

}  // namespace
}  // namespace zerodrift::system_test
