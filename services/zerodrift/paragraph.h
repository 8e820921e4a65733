// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace zerodrift::services {

// A paragraph on standard output in lines of at most report::kTextWidth characters.
void print_paragraph(const std::string& text);

}  // namespace zerodrift::services
