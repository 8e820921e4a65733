// SPDX-License-Identifier: Apache-2.0
#include "services/control/control.h"

#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <functional>
#include <future>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>
#include <stdexcept>
#include <string>
#include <string_view>
#include <vector>

#include "common/files/named_file.h"
#include "common/service/command_client.h"
#include "common/service/host.h"
#include "common/service/main.h"
#include "common/service/time_option.h"
#include "services/control/status_table.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

struct ControlOptions {
  dds::NetworkOptions network;
  bool follow = false;
  bool until_finished = false;
  bool json = false;
  double wait_s = 5.0;
  std::string service;  // empty: the instances of the compensation that lead
  std::string command;
  std::string argument;
  std::string model;
  std::uint32_t gyro_id = 0;  // 0: the only one
};

constexpr auto kAllSpeakWithin = 500ms;  // each service does four times a second

// Nobody was found: what security refused meanwhile may be the reason.
void tell_security_notices(const std::string& command, dds::Participant& participant) {
  for (const dds::SecurityNotice& notice : participant.take_security_notices())
    std::fprintf(stderr, "ctl %s: %s\n", command.c_str(), notice.text.c_str());
}

int show_once(const ControlOptions& options) {
  dds::Participant participant("zerodrift_ctl", options.network);
  StatusBoard board(participant);
  const auto give_up =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(options.wait_s);
  while (!board.has_compensation() && std::chrono::steady_clock::now() < give_up) {
    if (service::wait_for_stop(50ms)) return service::kExitNo;
  }
  service::wait_for_stop(kAllSpeakWithin);
  if (!board.has_compensation()) {
    std::fprintf(stderr, "ctl status: no compensation service found in domain %u within %g s\n",
                 options.network.domain, options.wait_s);
    tell_security_notices("status", participant);
    return service::kExitNo;
  }
  std::fputs((options.json ? board.json() + '\n' : board.table()).c_str(), stdout);
  return service::kExitDone;
}

// Whether a run that is followed has come to its end: nothing was lost, or what was lost is not on
// its way any more, since all sources have ended, or died, and no count has moved for a while.
class EndOfRun {
 public:
  explicit EndOfRun(StatusBoard& board) : board_(board) {}

  bool has_come() {
    if (board_.finished() && board_.nothing_lost()) return true;
    const StatusBoard::Counts counts = board_.counts();
    const auto now = std::chrono::steady_clock::now();
    if (!counts.nothing_more_comes || counts != counts_) moved_ = now;
    counts_ = counts;
    return now - moved_ >= kRest;
  }

 private:
  // Services report four times a second; a loaded computer may keep one from it for seconds.
  static constexpr std::chrono::seconds kRest{10};

  StatusBoard& board_;
  StatusBoard::Counts counts_{};
  std::chrono::steady_clock::time_point moved_{};
};

int follow(const ControlOptions& options) {
  dds::Participant participant("zerodrift_ctl", options.network);
  StatusBoard board(participant);
  const bool terminal = isatty(STDOUT_FILENO) != 0 && !options.json;
  const auto redraw = terminal ? 500ms : 5000ms;
  EndOfRun end(board);
  bool stopped = false;
  bool ended = false;
  while (!stopped && !ended) {
    for (auto waited = 0ms; waited < redraw && !stopped && !ended; waited += 250ms) {
      stopped = service::wait_for_stop(250ms);
      ended = options.until_finished && end.has_come();
    }
    const std::string table = options.json ? board.json() : board.table();
    if (terminal) std::fputs("\033[H\033[J", stdout);
    std::fputs(table.c_str(), stdout);
    if (!terminal) std::fputs("\n", stdout);
    if (std::fflush(stdout) != 0) return service::kExitNo;  // nobody reads it any more
  }
  service::wait_for_stop(stopped ? 1ms : 1500ms);  // the monitor's last report
  if (options.json) {
    std::printf("%s\n", board.json().c_str());
  } else {
    std::printf("\n%s%s", board.table().c_str(), board.summary().c_str());
  }
  const bool passed = !options.until_finished || (board.finished() && board.nothing_lost());
  const int exit_code = passed ? service::kExitDone : service::kExitNo;
  service::end_within(service::kStopWithin, exit_code);
  return exit_code;
}

