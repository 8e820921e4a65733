// SPDX-License-Identifier: Apache-2.0
// YAML files into Protobuf messages of any type. Keys are the fields' names; every error names
// file, line and the key's path.
//
// Scalars convert strictly: a number field takes a plain finite number, a flag true or false, an
// enum its value's name; a string field any scalar. A wrong type and a key that stands twice are
// refused. An unknown key is reported with the closest valid one; where the message has a field
// `map<string, string> extra`, it is kept there as JSON text.
#pragma once

#include <filesystem>

#include "common/config/yaml_document.h"

namespace zerodrift::config {

// As YamlDocument::fill(), but an unknown key is an error: the form for what people write by hand.
void fill_whole(const YamlDocument& document, google::protobuf::Message& message);
// As fill_whole(), of a file.
void load_message(const std::filesystem::path& path, google::protobuf::Message& message);

}  // namespace zerodrift::config
