// SPDX-License-Identifier: Apache-2.0
// A learner's state as a message and back: nothing is lost or rounded.
#pragma once

#include "common/compensation/learner_state.h"
#include "idl/proto/checkpoint.pb.h"

namespace zerodrift::checkpoint {

void to_message(const compensation::LearnerState& state, proto::LearnerCheckpoint& message);

// Throws CheckpointError where the numbers of things don't fit a learner; whether the values do,
// compensation::RestoredLearner checks.
[[nodiscard]] compensation::LearnerState from_message(const proto::LearnerCheckpoint& message);

}  // namespace zerodrift::checkpoint
