// SPDX-License-Identifier: Apache-2.0
// `ctl`: looks at the running system, or tells it to do something.
#pragma once

namespace zerodrift::services {

// From its command line to its exit code; `version` answers --version.
int control(const char* version, int argc, char** argv);

}  // namespace zerodrift::services
