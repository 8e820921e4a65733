// SPDX-License-Identifier: Apache-2.0
// Whether a test runs under a sanitizer, which replaces the functions of the C library's heap.
#pragma once

#ifndef __has_feature
#define __has_feature(feature) 0  // GCC has macros instead
#endif

namespace zerodrift {

#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__) || \
    __has_feature(address_sanitizer) || __has_feature(thread_sanitizer)
inline constexpr bool kIsSanitized = true;
#else
inline constexpr bool kIsSanitized = false;
#endif

}  // namespace zerodrift
