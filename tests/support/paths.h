// SPDX-License-Identifier: Apache-2.0
// Where the checkout, its data and its programs lie. Every test is compiled with `-include` of this
// file. The paths themselves stand in paths.cpp alone, so that no other object depends on the
// folder and the compiler's cache serves all checkouts.
#pragma once

namespace zerodrift::paths {

extern const char* const source_dir;
extern const char* const shared_dir;
extern const char* const binary_dir;
extern const char* const bin_dir;

}  // namespace zerodrift::paths

#define ZERODRIFT_SOURCE_DIR ::zerodrift::paths::source_dir
#define ZERODRIFT_SHARED_DIR ::zerodrift::paths::shared_dir
#define ZERODRIFT_BINARY_DIR ::zerodrift::paths::binary_dir
#define ZERODRIFT_BIN_DIR ::zerodrift::paths::bin_dir
