// SPDX-License-Identifier: Apache-2.0
// libFuzzer's entry point of the target that ZERODRIFT_FUZZ_TARGET names: compiled once a target.
#include <cstddef>
#include <cstdint>

#include "tests/fuzz/targets.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size);

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  zerodrift::fuzz::ZERODRIFT_FUZZ_TARGET({data, size});
  return 0;
}
