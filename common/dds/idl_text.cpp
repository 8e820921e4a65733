// SPDX-License-Identifier: Apache-2.0
#include "common/dds/idl_text.h"

#include <stdexcept>
#include <string>

namespace zerodrift::dds {

const IdlText& idl_of(const TopicSpec& spec) {
  const std::string_view type = spec.type.substr(spec.type.rfind(':') + 1);
  const std::string definition = "struct " + std::string(type) + " {";
  for (const IdlText& idl : idl_texts()) {
    if (idl.text.find(definition) != std::string_view::npos) return idl;
  }
  throw std::logic_error("no IDL file defines " + std::string(spec.type));
}

}  // namespace zerodrift::dds
