// SPDX-License-Identifier: Apache-2.0
#include "common/service/main.h"

#include <poll.h>
#include <unistd.h>

#include <cstdlib>
#include <exception>
#include <map>
#include <new>
#include <string>
#include <string_view>
#include <thread>

#include "common/service/line_writer.h"
#include "common/service/stop_signals.h"

namespace zerodrift::service {

void add_network_options(CLI::App& app, dds::NetworkOptions& network) {
  app.add_option("--domain", network.domain, "DDS domain")
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
      ->transform(CLI::CheckedTransformer(
                      std::map<std::string, dds::Transport>{{"udp", dds::Transport::kUdp},
                                                            {"shm", dds::Transport::kSharedMemory}})
                      .description("udp|shm"))
      ->default_str("udp");
  app.add_option(
      "--discovery-server", network.discovery_servers,
      "IPv4[:PORT] of a discovery server (repeatable): the same list, in the same order, "
      "for every process");
}

void end_within(std::chrono::milliseconds at_most, int exit_code) {
  std::thread([at_most, exit_code] {
    std::this_thread::sleep_for(at_most);
    standard_error().write("stop: the middleware did not let go in time; ended without waiting");
    standard_error().wait_until_written(kLastLinesWithin);
    std::_Exit(exit_code);
  }).detach();
}

namespace {

int parse_and_run(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  const auto refuse = [&](const std::string& why) {
    standard_error().write(app.get_name() + ": " + why);
    return kExitBadInput;
  };
  try {
    app.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help: not an error
    return refuse(std::string(error.what()) + " (--help tells more)");
  }
  try {
    return body();
  } catch (const std::exception& error) {
    return refuse(error.what());
  }
}

std::terminate_handler without_a_reason = nullptr;

// Where there is no memory, unwinding needs some: destructors of the JSON library do, and nobody
// catches what leaves a destructor. The program then ends in a line as after any other refusal;
// what it was writing has no name yet.
[[noreturn]] void end_without_memory() noexcept {
  try {
    if (const auto error = std::current_exception()) std::rethrow_exception(error);
  } catch (const std::bad_alloc&) {
    constexpr std::string_view kLine = "no memory is left\n";
    pollfd out{.fd = STDERR_FILENO, .events = POLLOUT, .revents = 0};
    if (::poll(&out, 1, 0) == 1 && ::write(STDERR_FILENO, kLine.data(), kLine.size()) < 0) {
      // It ends all the same.
    }
    std::_Exit(kExitNo);
  } catch (...) {
  }
  without_a_reason();
  std::abort();
}

}  // namespace

int run_main(CLI::App& app, int argc, char** argv, const std::function<int()>& body) {
  without_a_reason = std::set_terminate(end_without_memory);
  take_signals();
  const int exit_code = parse_and_run(app, argc, argv, body);
  standard_error().wait_until_written(kLastLinesWithin);
  return exit_code;
}

}  // namespace zerodrift::service
