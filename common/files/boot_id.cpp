// SPDX-License-Identifier: Apache-2.0
#include "common/files/boot_id.h"

#include <fstream>

namespace zerodrift::files {

std::string boot_id() {
  std::string id;
  std::ifstream("/proc/sys/kernel/random/boot_id") >> id;
  return id;
}

}  // namespace zerodrift::files
