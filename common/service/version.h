// SPDX-License-Identifier: Apache-2.0
// Which build this is. Its source is the only one that knows the commit, and only programs link
// it: with another commit nothing else is compiled or linked anew.
#pragma once

namespace zerodrift::service {

// "zerodrift 0.1.0 (commit abc1234, Release)"; "+" behind the commit: with changes.
[[nodiscard]] const char* version_line();
[[nodiscard]] const char* commit();

}  // namespace zerodrift::service
