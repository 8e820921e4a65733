// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <nlohmann/json.hpp>
#include <string>

namespace zerodrift::report {

// The object at a key of an object, made where there is none. json[key][another] makes it too, but
// in two steps: where memory ends between them, nlohmann::json 3.11 destroys an object that it
// doesn't have, and the process ends by a signal. A document begins as object() for the same
// reason.
inline nlohmann::ordered_json& object_at(nlohmann::ordered_json& json, const std::string& key) {
  nlohmann::ordered_json& value = json[key];
  if (value.is_null()) value = nlohmann::ordered_json::object();
  return value;
}

}  // namespace zerodrift::report
