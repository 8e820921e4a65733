// SPDX-License-Identifier: Apache-2.0
#include "common/record/recorded_messages.h"

#include "common/record/csv_cells.h"

namespace zerodrift::record {

std::string listed(const std::vector<std::string>& names) {
  constexpr std::size_t kMostListed = 16;
  std::string text;
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (i == kMostListed) return text + " and " + std::to_string(names.size() - i) + " more";
    text += (i == 0 ? "" : ", ") + printable(names[i]);
  }
  return text.empty() ? "none at all" : text;
}

std::unique_ptr<RecordedMessages> find_messages(const McapFiles& files, const std::string& name,
                                                const RecordOptions& options) {
  const bool is_ros2 = options.topics.any() || (!has_own_rates(files) && is_of_ros2(files));
  return is_ros2 ? find_ros2_messages(files, name, options)
                 : find_own_messages(files, name, options);
}

}  // namespace zerodrift::record
