// SPDX-License-Identifier: Apache-2.0
#include "common/dds/security_notices.h"

#include <utility>

namespace zerodrift::dds {

void SecurityNotices::add(const std::string& code, std::string text) {
  const std::lock_guard lock(mutex_);
  SecurityNotice& notice = notices_[code];
  notice.code = code;
  notice.text = std::move(text);
  ++notice.count;
}

std::vector<SecurityNotice> SecurityNotices::take() {
  const std::lock_guard lock(mutex_);
  std::vector<SecurityNotice> taken;
  for (auto& [code, notice] : notices_) taken.push_back(std::move(notice));
  notices_.clear();
  return taken;
}

}  // namespace zerodrift::dds
