// SPDX-License-Identifier: Apache-2.0
// A checkpoint as bytes: the envelope and the message of idl/proto/checkpoint.proto. The same state
// gives the same bytes.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <string_view>

#include "common/compensation/compensator.h"
#include "common/compensation/learner.h"
#include "common/compensation/options.h"

namespace zerodrift::checkpoint {

inline constexpr std::uint32_t kFormatVersion = 2;
inline constexpr std::size_t kEnvelopeSize = 24;

// Whose checkpoint it is: only a learner of the same gyro under the same deciding options may
// continue it.
struct Owner {
  std::uint32_t gyro_id;
  const compensation::CompensationOptions& options;
};

[[nodiscard]] std::string encode(const Owner& owner, const compensation::LearnerState& state);

// Throws CheckpointError: not a checkpoint, truncated, damaged, of another format version, gyro,
// layout or configuration. Every truncation and every change of up to 32 successive bits is
// recognised before anything is made of the contents (CRC-32).
[[nodiscard]] compensation::LearnerState decode(std::string_view bytes, const Owner& owner);

// The kernels alone, which outlive an upgrade: of any layout, and of options that differ in none
// that both programs have. Throws CheckpointError.
[[nodiscard]] compensation::LearnerState decode_kernels(std::string_view bytes, const Owner& owner);

// Everything a compensator is: what it learned and what its data path holds, for another instance
// of the same build that goes on from there to the bit. `data_path` is Compensator::carry()'s,
// `prior` the text of the owner's prior, which may have been adopted since the start.
[[nodiscard]] std::string encode_running(const Owner& owner,
                                         const compensation::LearnerState& state,
                                         std::string data_path, const std::string& prior = {});
// That text. Throws CheckpointError where it is no checkpoint.
[[nodiscard]] std::string prior_of_running(std::string_view bytes);

// A compensator in that state. Throws CheckpointError: whatever decode() refuses, another version
// of the program, other options of the data path, or a state that doesn't fit them.
[[nodiscard]] std::unique_ptr<compensation::Compensator> decode_running(std::string_view bytes,
                                                                        const Owner& owner);

}  // namespace zerodrift::checkpoint
