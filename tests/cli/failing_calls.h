// SPDX-License-Identifier: Apache-2.0
// A library that makes one call of a program fail: loaded before all others by LD_PRELOAD and told
// by the environment.
#pragma once

namespace zerodrift::cli_test {

// Files below this folder are watched: open for writing, write, fsync, fdatasync, close, rename.
inline constexpr const char* kFailFolder = "ZERODRIFT_FAIL_FOLDER";
// Which of these calls fails, from 1; and which allocation from the beginning of main() on.
inline constexpr const char* kFailCall = "ZERODRIFT_FAIL_CALL";
inline constexpr const char* kFailAllocation = "ZERODRIFT_FAIL_ALLOCATION";
inline constexpr const char* kFailThread = "ZERODRIFT_FAIL_THREAD";  // which start of a thread
// Not empty: and all that come after it, as on a disk that stays full.
inline constexpr const char* kFailForGood = "ZERODRIFT_FAIL_FOR_GOOD";
inline constexpr const char* kFailErrno = "ZERODRIFT_FAIL_ERRNO";  // of the file calls
// Written at the end, blanks between: the numbers of file calls, allocations, threads.
inline constexpr const char* kCounts = "ZERODRIFT_FAIL_COUNTS";

}  // namespace zerodrift::cli_test
