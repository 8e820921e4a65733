// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/options.h"

#include "common/config/compensation_config.h"
#include "common/service/hot_standby.h"

namespace zerodrift::services {

CompensationNodeOptions CompensationArguments::complete() const {
  CompensationNodeOptions options = node;
  if (!config.empty()) options.compensation = config::load_compensation(config);
  if (!prior.empty()) options.compensation.prior = config::load_prior(prior);
  return options;
}

void add_options(CLI::App& app, CompensationArguments& arguments) {
  CompensationNodeOptions& node = arguments.node;
  app.add_option("--config", arguments.config,
                 "YAML or JSON file (idl/proto/compensation.proto); defaults without");
  app.add_option("--prior", arguments.prior,
                 "a twin's model: drift = model + what is learned of the remainder; overrides the "
                 "file. Of one gyro: run a service for each");
  app.add_option("--instance", node.instance,
                 "number of this instance, 0 to 15; with several, give each its own")
      ->check(CLI::Range(0U, service::kMostInstances - 1))
      ->capture_default_str();
  app.add_option("--ownership-strength", node.ownership_strength,
                 "above 0: one of several instances that stand by for each other; the strongest "
                 "begins")
      ->capture_default_str();
  app.add_option(
         "--await-subscribers", node.await_subscribers,
         "with records and simulations: take no sample before so many subscribers are there")
      ->capture_default_str();
  app.add_option(
         "--checkpoint-dir", node.checkpoint_dir,
         "existing folder of checkpoints: of `ctl checkpoint` and `ctl restore`, and of those that "
         "are made from time to time and resumed from at the start")
      ->check(CLI::ExistingDirectory);
  app.add_option("--checkpoint-period", node.checkpoint_period,
                 "with --checkpoint-dir: seconds between two checkpoints made without being asked")
      ->check(CLI::Range(1, 86400))
      ->default_str("60");
}

}  // namespace zerodrift::services
