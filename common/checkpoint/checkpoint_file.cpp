// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/checkpoint_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "common/files/atomic_file.h"

namespace zerodrift::checkpoint {
namespace {

std::string content(const std::filesystem::path& path) {
  std::error_code error;
  const auto status = std::filesystem::status(path, error);
  if (!std::filesystem::exists(status)) {
    throw CheckpointError("found no such file, expected a checkpoint");
  }
  if (!std::filesystem::is_regular_file(status)) {
    throw CheckpointError("found a folder or device, expected a checkpoint file");
  }
  const std::uintmax_t size = std::filesystem::file_size(path, error);
  std::ifstream file(path, std::ios::binary);
  if (error || !file) {
    throw CheckpointError(std::string("cannot be read: ") + std::strerror(errno));
  }
  if (size > kLargestFile) {
    throw CheckpointError("found " + std::to_string(size) +
                          " bytes, expected a checkpoint of at most " +
                          std::to_string(kLargestFile));
  }
  std::string bytes(static_cast<std::size_t>(size), '\0');
  file.read(bytes.data(), static_cast<std::streamsize>(size));
  bytes.resize(static_cast<std::size_t>(file.gcount()));
  return bytes;
}

std::shared_ptr<compensation::RestoredLearner> made_from(const compensation::LearnerState& state,
                                                         const Owner& owner) {
  try {
    return std::make_shared<compensation::RestoredLearner>(owner.options, state);
  } catch (const std::invalid_argument& error) {
    throw CheckpointError(std::string("found values that no learner has: ") + error.what());
  }
}

CheckpointError named(const std::filesystem::path& path, const CheckpointError& error) {
  return CheckpointError(path.string() + ": " + error.what(), error.kind());
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
                                                             const Owner& owner) {
  return made_from(decode(bytes, owner), owner);
}

std::shared_ptr<compensation::RestoredLearner> load(const std::filesystem::path& path,
                                                    const Owner& owner) {
  try {
    return restored_from(content(path), owner);
  } catch (const CheckpointError& error) {
    throw named(path, error);
  }
}

Resumed resume(const std::filesystem::path& path, const Owner& owner) {
  try {
    return {.learner = load(path, owner)};
  } catch (const CheckpointError& refused) {
    try {
      return {.learner = made_from(decode_kernels(content(path), owner), owner),
              .left_behind = refused.what()};
    } catch (const CheckpointError&) {
      throw refused;
    }
  }
}

}  // namespace zerodrift::checkpoint
