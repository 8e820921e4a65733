// SPDX-License-Identifier: Apache-2.0
// Checkpoints as files.
#pragma once

#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>
#include <string_view>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"

namespace zerodrift::checkpoint {

// The file appears whole or not at all (files::AtomicFile) and replaces an older one of that name.
// Throws files::FileError where it can't be written.
void save(const std::filesystem::path& path, const Owner& owner,
          const compensation::LearnerState& state);

// Checkpoints of one gyro that a folder holds at most by command: disks end.
inline constexpr std::size_t kMostOfAGyro = 16;

// Why no checkpoint of a new name can be saved as `path`, "<folder>/<gyro>-<name>.ckpt", one line;
// empty: it can, or replaces one.
[[nodiscard]] std::string why_no_place(const std::filesystem::path& path);
inline constexpr std::size_t kLargestFile = 1U << 30U;  // far above the largest learner's

// Ready to be put into a learner. Throws CheckpointError with one line that names the file: not
// there, whatever decode() refuses, or values that no learner has. Its age is what sensor time
// says, as in a record.
[[nodiscard]] std::shared_ptr<compensation::RestoredLearner> load(const std::filesystem::path& path,
                                                                  const Owner& owner);
// The same of bytes that were read. Where a service saved it on another boot of the computer than
// `boot`, the gyro was off meanwhile: its age isn't known. Empty: sensor time says it.
[[nodiscard]] std::shared_ptr<compensation::RestoredLearner> restored_from(std::string_view bytes,
                                                                           const Owner& owner,
                                                                           const std::string& boot);

// What a program goes on with when it starts.
struct Resumed {
  std::shared_ptr<compensation::RestoredLearner> learner;
  std::string left_behind{};  // why only the kernels could be used, one line; empty: all is there
};

// As load() and, for `boot`, restored_from(), but of a checkpoint of another layout it takes the
// kernels. Throws CheckpointError where not even those can be used.
[[nodiscard]] Resumed resume(const std::filesystem::path& path, const Owner& owner,
                             const std::string& boot);

}  // namespace zerodrift::checkpoint
