// SPDX-License-Identifier: Apache-2.0
// Checkpoints as files: whole or not at all, and one line that names the file.
#include "common/checkpoint/checkpoint_file.h"

#include <gtest/gtest.h>
#include <stdlib.h>

#include <fstream>
#include <iterator>
#include <sstream>
#include <stdexcept>
#include <string>
#include <utility>

#include "common/files/file_error.h"
#include "idl/proto/checkpoint.pb.h"
#include "tests/support/scratch_folder.h"
#include "tests/unit/checkpoint/envelope.h"
#include "tests/unit/checkpoint/saved_learner.h"

namespace zerodrift::checkpoint {
namespace {

using testing::Bench;
using testing::saved_after;
using testing::small_options;

constexpr const char* kBoot = "0d3f";

class CheckpointFile : public ScratchFolder {
 protected:
  [[nodiscard]] std::string content(const char* name) const {
    std::ifstream file(path(name), std::ios::binary);
    std::ostringstream bytes;
    bytes << file.rdbuf();
    return bytes.str();
  }
  [[nodiscard]] std::string refusal(const char* name) const {
    try {
      static_cast<void>(load(path(name), owner_));
    } catch (const CheckpointError& error) {
      return error.what();
    }
    return "";
  }

  compensation::CompensationOptions options_ = small_options();
  Owner owner_{1, options_};
};

TEST_F(CheckpointFile, WhatIsLoadedIsWhatWasSaved) {
  const auto state = saved_after(40);
  save(path("a.ckpt"), owner_, state);
  EXPECT_EQ(content("a.ckpt"), encode(owner_, state));
  Bench bench(options_);
  bench.restore(load(path("a.ckpt"), owner_));
  EXPECT_EQ(encode(owner_, bench.state()), encode(owner_, state));
  EXPECT_TRUE(bench.active().axes[0].drift.trained);
}

TEST_F(CheckpointFile, SavingReplacesAnOlderOneAndLeavesNothingElse) {
  save(path("a.ckpt"), owner_, saved_after(40));
  save(path("a.ckpt"), owner_, saved_after(50));
  EXPECT_EQ(content("a.ckpt"), encode(owner_, saved_after(50)));
  const std::filesystem::directory_iterator files(folder_);
  EXPECT_EQ(std::distance(begin(files), end(files)), 1);
}

// Whoever may command could fill the disk otherwise.
TEST_F(CheckpointFile, OfOneGyroThereAreSixteenNamesAtMost) {
  const auto touch = [&](const std::string& name) { std::ofstream(path(name.c_str())) << name; };
  for (std::size_t k = 0; k < kMostOfAGyro; ++k) {
    const std::string name = "1-" + std::to_string(k) + ".ckpt";
    EXPECT_EQ(why_no_place(path(name.c_str())), "") << k;
    touch(name);
  }
  EXPECT_NE(why_no_place(path("1-another.ckpt")), "");
  EXPECT_EQ(why_no_place(path("1-3.ckpt")), "") << "it replaces one";
  EXPECT_EQ(why_no_place(path("11-another.ckpt")), "") << "of another gyro";
}

TEST_F(CheckpointFile, WhereItCannotBeWrittenTheErrorNamesIt) {
  try {
    save(path("no/such/folder.ckpt"), owner_, saved_after(5));
    FAIL() << "written into a folder that isn't there";
  } catch (const files::FileError& error) {
    EXPECT_NE(std::string(error.what()).find("folder.ckpt"), std::string::npos) << error.what();
  }
}

// Rule: a program goes on with all that a checkpoint holds; after an upgrade with its kernels, and
// the line says why; with nothing where not even those can be used.
TEST_F(CheckpointFile, AfterAnUpgradeAProgramGoesOnWithItsKernels) {
  save(path("all"), owner_, saved_after(40));
  EXPECT_EQ(resume(path("all"), owner_, kBoot).left_behind, "");
  EXPECT_EQ(resume(path("all"), owner_, kBoot).learner->epoch, 40U);

  proto::Checkpoint message;
  message.ParseFromString(content("all").substr(kEnvelopeSize));
  message.set_layout(message.layout() + 1);
  std::ofstream(path("upgraded"), std::ios::binary) << testing::wrap(message.SerializeAsString());
  const Resumed resumed = resume(path("upgraded"), owner_, kBoot);
  EXPECT_EQ(resumed.left_behind, refusal("upgraded"));
  EXPECT_NE(resumed.left_behind.find("layout"), std::string::npos);
  EXPECT_EQ(resumed.learner->epoch, 41U);
  EXPECT_EQ(resumed.learner->labels, 0U);

  for (const char* name : {"none", "damaged"}) {
    std::ofstream(path("damaged"), std::ios::binary) << content("all").substr(0, 100);
    try {
      (void)resume(path(name), owner_, kBoot);
      ADD_FAILURE() << name;
    } catch (const CheckpointError& error) {
      EXPECT_EQ(error.what(), refusal(name));
    }
  }
}

// Rule: a gyro was off where another boot of the computer saved what is known of it; on the same
// boot, or where a record was learned, its clock tells.
TEST_F(CheckpointFile, AfterAnotherBootTheGyroWasOff) {
  const auto is_of_unknown_age = [&](const char* boot) {
    compensation::LearnerState state = saved_after(40);
    state.boot = boot;
    save(path("a"), owner_, state);
    EXPECT_FALSE(load(path("a"), owner_)->is_of_unknown_age) << "of a record";
    EXPECT_FALSE(resume(path("a"), owner_, "").learner->is_of_unknown_age) << "nobody knows";
    return resume(path("a"), owner_, kBoot).learner->is_of_unknown_age;
  };
  EXPECT_TRUE(is_of_unknown_age("77aa"));
  EXPECT_FALSE(is_of_unknown_age(kBoot));
  EXPECT_FALSE(is_of_unknown_age(""));
}

// A file of 1 TiB, of which nothing is on the disk.
TEST_F(CheckpointFile, OneThatIsTooLargeIsRefusedUnread) {
  std::ofstream(path("large")).close();
  std::filesystem::resize_file(path("large"), std::uintmax_t{1} << 40U);
  EXPECT_NE(refusal("large").find("holds more than the 1073741824 bytes"), std::string::npos)
      << refusal("large");
}

TEST_F(CheckpointFile, EveryRefusalIsOneLineThatNamesTheFile) {
  std::filesystem::create_directory(path("folder"));
  save(path("good"), owner_, saved_after(40));
  const std::string good = content("good");
  std::ofstream(path("empty")).close();
  std::ofstream(path("cut"), std::ios::binary) << good.substr(0, good.size() / 2);
  std::string flipped = good;
  flipped[good.size() / 2] = static_cast<char>(flipped[good.size() / 2] ^ 4);
  std::ofstream(path("flipped"), std::ios::binary) << flipped;
  save(path("other"), {2, options_}, saved_after(40));
  auto state = saved_after(40);
  state.bytes.back() = '\xff';  // of the last axis's scale
  save(path("senseless"), owner_, state);

  EXPECT_EQ(refusal("good"), "");
  for (const auto& [name, what] :
       {std::pair{"none", "No such file"},
        std::pair{"folder", "is a folder, expected a regular file"},
        std::pair{"empty", "something else than a checkpoint"}, std::pair{"cut", "truncated"},
        std::pair{"flipped", "CRC-32"}, std::pair{"other", "gyro 2, expected one of gyro 1"},
        std::pair{"senseless", "no learner has"}}) {
    const std::string line = refusal(name);
    EXPECT_EQ(line.rfind(path(name).string() + ": ", 0), 0U) << line;
    EXPECT_NE(line.find(what), std::string::npos) << line;
    EXPECT_EQ(line.find('\n'), std::string::npos) << line;
  }
}

}  // namespace
}  // namespace zerodrift::checkpoint
