// SPDX-License-Identifier: Apache-2.0
// How several instances distinguish each other's answers from their own: an instance writes in the
// partition that everybody reads and in one of its own, and reads those of the others. What they
// compare of an answer is all that was computed, not who answered, nor when.
#pragma once

#include <cstdint>

#include "common/dds/participant.h"
#include "common/service/instance_sync.h"

namespace zerodrift::services {

[[nodiscard]] dds::Partitions partitions_to_write(std::uint32_t instance);
[[nodiscard]] dds::Partitions partitions_of_others(std::uint32_t instance);

[[nodiscard]] service::AnswerMark mark_of(const msg::CompensatedRate& answer) noexcept;

}  // namespace zerodrift::services
