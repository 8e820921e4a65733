// SPDX-License-Identifier: Apache-2.0
// A state as bytes, and bytes that no state has.
#pragma once

#include <cstddef>
#include <cstring>
#include <string>
#include <string_view>

#include "common/core/state_archive.h"

namespace zerodrift::testing {

template <typename T>
std::string state_of(T& value) {
  std::string bytes;
  core::StateArchive archive(bytes);
  archive(value);
  return bytes;
}

// False: the bytes were refused, and `value` is to be thrown away.
template <typename T>
bool read_state(T& value, std::string_view bytes) {
  core::StateArchive archive(bytes);
  archive(value);
  return archive.ok() && archive.at_end();
}

template <typename T>
std::string with(std::string bytes, std::size_t at, const T& value) {
  std::memcpy(bytes.data() + at, &value, sizeof value);
  return bytes;
}

}  // namespace zerodrift::testing
