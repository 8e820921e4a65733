// SPDX-License-Identifier: Apache-2.0
#include "common/checkpoint/checkpoint_file.h"

#include <cerrno>
#include <cstring>
#include <fstream>
#include <stdexcept>
#include <string>
#include <system_error>

#include "common/record/atomic_file.h"

namespace zerodrift::checkpoint {
namespace {

constexpr std::uintmax_t kLargestFile = 1U << 30U;  // far above the largest learner's

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

}  // namespace

void save(const std::filesystem::path& path, const Owner& owner,
          const compensation::LearnerState& state) {
  const std::string bytes = encode(owner, state);
  record::AtomicFile file(path);
  file.append(bytes);
  file.commit();
}

std::shared_ptr<compensation::RestoredLearner> load(const std::filesystem::path& path,
                                                    const Owner& owner) {
  try {
    return std::make_shared<compensation::RestoredLearner>(owner.options,
                                                           decode(content(path), owner));
  } catch (const CheckpointError& error) {
    throw CheckpointError(path.string() + ": " + error.what());
  } catch (const std::invalid_argument& error) {
    throw CheckpointError(path.string() + ": found values that no learner has: " + error.what());
  }
}

}  // namespace zerodrift::checkpoint
