// SPDX-License-Identifier: Apache-2.0
#include "services/zerodrift/commands.h"

namespace zerodrift::services {

void add_commands(CLI::App& app, Run& run, const Invocation& made_by) {
  add_simulate(app, run);
  add_compensate(app, run);
  add_compare(app, run, made_by);
  add_navigate(app, run, made_by);
  add_allan(app, run, made_by);
  add_diagnose(app, run, made_by);
  add_calibrate(app, run, made_by);
  add_design(app, run, made_by);
  add_history(app, run, made_by);
  add_record(app, run);
  add_replay(app, run);
  add_info(app, run, made_by);
  add_export(app, run);
  add_config(app, run);
  add_health(app, run);
}

}  // namespace zerodrift::services
