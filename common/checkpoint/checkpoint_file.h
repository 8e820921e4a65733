// SPDX-License-Identifier: Apache-2.0
// Checkpoints as files.
#pragma once

#include <filesystem>
#include <memory>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"

namespace zerodrift::checkpoint {

// The file appears whole or not at all (record::AtomicFile) and replaces an older one of that name.
// Throws record::RecordError where it can't be written.
void save(const std::filesystem::path& path, const Owner& owner,
          const compensation::LearnerState& state);

// Ready to be put into a learner. Throws CheckpointError with one line that names the file: not
// there, whatever decode() refuses, or values that no learner has.
[[nodiscard]] std::shared_ptr<compensation::RestoredLearner> load(const std::filesystem::path& path,
                                                                  const Owner& owner);

}  // namespace zerodrift::checkpoint
