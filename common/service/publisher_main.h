// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <string>

#include "common/service/main.h"
#include "common/service/realtime.h"

namespace zerodrift::service {

// The main function of a publisher: `Node` is made from its `Options`, to which add_options() in
// their namespace adds what is their own.
template <typename Node, typename Options>
int run_publisher(const std::string& description, const std::string& name, int argc, char** argv) {
  CLI::App app(description, name);
  Options options;
  RealtimeOptions realtime;
  add_network_options(app, options.network);
  add_supervision_options(app, options.supervision);
  add_realtime_options(app, realtime);
  add_options(app, options);
  return run_main(app, argc, argv, [&] {
    apply(realtime);
    return Node(options).run();
  });
}

}  // namespace zerodrift::service
