// SPDX-License-Identifier: Apache-2.0
// Takes the drift off: angular_rate + temperature [+ rate_reference] -> compensated_rate.
#include "common/service/main.h"

#include "common/config/compensation_config.h"
#include "services/compensation/compensation_node.h"

int main(int argc, char** argv) {
  using namespace zerodrift;
  CLI::App app("Compensates the zero drift of gyros, one online SVR an axis.", "compensation");
  services::CompensationNodeOptions options;
  std::string config;
  std::string prior;
  service::add_network_options(app, options.network);
  app.add_option("--config", config,
                 "YAML or JSON file (idl/proto/compensation.proto); defaults without");
  app.add_option("--prior", prior,
                 "a twin's model: drift = model + what is learned of the remainder; overrides the "
                 "file. Of one gyro: run a service for each");
  app.add_option("--instance", options.instance,
                 "number of this instance; with several, give each its own")
      ->capture_default_str();
  app.add_option("--ownership-strength", options.ownership_strength,
                 "the strongest living instance is heard")
      ->capture_default_str();
  app.add_option(
         "--await-subscribers", options.await_subscribers,
         "with records and simulations: take no sample before so many subscribers are there")
      ->capture_default_str();
  app.add_option("--checkpoint-dir", options.checkpoint_dir,
                 "existing folder of `ctl checkpoint` and `ctl restore`; without, both are refused")
      ->check(CLI::ExistingDirectory);
  return service::run_main(app, argc, argv, [&] {
    if (!config.empty()) options.compensation = config::load_compensation(config);
    if (!prior.empty()) options.compensation.prior = config::load_prior(prior);
    services::CompensationNode(options).run();
    return service::kExitDone;
  });
}
