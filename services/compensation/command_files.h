// SPDX-License-Identifier: Apache-2.0
// What commands over the network may read and write: files of two configured folders, by plain
// names. A refusal quotes the command's own arguments, cleaned, and never what a file holds.
#pragma once

#include <cstdint>
#include <filesystem>
#include <memory>
#include <stdexcept>
#include <string>

#include "common/checkpoint/checkpoint_file.h"
#include "common/compensation/model_schedule.h"
#include "common/compensation/options.h"
#include "common/twin/model.h"

namespace zerodrift::services {

// Answers the command; one line that anybody may read.
class CommandRefused : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

// What a service saves of itself, over and over.
inline constexpr const char* kLatestCheckpoint = "latest";

// Empty: "saved", which nobody writes over but a command. Throws CommandRefused where it is no
// name.
[[nodiscard]] std::string checkpoint_name(const std::string& argument);
// "1-saved.ckpt"
[[nodiscard]] std::string checkpoint_file_name(std::uint32_t gyro_id, const std::string& name);

// Gives the latest checkpoint of a gyro a name of its own, which no save writes over, and says it:
// "refused", "refused-2"... Empty: it stays where it is.
[[nodiscard]] std::string put_aside(const std::filesystem::path& folder, std::uint32_t gyro_id);

// "5 s ago" of a checkpoint that says when it was saved, 0 where it doesn't; the clock may have
// been set back since then.
[[nodiscard]] std::string how_long_ago(std::int64_t saved_unix_s, std::int64_t now_unix_s);

// Throws std::invalid_argument with one line where no checkpoint can be saved in the folder. A full
// disk is no reason: it may be cleared. Leaves nothing behind; an empty folder means that none is
// configured.
void require_place_of_checkpoints(const std::filesystem::path& folder);

// Both throw CommandRefused. What is saved says when and on which boot of the computer it was; what
// is restored on another one is of unknown age.
[[nodiscard]] std::shared_ptr<compensation::RestoredLearner> checkpoint_named(
    const std::filesystem::path& folder, const std::string& name, const checkpoint::Owner& owner);
void save_as(const std::filesystem::path& folder, const std::string& name,
             const checkpoint::Owner& owner, compensation::LearnerState state);

// A model file of `folder` that can be a prior. Throws CommandRefused; an empty folder means that
// none is configured.
[[nodiscard]] twin::Model model_named(const std::filesystem::path& folder, const std::string& name);

// That model as prior. Throws CommandRefused where it reads temperatures that the options have no
// probe of: how many, and which probes they have.
[[nodiscard]] std::shared_ptr<compensation::PriorChange> change_to(
    const twin::Model& model, const std::string& name,
    const compensation::CompensationOptions& options);

}  // namespace zerodrift::services
