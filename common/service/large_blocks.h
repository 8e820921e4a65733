// SPDX-License-Identifier: Apache-2.0
// Where large blocks of memory lie.
#pragma once

#include <cstddef>

namespace zerodrift::service {

// 512 KiB: above all that is allocated often, below an axis's kernel rows and a state on its way.
inline constexpr std::size_t kLargeBlock = std::size_t{1} << 19U;

// From now on each block of kLargeBlock bytes or more is a mapping of its own, which goes back to
// the system when it is freed. Without it glibc takes them from the common heap as soon as one has
// been freed, where small blocks stay in what they leave: a process that hands over states of
// 2 MB grows by as much now and then, without end in sight. A mapping costs some hundred
// microseconds for the pages of 2 MB, so this is for processes that run for months.
void return_large_blocks();

}  // namespace zerodrift::service
