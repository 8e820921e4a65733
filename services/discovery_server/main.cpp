// SPDX-License-Identifier: Apache-2.0
// A discovery server: announces participants to each other where they can't, or should not, look
// for everybody themselves. Samples don't pass here.
#include "common/service/main.h"

#include "common/core/counted.h"
#include "common/service/host.h"

int main(int argc, char** argv) {
  namespace dds = zerodrift::dds;
  namespace service = zerodrift::service;
  CLI::App app("Tells participants that name it as --discovery-server of each other.",
               "discovery_server");
  dds::NetworkOptions network;
  service::Supervision supervision;
  std::size_t place = 0;
  service::add_network_options(app, network);
  service::add_supervision_options(app, supervision);
  app.add_option("--id", place, "place of this server in the list of --discovery-server, from 0")
      ->capture_default_str();
  return service::run_main(app, argc, argv, [&] {
    network.serves = place;
    service::Host host("discovery_server", network, supervision);
    return host.run(
        [&] {
          const std::size_t peers = host.participant().acquaintance().peers;
          return service::Status{.summary = zerodrift::core::counted(peers, "participant"),
                                 .metrics = {{"participants", "1", static_cast<double>(peers)}}};
        },
        {}, [&] { service::end_within(service::kStopWithin, host.exit_code()); });
  });
}
