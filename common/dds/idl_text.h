// SPDX-License-Identifier: Apache-2.0
// The IDL files as they were when this was built.
#pragma once

#include <span>
#include <string_view>

#include "common/dds/topics.h"

namespace zerodrift::dds {

struct IdlText {
  std::string_view file;  // "angular_rate.idl"
  std::string_view text;
};

[[nodiscard]] std::span<const IdlText> idl_texts() noexcept;

// The file that defines a topic's type, with all that the type is made of: our files include no
// others. Throws std::logic_error where no file does.
[[nodiscard]] const IdlText& idl_of(const TopicSpec& spec);

}  // namespace zerodrift::dds
