// SPDX-License-Identifier: Apache-2.0
#include "common/service/main.h"

#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <exception>
#include <memory>
#include <new>
#include <optional>
#include <sstream>
#include <stdexcept>
#include <string>
#include <string_view>
#include <system_error>
#include <thread>
#include <vector>

#include "common/core/closest_name.h"
#include "common/core/one_line.h"
#include "common/core/wrapped_text.h"
#include "common/service/line_writer.h"
#include "common/service/one_of.h"
#include "common/service/stop_signals.h"

namespace zerodrift::service {

namespace {

constexpr const char* kDomainOption = "--domain";
constexpr const char* kDomainVariable = "ZERODRIFT_DOMAIN";
constexpr const char* kWaitForOption = "--wait-for";
constexpr std::string_view kNoMemory = "no memory is left";
constexpr std::string_view kNoThread =
    "no further thread can be started: the limit of threads (of the user, or of the container) or "
    "memory is used up";

}  // namespace

void add_network_options(CLI::App& app, dds::NetworkOptions& network) {
  app.add_option(kDomainOption, network.domain,
                 "DDS domain; without, that of " + std::string(kDomainVariable) + ", else 0")
      ->check(CLI::Range(0, 232))
      ->capture_default_str();
  app.add_option(
      "--interface", network.interfaces,
      "IPv4 address of an interface to use (repeatable); without it nothing leaves this machine");
  app.add_option("--peer", network.peers, "IPv4 address of another host to look for (repeatable)");
  app.add_option("--security", network.security_dir,
                 "folder of keys and certificates made by deploy/security/make_certificates.sh: "
                 "everything is authenticated and encrypted; off without");
  app.add_option("--transport", network.transport,
                 "udp, or shm: shared memory between processes of this computer")
      ->transform(one_of<dds::Transport>(
          {{"udp", dds::Transport::kUdp}, {"shm", dds::Transport::kSharedMemory}}))
      ->default_str("udp");
  app.add_option(
      "--discovery-server", network.discovery_servers,
      "IPv4[:PORT] of a discovery server (repeatable): the same list, in the same order, "
      "for every process");
}

namespace {

// What waits in the buffer of standard output goes out if its reader takes it at once.
void flush_what_is_said() {
  if (::ftrylockfile(stdout) != 0) return;  // somebody is held up in a write to it
  pollfd out{.fd = STDOUT_FILENO, .events = POLLOUT, .revents = 0};
  if (::poll(&out, 1, 0) == 1) std::fflush(stdout);
  ::funlockfile(stdout);
}

}  // namespace

void end_within(std::chrono::milliseconds at_most, int exit_code) try {
  std::thread([at_most, exit_code] {
    std::this_thread::sleep_for(at_most);
    standard_error().write("stop: the middleware did not let go in time; ended without waiting");
    standard_error().wait_until_written(kLastLinesWithin);
    flush_what_is_said();
    std::_Exit(exit_code);
  }).detach();
} catch (const std::system_error&) {  // no thread is to be had: the supervisor limits the end
}

namespace {

// Where a word of the command line stayed over: the app itself, or the command that was chosen.
const CLI::App* where_left_over(const CLI::App& app) {
  if (app.remaining_size(false) > 0) return &app;
  for (const CLI::App* command : app.get_subcommands()) {
    if (const CLI::App* found = where_left_over(*command)) return found;
  }
  return nullptr;
}

std::string unknown(const std::string& kind, const std::string& word, std::string_view bare,
                    const std::vector<std::string>& known, const std::string& dashes) {
  constexpr std::size_t kMostEdits = 2;
  const auto meant = core::closest_name(bare, known, kMostEdits);
  return "unknown " + kind + " '" + word + "'" +
         (meant ? "; did you mean '" + dashes + *meant + "'?" : "") + " (--help lists them)";
}

// The line about an option or a command that there isn't; nothing where it isn't that.
std::optional<std::string> unknown_word(const CLI::App& app) {
  const CLI::App* where = where_left_over(app);
  if (where == nullptr) return std::nullopt;
  const std::vector<std::string> left_over = where->remaining();
  std::vector<std::string> known;
  for (const CLI::App* one : where->get_subcommands([](const CLI::App*) { return true; }))
    known.push_back(one->get_name());
  const bool wants_command = !known.empty() && where->get_subcommands().empty();
  if (wants_command && !left_over.front().starts_with('-'))
    return unknown("command", left_over.front(), left_over.front(), known, "");

  const auto option = std::find_if(left_over.begin(), left_over.end(), [](const auto& word) {
    return word.size() > 1 && word.starts_with('-') && word != "--";
  });
  if (option == left_over.end()) return std::nullopt;
  known.clear();
  for (const CLI::Option* one : where->get_options())
    known.insert(known.end(), one->get_lnames().begin(), one->get_lnames().end());
  const std::string word = option->substr(0, option->find('='));
  const std::string bare = word.substr(std::min(word.find_first_not_of('-'), word.size()));
  return unknown("option", word, bare, known, "--");
}

// Of the commands that were chosen, where the command line doesn't say it: other commands have no
// domain, and --help no need of one. CLI::Option::envname() looks at the environment for them all
// and names the option alone where the variable is wrong.
void take_domain_of_environment(CLI::App& app) {
  for (CLI::App* command : app.get_subcommands()) take_domain_of_environment(*command);
  CLI::Option* domain = app.get_option_no_throw(kDomainOption);
  const char* value = std::getenv(kDomainVariable);
  if (domain == nullptr || domain->count() > 0 || value == nullptr || *value == '\0') return;
  try {
    domain->add_result(value);
    domain->run_callback();
  } catch (const CLI::ParseError&) {
    throw std::invalid_argument(std::string(kDomainVariable) + ": found '" + core::one_line(value) +
                                "', expected a DDS domain, 0 to 232");
  }
}

int parse_and_run(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  const auto refuse = [&](const Refusal& refusal) {
    standard_error().write(app.get_name() + ": " + std::string(refusal.reason));
    return refusal.exit_code;
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help: not an error
    const std::string why =
        unknown_word(app).value_or(std::string(error.what()) + " (--help tells more)");
    return refuse({why, kExitBadInput});
  }
  try {
    take_domain_of_environment(app);
    return body();
  } catch (const std::exception& error) {
    return refuse(refusal_of(error));
  }
}

// CLI11 sets what an option is in a column of its own and leaves its lines as long as they are.
class HelpOfATerminal : public CLI::Formatter {
 public:
  std::string make_help(const CLI::App* app, std::string name,
                        CLI::AppFormatMode mode) const override {
    std::istringstream lines(CLI::Formatter::make_help(app, std::move(name), mode));
    std::string text;
    for (std::string line; std::getline(lines, line);) {
      const std::size_t indent = line.starts_with(' ') ? get_column_width() : 0;
      text += core::wrapped(line, core::kTextWidth, indent) + '\n';
    }
    return text;
  }

