// SPDX-License-Identifier: Apache-2.0
// Rule: a command reads models and checkpoints of their folders, by name, and nothing else; its
// refusal quotes its own arguments and nothing else.
#include "services/compensation/command_files.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <chrono>
#include <cstdint>
#include <filesystem>
#include <fstream>
#include <limits>
#include <sstream>
#include <string>

#include "common/compensation/drift_prior.h"
#include "common/core/one_line.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::services {
namespace {

namespace fs = std::filesystem;

constexpr const char* kModel =
    "format_version: 1\ngyro_id: lab\neffects:\n"
    "  - {kind: polynomial_bias, axis: x, parameters: {a0_deg_h: 1}}\n";

class CommandFiles : public ScratchFolder {
 protected:
  template <typename Act>
  std::string refusal(const Act& act) const {
    try {
      act();
      return "no refusal";
    } catch (const CommandRefused& refused) {
      const std::string text = refused.what();
      EXPECT_TRUE(core::is_one_line(text)) << text;
      EXPECT_EQ(text.find(folder_.string()), std::string::npos) << text;
      return text;
    }
  }
  [[nodiscard]] std::string model_refusal(const std::string& name) const {
    return refusal([&] { (void)model_named(folder_, name); });
  }
  [[nodiscard]] std::string restore_refusal(const std::string& argument) const {
    return refusal([&] {
      (void)checkpoint_named(folder_, checkpoint_name(argument),
                             {.gyro_id = 1, .options = options_});
    });
  }

