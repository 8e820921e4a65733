// SPDX-License-Identifier: Apache-2.0
// Commands that read or write files are served on a thread of their own: the data path hands a
// request over and goes on.
#include <chrono>
#include <string_view>
#include <utility>

#include "common/service/realtime.h"
#include "services/compensation/command_files.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

constexpr std::size_t kMostRequests = 8;
constexpr auto kInstalledWithin = 2000ms;  // else the reply doesn't wait for it

bool is_checkpoint(const msg::Command& command) {
  return std::string_view(command.name().c_str()) == "checkpoint";
}

bool is_of_checkpoints(const msg::Command& command) {
  return is_checkpoint(command) || std::string_view(command.name().c_str()) == "restore";
}

}  // namespace

CompensationNode::Verdict CompensationNode::hand_over(const msg::Command& command) {
  if (is_of_checkpoints(command) && options_.checkpoint_dir.empty()) {
    return {.text = "checkpoints are off; start the service with --checkpoint-dir DIR"};
  }
  Request request{.command = command, .argument = command.argument().c_str(), .gyros = {}};
  for (auto& [id, source] : gyros_.entries()) request.gyros.push_back(&source);
  if (request.gyros.empty()) return {.text = "no gyro has sent a sample yet"};
  if (!is_checkpoint(command)) request.gyros = led_gyros();
  if (request.gyros.empty()) return {.text = kOtherLeadsText};
  const auto task = [this, request] {
    try {
      commands_.answer(request.command, serve(request));
    } catch (const CommandRefused& refused) {
      commands_.answer(request.command, {.text = refused.what()});
    } catch (const std::exception&) {  // its text may quote anything
      commands_.answer(request.command, {.text = "an error within the service"});
    }
  };
  if (!ask_request_thread(task)) return {.text = "busy with other requests; try again"};
  return {.outcome = Outcome::kLater};
}

bool CompensationNode::ask_request_thread(Task task) {
  const std::lock_guard lock(requests_mutex_);
  if (requests_.size() >= kMostRequests) return false;
  requests_.push_back(std::move(task));
  requests_changed_.notify_one();
  return true;
}

void CompensationNode::serve_requests_until_stopped() {
  service::leave_realtime();
  for (;;) {
    Task task;
    {
      std::unique_lock lock(requests_mutex_);
      requests_changed_.wait(lock, [this] { return requests_closed_ || !requests_.empty(); });
      if (requests_closed_) return;
      task = std::move(requests_.front());
      requests_.pop_front();
    }
    task();
  }
}

CompensationNode::Verdict CompensationNode::serve(const Request& request) {
  const std::string_view name = request.command.name().c_str();
  if (name == "checkpoint") return save(request);
  if (name == "restore") return restore(request);
  return name == "adopt" ? adopt(request) : revert(request);
}

std::optional<std::uint64_t> CompensationNode::installed(
    const compensation::RestoredLearner& learner) {
  const auto give_up = std::chrono::steady_clock::now() + kInstalledWithin;
  while (learner.installed_as == compensation::RestoredLearner::kNotYet) {
    if (requests_closed_ || std::chrono::steady_clock::now() > give_up) return std::nullopt;
    std::this_thread::sleep_for(5ms);
  }
  return learner.installed_as;
}

bool CompensationNode::awaits_change(const Gyro& source) {
  const std::lock_guard lock(data_mutex_);
  return source.change && !source.change->in_force;
}

}  // namespace zerodrift::services