 protected:
  // "UINT in [0 - 232]", not "UINT:INT in [0 - 232]".
  std::string make_option_opts(const CLI::Option* option) const override {
    std::string text = CLI::Formatter::make_option_opts(option);
    for (const char* kind : {":FLOAT in [", ":INT in [", ":UINT in ["})
      text = CLI::detail::find_and_replace(text, kind, " in [");
    return text;
  }
};

// An empty value is mostly a variable of the shell that isn't set: --security "$FOLDER" would run
// unsecured in silence. It has a meaning where a list says who is waited for: nobody.
void refuse_empty_values(CLI::App& app) {
  for (CLI::Option* option : app.get_options([](const CLI::Option*) { return true; })) {
    if (option->get_items_expected_max() == 0 || option->check_name(kWaitForOption)) continue;
    const std::string otherwise =
        option->nonpositional() ? "; without one leave the option out" : "";
    // Before what else looks at the value.
    option->transform(CLI::Validator(
        [otherwise](const std::string& value) {
          return value.empty() ? "found an empty value, expected one" + otherwise : "";
        },
        ""));
  }
}

// Of each command too: what a script asks it of is what the script calls.
void prepare(CLI::App& app, const char* version) {
  app.formatter(std::make_shared<HelpOfATerminal>());
  app.set_version_flag("--version", version, "Print version, commit and build");
  refuse_empty_values(app);
  for (CLI::App* command : app.get_subcommands([](const CLI::App*) { return true; }))
    prepare(*command, version);
}

std::terminate_handler without_a_reason = nullptr;

// Where there is no memory, unwinding needs some: destructors of the JSON library do, and nobody
// catches what leaves a destructor; nor what the first threads of a service throw, which the lines
// of a refusal need. The program then ends in a line as after any other refusal; what it was
// writing has no name yet.
[[noreturn]] void end_without_resources() noexcept {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::exception& error) {
    const auto [reason, exit_code] = refusal_of(error);
    if (exit_code == kExitNo) {
      pollfd out{.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
      for (const std::string_view text : {reason, std::string_view("\n")}) {
        if (::poll(&out, 1, 0) != 1 || ::write(STDERR_FILENO, text.data(), text.size()) < 0) break;
      }
      std::_Exit(exit_code);
    }
  } catch (...) {
  }
  without_a_reason();
  std::abort();
}

}  // namespace

Refusal refusal_of(const std::exception& error) noexcept {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) return {kNoMemory, kExitNo};
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system != nullptr && system->code() == std::errc::resource_unavailable_try_again)
    return {kNoThread, kExitNo};
  return {error.what(), kExitBadInput};
}

int run_version(const char* version, CLI::App& app, int argc, char** argv,
                const std::function<int()>& body) {
  prepare(app, version);
  without_a_reason = std::set_terminate(end_without_resources);
  take_signals();
  const int exit_code = parse_and_run(app, argc, argv, body);
  standard_error().wait_until_written(kLastLinesWithin);
  return exit_code;
}

}  // namespace zerodrift::service
