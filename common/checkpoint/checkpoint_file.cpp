// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/checkpoint_file.h"

#include <stdexcept>
#include <string>
#include <system_error>

#include "common/files/atomic_file.h"
#include "common/files/file_error.h"
#include "common/files/input_file.h"

namespace zerodrift::checkpoint {
namespace {

std::string content(const std::filesystem::path& path) {
  try {
    return files::read_whole_file(path, kLargestFile);
  } catch (const files::FileError& error) {
    throw CheckpointError(error.what());
  }
}

std::shared_ptr<compensation::RestoredLearner> made_from(const compensation::LearnerState& state,
                                                         const Owner& owner) {
  try {
    auto learner = std::make_shared<compensation::RestoredLearner>(owner.options, state);
    learner->saved_unix_s = state.saved_unix_s;
    return learner;
  } catch (const std::invalid_argument& error) {
    throw CheckpointError(std::string("found values that no learner has: ") + error.what());
  }
}

// What `bytes` hold of the file at `path`, which a refusal names.
std::shared_ptr<compensation::RestoredLearner> held_by(const std::string& bytes, const Owner& owner,
                                                       const std::filesystem::path& path,
                                                       const std::string& boot) {
  try {
    return restored_from(bytes, owner, boot);
  } catch (const CheckpointError& error) {
    throw CheckpointError(path.string() + ": " + error.what(), error.kind());
  }
}

}  // namespace

std::string why_no_place(const std::filesystem::path& path) {
  std::error_code error;
  if (std::filesystem::exists(path, error)) return "";
  const std::string name = path.filename().string();
  const std::string of_gyro = name.substr(0, name.find('-') + 1);
  std::size_t held = 0;
  for (const auto& entry : std::filesystem::directory_iterator(path.parent_path(), error)) {
    const auto& file = entry.path();
    if (file.extension() == path.extension() && file.filename().string().starts_with(of_gyro))
      ++held;
  }
  if (held < kMostOfAGyro) return "";
  return "this gyro has " + std::to_string(held) +
         " checkpoints already; save under the name of one of them, or remove one";
}

void save(const std::filesystem::path& path, const Owner& owner,
          const compensation::LearnerState& state) {
  const std::string bytes = encode(owner, state);
  files::AtomicFile file(path);
  file.append(bytes);
  file.commit();
}

std::shared_ptr<compensation::RestoredLearner> restored_from(std::string_view bytes,
                                                             const Owner& owner,
                                                             const std::string& boot) {
  const compensation::LearnerState state = decode(bytes, owner);
  auto learner = made_from(state, owner);
  if (!boot.empty() && !state.boot.empty() && state.boot != boot) learner->forget_age();
  return learner;
}

std::shared_ptr<compensation::RestoredLearner> load(const std::filesystem::path& path,
                                                    const Owner& owner) {
  return held_by(content(path), owner, path, "");
}

Resumed resume(const std::filesystem::path& path, const Owner& owner, const std::string& boot) {
  const std::string bytes = content(path);
  try {
    return {.learner = held_by(bytes, owner, path, boot)};
  } catch (const CheckpointError& refused) {
    try {
      return {.learner = made_from(decode_kernels(bytes, owner), owner),
              .left_behind = refused.what()};
    } catch (const CheckpointError&) {
      throw refused;
    }
  }
}

}  // namespace zerodrift::checkpoint
