// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

namespace google::protobuf {
class Message;
}

namespace zerodrift::config {

// The message as YAML that YamlDocument reads back to an equal message: keys in the order of the
// schema, fields that are not set left out, maps sorted by key, numbers in the shortest form that
// reads back to the same bits, entries of a field `map<string, string> extra` as keys of their own.
[[nodiscard]] std::string to_yaml(const google::protobuf::Message& message);

}  // namespace zerodrift::config
