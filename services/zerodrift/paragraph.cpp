// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/paragraph.h"

#include <cstdio>

#include "common/report/plain_text.h"

namespace zerodrift::services {

void print_paragraph(const std::string& text) {
  std::printf("%s\n\n", report::wrapped(text, report::kTextWidth).c_str());
}

}  // namespace zerodrift::services
