// SPDX-License-Identifier: Apache-2.0
#include "tests/support/paths.h"

namespace zerodrift::paths {

const char* const source_dir = ZERODRIFT_CHECKOUT;
const char* const shared_dir = ZERODRIFT_CHECKOUT "/../shared";
const char* const binary_dir = ZERODRIFT_BUILD;
const char* const bin_dir = ZERODRIFT_BUILD "/bin";

}  // namespace zerodrift::paths