  compensation::CompensationOptions options_{};
};

TEST_F(CommandFiles, AModelOfTheFolderIsTaken) {
  fs::copy_file(fs::path(ZERODRIFT_SOURCE_DIR) / "config/models/lab_fog.yaml",
                folder_ / "lab.yaml");
  EXPECT_EQ(model_named(folder_, "lab.yaml").gyro_id, "lab_fog");
  EXPECT_EQ(model_refusal("none.yaml"), "'none.yaml': no such file in the service's folder");
  EXPECT_NE(refusal([] { (void)model_named("", "lab.yaml"); }).find("--model-dir"),
            std::string::npos);
}

// Each holds the word "secret" where an error for the operator would quote it.
class SecretAbuse : public CommandFiles, public testing::WithParamInterface<std::string> {};

TEST_P(SecretAbuse, IsNotQuotedByARefusalOfAModel) {
  write("x.yaml", GetParam());
  const std::string text = model_refusal("x.yaml");
  EXPECT_TRUE(text.starts_with("model 'x.yaml' can't be a prior")) << text;
  EXPECT_EQ(text.find("secret"), std::string::npos) << text;
}

TEST_P(SecretAbuse, IsNotQuotedByARefusalOfACheckpoint) {
  write("1-x.ckpt", GetParam());
  const std::string text = restore_refusal("x");
  EXPECT_TRUE(text.starts_with("'1-x.ckpt' is ")) << text;
  EXPECT_EQ(text.find("secret"), std::string::npos) << text;
}

INSTANTIATE_TEST_SUITE_P(
    All, SecretAbuse,
    testing::Values("-----BEGIN PRIVATE KEY-----\nsecret\n-----END PRIVATE KEY-----\n", "secret",
                    "secret: 1\n", "root:secret:0:0:root:/root:/bin/bash\n", "- secret\n",
                    "gyro_id: a\ngyro_id: secret\n", "nominal_rate_hz: secret\n",
                    "effects: secret\n", "effects:\n  - {kind: secret, axis: x}\n",
                    "effects:\n  - {kind: bias, axis: secret, parameters: {bias_deg_h: 1}}\n",
                    "effects:\n  - {kind: bias, axis: x, parameters: {secret: 1}}\n",
                    "effects:\n  - {kind: bias, axis: x, parameters: {bias_deg_h: secret}}\n",
                    "probes: [{name: secret, mount: 1}]\n", "gyro_id: secret\n", "'secret\n",
                    "a: &secret [*secret]\n", "a: *secret\n", "%secret\n---\n", "!secret {}\n",
                    "---\nsecret\n---\n", "format_version: 99\nsecret: [1, 2]\n",
                    "gyro_id: [secret]\n", "{secret", "\tsecret", "? secret\n: [\n"));

TEST_F(CommandFiles, ARefusalOfAModelTellsItsLine) {
  write("x.yaml", "format_version: 1\n\nnominal_rate_hz: secret\n");
  EXPECT_EQ(
      model_refusal("x.yaml"),
      "model 'x.yaml' can't be a prior: line 3; `zerodrift compensate --prior` where the file "
      "lies tells why");
}

// The probes that it lacks are the file's: only those of the configuration are named.
TEST_F(CommandFiles, ARefusalOfAModelTellsHowManyProbesItLacksAndWhichThereAre) {
  const auto effect = [](const std::string& axis, const std::string& place) {
    return "  - {kind: shupe, axis: " + axis +
           ", parameters: {coefficient_deg_h_min_per_degc: 1}, inputs: [" + place + "]}\n";
  };
  const auto adopted = [&](const std::string& effects) {
    write("x.yaml", "format_version: 1\neffects:\n" + effects);
    return change_to(model_named(folder_, "x.yaml"), "x.yaml", options_);
  };
  EXPECT_EQ(refusal([&] { (void)adopted(effect("x", "chamber")); }),
            "model 'x.yaml' reads 1 temperature that is not configured; name the probe under "
            "probes in the service's --config, which has coil");
  EXPECT_EQ(
      refusal([&] { (void)adopted(effect("x", "chamber") + effect("y", "board")); }),
      "model 'x.yaml' reads 2 temperatures that are not configured; name the probes under probes "
      "in the service's --config, which has coil");
  EXPECT_NE(adopted(effect("x", "coil")), nullptr);
  options_.more_probes = {"chamber"};
  EXPECT_NE(adopted(effect("x", "chamber")), nullptr);
}

TEST_F(CommandFiles, ARefusalOfACheckpointTellsItsKind) {
  compensation::Compensator compensator(options_);
  const auto state = compensator.learner().export_state();
  save_as(folder_, "good", {.gyro_id = 1, .options = options_}, state);
  std::ostringstream file;
  file << std::ifstream(folder_ / "1-good.ckpt", std::ios::binary).rdbuf();
  const std::string bytes = file.str();
  EXPECT_NE(checkpoint_named(folder_, "good", {.gyro_id = 1, .options = options_}), nullptr);

  std::string flipped = bytes;
  flipped.back() = static_cast<char>(flipped.back() ^ 1);
  write("1-flipped.ckpt", flipped);
  EXPECT_EQ(restore_refusal("flipped"), "'1-flipped.ckpt' is damaged");
  write("1-cut.ckpt", bytes.substr(0, bytes.size() - 1));
  EXPECT_EQ(restore_refusal("cut"), "'1-cut.ckpt' is truncated or damaged");
  EXPECT_EQ(restore_refusal("none"), "'1-none.ckpt': no such file in the service's folder");
  fs::copy_file(folder_ / "1-good.ckpt", folder_ / "2-good.ckpt");
  EXPECT_EQ(refusal([&] {
              (void)checkpoint_named(folder_, "good", {.gyro_id = 2, .options = options_});
            }),
            "'2-good.ckpt' is of another gyro");
  compensation::CompensationOptions other;
  other.model.epsilon *= 2;
  EXPECT_TRUE(refusal([&] {
                (void)checkpoint_named(folder_, "good", {.gyro_id = 1, .options = other});
              }).starts_with("'1-good.ckpt' was made with another "));
}

TEST_F(CommandFiles, ASaveThatFailsTellsWhyAndNotWhere) {
  compensation::Compensator compensator(options_);
  const auto state = compensator.learner().export_state();
  const checkpoint::Owner owner{.gyro_id = 1, .options = options_};
  fs::create_directory(folder_ / "1-taken.ckpt");
  EXPECT_EQ(refusal([&] { save_as(folder_, "taken", owner, state); }),
            "'1-taken.ckpt': is a folder, a disk or a socket, expected a file to write");
  fs::remove_all(folder_);
  EXPECT_EQ(refusal([&] { save_as(folder_, "x", owner, state); }),
            "'1-x.ckpt': cannot create a file in its folder: No such file or directory");
}

// Rule: what a service saves says on which boot of the computer; what another one saved is of a
// gyro that was off.
TEST_F(CommandFiles, ACheckpointOfAnotherBootIsOfUnknownAge) {
  compensation::Compensator compensator(options_);
  auto state = compensator.learner().export_state();
  const checkpoint::Owner owner{.gyro_id = 1, .options = options_};
  save_as(folder_, "own", owner, state);
  EXPECT_FALSE(checkpoint_named(folder_, "own", owner)->is_of_unknown_age);
  state.boot = "another";
  checkpoint::save(folder_ / "1-other.ckpt", owner, state);
  EXPECT_TRUE(checkpoint_named(folder_, "other", owner)->is_of_unknown_age);
}

// Before: the age was that of the file, so that a backup copied back was "saved 0 s ago".
TEST_F(CommandFiles, ACheckpointSaysWhenItWasSavedWhateverBecomesOfItsFile) {
  compensation::Compensator compensator(options_);
  auto state = compensator.learner().export_state();
  const checkpoint::Owner owner{.gyro_id = 1, .options = options_};
  const auto before = std::chrono::system_clock::now();
  save_as(folder_, "own", owner, state);
  fs::last_write_time(folder_ / "1-own.ckpt",
                      fs::file_time_type::clock::now() - std::chrono::hours(24 * 40));
  const std::int64_t saved_s = checkpoint_named(folder_, "own", owner)->saved_unix_s;
  EXPECT_GE(saved_s, std::chrono::system_clock::to_time_t(before));
  EXPECT_LE(saved_s, std::chrono::system_clock::to_time_t(std::chrono::system_clock::now()));
  checkpoint::save(folder_ / "1-older.ckpt", owner, state);
  EXPECT_EQ(checkpoint_named(folder_, "older", owner)->saved_unix_s, 0);
}

// Before: "saved -2591999 s ago" where the clock had been set back by a month.
TEST_F(CommandFiles, AnAgeIsSaidInItsOrderOfMagnitudeAndOneThatTheClockMakesNegativeInWords) {
  constexpr std::int64_t kNow = 1'700'000'000;
  constexpr std::int64_t kHour = 3600;
  const auto ago = [](std::int64_t age_s) { return how_long_ago(kNow - age_s, kNow); };
  EXPECT_EQ(ago(61), "61 s ago");
  EXPECT_EQ(ago(0), "0 s ago");
  EXPECT_EQ(ago(2 * kHour - 1), "7199 s ago");
  EXPECT_EQ(ago(2 * kHour), "2 hours ago");
  EXPECT_EQ(ago(48 * kHour - 1), "47 hours ago");
  EXPECT_EQ(ago(40 * 24 * kHour), "40 days ago");
  EXPECT_EQ(ago(-1), "at a time that is still to come by this clock");
  EXPECT_EQ(how_long_ago(std::numeric_limits<std::int64_t>::max(), kNow),
            "at a time that is still to come by this clock");
  EXPECT_EQ(how_long_ago(std::numeric_limits<std::int64_t>::min(), kNow), "19675 days ago");
  EXPECT_EQ(how_long_ago(0, kNow), "at a time that it doesn't say");
}

// Before: one that can't be written was accepted, and told of with the first checkpoint alone.
// Nobody can create a file in /proc, root neither.
TEST_F(CommandFiles, AFolderThatNoCheckpointCanBeSavedInIsRefusedAndAnyOtherStaysAsItIs) {
  EXPECT_NO_THROW(require_place_of_checkpoints(""));
  EXPECT_NO_THROW(require_place_of_checkpoints(folder_));
  EXPECT_TRUE(fs::is_empty(folder_));
  try {
    require_place_of_checkpoints("/proc");
    ADD_FAILURE();
  } catch (const std::invalid_argument& error) {
    EXPECT_STREQ(
        error.what(),
        "--checkpoint-dir: found '/proc', in which no file can be created (No such file or "
        "directory), expected a folder that this user may write to");
  }
}

// Names are tried in tests/unit/files/named_file_test.cpp.
TEST_F(CommandFiles, ABadNameIsRefusedBeforeAnythingIsOpened) {
  for (const char* name : {"../x", "/etc/passwd", "a\nb", ".."}) {
    EXPECT_NE(restore_refusal(name).find("expected 1 to 64 of letters"), std::string::npos);
    EXPECT_NE(model_refusal(name).find("expected 1 to 64 of letters"), std::string::npos);
  }
  EXPECT_EQ(checkpoint_name(""), "saved");
}

}  // namespace
}  // namespace zerodrift::services
