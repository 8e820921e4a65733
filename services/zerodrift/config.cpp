// SPDX-License-Identifier: Apache-2.0
// The configuration of the compensation: what is in force, and the page of all keys.
#include <cstdio>
#include <filesystem>
#include <memory>

#include "common/config/compensation_config.h"
#include "common/config/configuration_text.h"
#include "common/service/main.h"
#include "services/zerodrift/commands.h"

namespace zerodrift::services {

void add_config(CLI::App& app, Run& run) {
  CLI::App* command = app.add_subcommand("config", "Shows the configuration of the compensation");
  command->require_subcommand(1);

  auto file = std::make_shared<std::filesystem::path>();
  CLI::App* show = command->add_subcommand("show", "Every key with the value in force, as YAML");
  show->add_option("--config", *file, "YAML or JSON file; without one the defaults are shown");
  show->callback([file, &run] {
    run = [file] {
      const auto options =
          file->empty() ? compensation::CompensationOptions{} : config::load_compensation(*file);
      std::fputs(config::effective_yaml(options).c_str(), stdout);
      return service::kExitDone;
    };
  });

  CLI::App* reference = command->add_subcommand("reference", "The page of all keys, as Markdown");
  reference->callback([&run] {
    run = [] {
      std::fputs(config::configuration_reference().c_str(), stdout);
      return service::kExitDone;
    };
  });
}

}  // namespace zerodrift::services
