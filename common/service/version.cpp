// SPDX-License-Identifier: Apache-2.0
#include "common/service/version.h"

#include "common/service/commit.h"  // made by cmake/commit.cmake

namespace zerodrift::service {

const char* version_line() {
  return "zerodrift " ZERODRIFT_VERSION " (commit " ZERODRIFT_COMMIT ", " ZERODRIFT_BUILD_TYPE ")";
}

const char* commit() {
  return ZERODRIFT_COMMIT;
}

}  // namespace zerodrift::service
