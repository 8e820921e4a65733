// SPDX-License-Identifier: Apache-2.0
#include "common/service/large_blocks.h"

#include <malloc.h>

namespace zerodrift::service {

void return_large_blocks() {
  mallopt(M_MMAP_THRESHOLD, static_cast<int>(kLargeBlock));
}

}  // namespace zerodrift::service
