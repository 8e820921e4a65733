// SPDX-License-Identifier: Apache-2.0
// Input: one byte, then bytes of what it says: f a whole checkpoint file; m the message
// (proto::Checkpoint), whose envelope is put around it; a what an axis learned
// (proto::AxisCheckpoint), taken for all three and given the right owner, so that a fuzzer gets
// past the CRC and the owner's check.
#include <memory>
#include <stdexcept>
#include <string>

#include "common/checkpoint/checkpoint_bytes.h"
#include "common/checkpoint/checkpoint_error.h"
#include "common/checkpoint/checkpoint_file.h"
#include "common/compensation/option_keys.h"
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

// Nothing where the bytes are no axis.
std::string owned(std::string_view bytes, const CompensationOptions& options) {
  proto::AxisCheckpoint axis;
  if (!axis.ParseFromString(std::string(bytes))) return {};
  proto::Checkpoint message;
  message.set_gyro_id(kGyro);
  for (const auto& [key, value] :
       compensation::option_values(options, compensation::Decides::kModel)) {
    auto* option = message.add_options();
    option->set_key(key);
    option->set_value(value);
  }
  if (axis.model().has_time_ns()) message.set_newest_label_ns(axis.model().time_ns());
  for (std::size_t i = 0; i < core::kAxisCount; ++i) *message.mutable_learner()->add_axes() = axis;
  return message.SerializeAsString();
}

std::string file_of(char way, std::string_view content, const CompensationOptions& options) {
  if (way == 'm') return in_envelope(std::string(content));
  if (way == 'a') return in_envelope(owned(content, options));
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
    learn_on(checkpoint::load(file.path(), {kGyro, options}), options);
  } catch (const checkpoint::CheckpointError& error) {
    demand_one_line(error.what());
  }
}

}  // namespace zerodrift::fuzz