bool takes_name(std::string_view command) {
  return command == "checkpoint" || command == "restore";
}

bool acts_at_the_source(std::string_view command) {
  return command == "inject" || command == "replay";
}

bool changes_prior(std::string_view command) {
  return command == "adopt" || command == "revert";
}

// "[gyro id:][name of the model's file]"
std::string prior_argument(const ControlOptions& options) {
  std::string argument;
  if (options.gyro_id != 0) argument = std::to_string(options.gyro_id) + ':';
  if (options.model.empty()) return argument;
  if (const auto problem = files::problem_of_name(options.model)) {
    throw std::invalid_argument(options.command + ": --model: " + *problem +
                                "; copy the file into the folder that the service was given as "
                                "--model-dir, and name it");
  }
  return argument + options.model;
}

std::string as_json(const std::string& service, const service::CommandAnswer& answer) {
  using Outcome = service::CommandAnswer::Outcome;
  return nlohmann::ordered_json{{"accepted", answer.outcome == Outcome::kDone},
                                {"text", answer.text},
                                {"model_epoch", answer.model_epoch},
                                {"service", service}}
      .dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

int show(const ControlOptions& options, const std::string& service, dds::Participant& participant,
         const service::CommandAnswer& answer) {
  using Outcome = service::CommandAnswer::Outcome;
  if (options.json) {
    std::printf("%s\n", as_json(service, answer).c_str());
  } else if (answer.outcome == Outcome::kNobody) {
    std::fprintf(stderr, "ctl %s: no answer from '%s' in domain %u within %g s\n",
                 options.command.c_str(), service.c_str(), options.network.domain, options.wait_s);
    tell_security_notices(options.command, participant);
  } else if (answer.outcome == Outcome::kNotSent) {
    throw std::invalid_argument(options.command + ": " + answer.text);
  } else {
    std::printf("%s: %s\n", service.c_str(), answer.text.c_str());
  }
  return answer.outcome == Outcome::kDone ? service::kExitDone : service::kExitNo;
}

using Clock = std::chrono::steady_clock;
using Deadline = std::chrono::time_point<Clock, std::chrono::duration<double>>;

// The instances that lead; where nobody says so by then, the lowest that is there; none: nobody is
// there, or the user stopped it.
std::vector<std::string> find_compensations(const ControlOptions& options,
                                            dds::Participant& participant, Deadline give_up) {
  StatusBoard board(participant);
  std::optional<Clock::time_point> found;
  while (!board.all_are_led() && Clock::now() < give_up) {
    if (!found && board.has_compensation()) found = Clock::now();
    if (found && Clock::now() >= *found + kAllSpeakWithin) break;
    if (service::wait_for_stop(20ms)) return {};
  }
  return board.addressees(options.gyro_id);
}

// None: the user stopped it.
std::optional<service::CommandAnswer> ask(const ControlOptions& options, const std::string& service,
                                          service::CommandClient& client, Deadline give_up) {
  const auto promise = std::make_shared<std::promise<service::CommandAnswer>>();
  auto answer = promise->get_future();
  const std::chrono::duration<double, std::milli> left = give_up - Clock::now();
  client.send({.service = service,
               .name = options.command,
               .argument = options.argument,
               .issuer = "zerodrift ctl"},
              std::chrono::milliseconds(std::llround(std::max(left.count(), 0.0))),
              [promise](const service::CommandAnswer& answered) { promise->set_value(answered); });
  while (answer.wait_for(0ms) != std::future_status::ready) {
    if (service::wait_for_stop(20ms)) return std::nullopt;
  }
  return answer.get();
}

int send(const ControlOptions& options) {
  dds::Participant participant("zerodrift_ctl", options.network);
  service::CommandClient client(participant);
  const Deadline give_up = Clock::now() + std::chrono::duration<double>(options.wait_s);
  std::vector<std::string> services{options.service};
  if (options.service.empty()) services = find_compensations(options, participant, give_up);
  if (services.empty())
    return show(options, "compensation", participant, {.text = "no compensation is there"});
  int exit_code = service::kExitDone;
  for (const std::string& service : services) {
    const auto answer = ask(options, service, client, give_up);
    if (!answer) return service::kExitNo;
    exit_code = std::max(exit_code, show(options, service, participant, *answer));
  }
  return exit_code;
}

void add_commands(CLI::App& app, std::function<int()>& run) {
  app.require_subcommand(1);
  auto options = std::make_shared<ControlOptions>();

  auto* status = app.add_subcommand("status", "what every axis does, and why");
  service::add_network_options(*status, options->network);
  service::show_default_in(
      "s", status->add_option("--wait", options->wait_s, "how long to wait for the services")
               ->transform(service::in_seconds_from_0()));
  status->add_flag("--follow", options->follow, "keep showing until Ctrl-C");
  status->add_flag(
      "--until-finished", options->until_finished,
      "with --follow: until the publisher's source has ended; exit code 1 if a sample was lost");
  status->add_flag("--json", options->json, "as JSON, one object a line");
  status->callback([options, &run] {
    run = [options] { return options->follow ? follow(*options) : show_once(*options); };
  });

  for (const auto& [name, help] :
       {std::pair{"freeze", "stop learning"}, std::pair{"learn", "learn again"},
        std::pair{"reset", "forget all that was learned"},
        std::pair{"checkpoint", "save what was learned in the service's --checkpoint-dir"},
        std::pair{"restore", "go on with what was saved; the present model stays if it can't be"},
        std::pair{"adopt", "make a twin's model the prior; what was learned is set aside"},
        std::pair{"revert", "go back to the prior before, and to what was learned with it"},
        std::pair{"inject", "disturb the samples of a simulation or record at their publisher"},
        std::pair{"replay", "pause, resume or pace a simulation or record"}}) {
    auto* command = app.add_subcommand(name, help);
    if (takes_name(name)) {
      command
          ->add_option("name", options->argument,
                       "name of the checkpoint; 'latest' is what the service saves of itself, over "
                       "and over: it can be restored, not saved")
          ->default_str("saved");
    }
    if (acts_at_the_source(name)) {
      const bool injects = std::string_view(name) == "inject";
      command
          ->add_option("what", options->argument,
                       injects ? "KIND:AXIS:MAGNITUDE[:TIME] with step, noise (deg/h), stuck or "
                                 "gap, e.g. step:x:5:5min, gap:xyz:0:200ms; or clear"
                               : "pause, resume, \"speed 60x\" or \"speed max\"")
          ->required();
    }
    const bool of_prior = changes_prior(name);
    if (of_prior) {
      command->add_option("--gyro-id", options->gyro_id,
                          "needed where the service has several gyros");
    }
    if (std::string_view(name) == "adopt") {
      command
          ->add_option("--model", options->model,
                       "name of a model file in the folder that the service was given as "
                       "--model-dir: copy it there first")
          ->required();
    }
    service::add_network_options(*command, options->network);
    const char* addressee = acts_at_the_source(name) ? "gyro_publisher" : "";
    command->add_option("--service", options->service, "name of the service")
        ->default_str(acts_at_the_source(name) ? addressee : "the compensation that leads");
    service::show_default_in(
        "s", command->add_option("--wait", options->wait_s, "how long to wait for the answer")
                 ->transform(service::in_seconds_from_0()));
    command->add_flag("--json", options->json, "the answer as JSON");
    command->callback([options, name = std::string(name), addressee, of_prior, &run] {
      options->command = name;
      if (options->service.empty()) options->service = addressee;
      run = [options, of_prior] {
        if (of_prior) options->argument = prior_argument(*options);
        return send(*options);
      };
    });
  }
}

}  // namespace

int control(const char* version, int argc, char** argv) {
  CLI::App app("Looks at the running system, or commands it.", "ctl");
  std::function<int()> run;
  add_commands(app, run);
  return service::run_version(version, app, argc, argv, [&] { return run(); });
}

}  // namespace zerodrift::services
