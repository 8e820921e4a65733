// SPDX-License-Identifier: Apache-2.0
// Input: one byte, then bytes of what it says: f a whole checkpoint file; m the message
// (proto::Checkpoint), whose envelope is put around it, and where it holds no learner, one that
// knows nothing into it; a what an axis learned (AxisLearner::carry()), taken for all three and
// given the right owner, so that a fuzzer gets past the CRC and the owner's check.
#include <memory>
#include <stdexcept>
#include <string>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"
#include "common/checkpoint/checkpoint_file.h"
#include "idl/proto/checkpoint.pb.h"
#include "tests/fuzz/checkpoint_envelope.h"
#include "tests/fuzz/expectations.h"
#include "tests/fuzz/scratch_file.h"
#include "tests/unit/checkpoint/saved_learner.h"

namespace zerodrift::fuzz {
namespace {

using compensation::CompensationOptions;

constexpr std::uint32_t kGyro = 7;
constexpr int kLabels = 12;  // more than the small learner's capacity

std::string owned(std::string_view axis, const CompensationOptions& options) {
  const compensation::ChosenKernel chosen{.kernel = options.model.kernel,
                                          .epsilon = options.model.epsilon};
  compensation::LearnerState state{.epoch = 1, .kernels = {chosen, chosen, chosen}};
  state.bytes = std::string(sizeof(std::uint64_t), '\0');  // labels
  for (std::size_t i = 0; i < core::kAxisCount; ++i) state.bytes += axis;
  return checkpoint::encode({kGyro, options}, state);
}

std::string with_a_learner(std::string_view bytes) {
  static const std::string new_learner = checkpoint::testing::saved_after(0).bytes;
  proto::Checkpoint message;
  if (!message.ParseFromString(std::string(bytes)) || !message.learner().empty())
    return std::string(bytes);
  message.set_learner(new_learner);
  return message.SerializeAsString();
}

std::string file_of(char way, std::string_view content, const CompensationOptions& options) {
  if (way == 'm') return in_envelope(with_a_learner(content));
  if (way == 'a') return owned(content, options);
  return std::string(content);
}

// A learner that was taken learns on and can be saved.
void learn_on(const std::shared_ptr<compensation::RestoredLearner>& restored,
              const CompensationOptions& options) {
  zerodrift::checkpoint::testing::Bench bench(options);
  bench.restore(restored);
  bench.learn(0, kLabels);
  static_cast<void>(checkpoint::encode({kGyro, options}, bench.state()));
}

}  // namespace

void checkpoint(Bytes input) {
  if (input.empty()) return;
  static const CompensationOptions options = zerodrift::checkpoint::testing::small_options();
  static ScratchFile file("learner.ckpt");
  file.fill(file_of(static_cast<char>(input.front()), as_text(input.subspan(1)), options));
  try {
    learn_on(checkpoint::resume(file.path(), {kGyro, options}, "another boot").learner, options);
  } catch (const checkpoint::CheckpointError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
