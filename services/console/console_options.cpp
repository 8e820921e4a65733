// SPDX-License-Identifier: Apache-2.0
#include "services/console/console_options.h"

#include <algorithm>
#include <cstdlib>
#include <fstream>
#include <stdexcept>

#include "common/service/main.h"

namespace zerodrift::services {
namespace {

constexpr std::size_t kShortestToken = 16;
constexpr const char* kTokenVariable = "ZERODRIFT_CONSOLE_TOKEN";

// The token itself is in no message.
std::string checked(std::string token, const std::string& where) {
  const bool is_plain =
      std::all_of(token.begin(), token.end(), [](unsigned char c) { return c > 0x20 && c < 0x7f; });
  if (!is_plain)
    throw std::invalid_argument(where + ": the token holds a space or no printable ASCII");
  if (token.size() < kShortestToken) {
    throw std::invalid_argument(where + ": found a token of " + std::to_string(token.size()) +
                                " characters, expected at least " + std::to_string(kShortestToken) +
                                "; e.g. `openssl rand -hex 24`");
  }
  return token;
}

std::string token_of(const ConsoleOptions& options) {
  if (!options.token_file.empty()) {
    std::ifstream file(options.token_file);
    std::string token;
    if (!std::getline(file, token))
      throw std::invalid_argument(options.token_file.string() + ": can't read a token from it");
    return checked(token, options.token_file.string());
  }
  const char* variable = std::getenv(kTokenVariable);
  return variable == nullptr ? "" : checked(variable, kTokenVariable);
}

}  // namespace

void add_options(CLI::App& app, ConsoleOptions& options) {
  service::add_network_options(app, options.network);
  service::add_supervision_options(app, options.supervision);
  app.add_option("--listen", options.listen,
                 "ADDRESS:PORT for browsers, Foxglove clients and Prometheus; beyond loopback only "
                 "with a token")
      ->capture_default_str();
  app.add_option("--token-file", options.token_file,
                 "file whose first line clients have to show; or ZERODRIFT_CONSOLE_TOKEN in the "
                 "environment");
  app.add_option("--allow-origin", options.allowed_origins,
                 "origin of a foreign page that may connect, e.g. https://app.foxglove.dev; "
                 "repeatable, * for all");
  app.add_option("--page", options.page, "folder of the page's files")
      ->check(CLI::ExistingDirectory);
}

web::AccessOptions access_options(const ConsoleOptions& options) {
  web::AccessOptions access{.listen = web::parse_address(options.listen),
                            .token = token_of(options),
                            .allowed_origins = options.allowed_origins};
  if (!web::is_loopback(access.listen.host) && access.token.empty()) {
    throw std::invalid_argument("--listen " + options.listen +
                                ": others can reach this address; give --token-file FILE or " +
                                kTokenVariable);
  }
  return access;
}

std::filesystem::path page_folder(const ConsoleOptions& options) {
  if (!options.page.empty()) return options.page;
  std::error_code error;
  const auto program = std::filesystem::read_symlink("/proc/self/exe", error);
  return program.parent_path().parent_path() / "share/zerodrift/console";
}

}  // namespace zerodrift::services
