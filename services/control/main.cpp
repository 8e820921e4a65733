// SPDX-License-Identifier: Apache-2.0
// A program of its own: a run can be followed before what analyses records is built.
#include "common/service/version.h"
#include "services/control/control.h"

int main(int argc, char** argv) {
  return zerodrift::services::control(zerodrift::service::version_line(), argc, argv);
}
