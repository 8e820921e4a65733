// SPDX-License-Identifier: Apache-2.0
// A program of its own: a run can be followed before what analyses records is built.
#include "common/service/main.h"

#include "services/control/control.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Looks at the running system, or commands it.", "ctl");
  std::function<int()> run;
  services::add_control(app, run);
  return service::run_main(app, argc, argv, [&] { return run(); });
}
