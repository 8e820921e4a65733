// SPDX-License-Identifier: Apache-2.0
// What allan says, as the message that is published.
#pragma once

#include "common/allan/stream_statistics.h"
#include "common/dds/topics.h"

namespace zerodrift::services {

// All but whose report it is, its time and the watches' verdicts. Points beyond the sequence's
// bound of 160 are left out.
[[nodiscard]] msg::AllanReport to_message(const allan::StreamReport& report);

}  // namespace zerodrift::services
