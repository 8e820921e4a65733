// SPDX-License-Identifier: Apache-2.0
#pragma once

#include <CLI/CLI.hpp>
#include <filesystem>
#include <string>
#include <vector>

#include "common/dds/participant.h"
#include "common/service/supervision.h"
#include "common/web/access.h"

namespace zerodrift::services {

struct ConsoleOptions {
  dds::NetworkOptions network;
  service::Supervision supervision{};
  std::string listen = "127.0.0.1:8765";
  std::filesystem::path token_file{};
  std::vector<std::string> allowed_origins{};
  std::string commit = "unknown";  // of this build
  std::filesystem::path page{};    // empty: ../share/zerodrift/console beside the program's folder
};

void add_options(CLI::App& app, ConsoleOptions& options);

// Throws std::invalid_argument, one line: others could reach it and no token is asked for, or the
// token can't be read or is too easily guessed.
web::AccessOptions access_options(const ConsoleOptions& options);

// Where the page is; it need not be there.
std::filesystem::path page_folder(const ConsoleOptions& options);

}  // namespace zerodrift::services
