// SPDX-License-Identifier: Apache-2.0
// What memory safety relies on is checked in every build by require(); an assert is gone from a
// release build and documents only.
#pragma once

#include <stdexcept>

namespace zerodrift::core {

// A broken promise between two parts of this program, never bad input.
class BrokenPromise : public std::logic_error {
 public:
  using std::logic_error::logic_error;
};

// Throws BrokenPromise with the sentence. In a noexcept function, which the data path's are, that
// ends the process with the sentence: a standby and a supervisor see an end, not wrong numbers.
constexpr void require(bool holds, const char* sentence) {
  if (!holds) [[unlikely]]
    throw BrokenPromise(sentence);
}

}  // namespace zerodrift::core
