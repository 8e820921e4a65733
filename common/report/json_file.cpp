// SPDX-License-Identifier: Apache-2.0
#include "common/report/json_file.h"

#include "common/files/atomic_file.h"

namespace zerodrift::report {

void write_json(const std::filesystem::path& path, const nlohmann::ordered_json& value) {
  files::AtomicFile file{path};
  file.append(value.dump(2, ' ', false, nlohmann::ordered_json::error_handler_t::replace));
  file.append("\n");
  file.commit();
}

}  // namespace zerodrift::report
