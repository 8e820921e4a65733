// SPDX-License-Identifier: Apache-2.0
// The commands checkpoint and restore. Files are read and written on a thread of their own: the
// data path hands a request over and goes on, the learner gives a copy of what it knows.
#include <algorithm>
#include <chrono>
#include <utility>

#include "common/checkpoint/checkpoint_file.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

using namespace std::chrono_literals;

constexpr const char* kDefaultName = "latest";
constexpr std::size_t kLongestName = 64;
constexpr std::size_t kMostRequests = 8;
constexpr auto kInstalledWithin = 2000ms;  // else the reply doesn't wait for it

// A name becomes part of a file's name: nothing that could leave the folder.
bool is_name(const std::string& name) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  };
  return !name.empty() && name.size() <= kLongestName &&
         std::all_of(name.begin(), name.end(), is_allowed);
}

std::string count_of(const std::vector<std::string>& files) {
  return files.size() == 1 ? files.front()
                           : std::to_string(files.size()) + " checkpoints, last " + files.back();
}

}  // namespace

std::filesystem::path CompensationNode::checkpoint_file(std::uint32_t gyro_id,
                                                        const std::string& name) const {
  return options_.checkpoint_dir / (std::to_string(gyro_id) + "-" + name + ".ckpt");
}

CompensationNode::Verdict CompensationNode::hand_over(const msg::Command& command) {
  if (options_.checkpoint_dir.empty()) {
    return {.text = "checkpoints are off; start the service with --checkpoint-dir DIR"};
  }
  CheckpointRequest request{.command = command, .name = command.argument().c_str(), .gyros = {}};
  if (request.name.empty()) request.name = kDefaultName;
  if (!is_name(request.name)) {
    return {.text = "found name '" + request.name.substr(0, kLongestName) +
                    "', expected 1 to 64 of letters, digits, '-', '_' and '.'"};
  }
  for (auto& source : gyros_) request.gyros.push_back(source.get());
  if (request.gyros.empty()) return {.text = "no gyro has been heard yet"};
  const std::lock_guard lock(requests_mutex_);
  if (requests_.size() >= kMostRequests) return {.text = "busy with other checkpoints; try again"};
  requests_.push_back(std::move(request));
  requests_changed_.notify_one();
  return {.outcome = Outcome::kLater};
}

void CompensationNode::serve_requests_until_stopped() {
  for (;;) {
    CheckpointRequest request;
    {
      std::unique_lock lock(requests_mutex_);
      requests_changed_.wait(lock, [this] { return requests_closed_ || !requests_.empty(); });
      if (requests_closed_) return;
      request = std::move(requests_.front());
      requests_.pop_front();
    }
    const bool saves = std::string_view(request.command.name().c_str()) == "checkpoint";
    try {
      reply(request.command, saves ? save(request) : restore(request));
    } catch (const std::exception& error) {
      reply(request.command, {.text = error.what()});
    }
  }
}

CompensationNode::Verdict CompensationNode::save(const CheckpointRequest& request) {
  Verdict verdict{.outcome = Outcome::kAccepted};
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    const compensation::LearnerState state = learned_by(*source);
    const auto file = checkpoint_file(source->id, request.name);
    checkpoint::save(file, {source->id, options_.compensation}, state);
    files.push_back(file.string());
    verdict.model_epoch = state.epoch;
  }
  verdict.text =
      "saved " + count_of(files) + ", model epoch " + std::to_string(verdict.model_epoch);
  return verdict;
}

// All files are read before the first learner is touched: one bad file, and every model stays.
CompensationNode::Verdict CompensationNode::restore(const CheckpointRequest& request) {
  std::vector<std::shared_ptr<compensation::RestoredLearner>> loaded;
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    files.push_back(checkpoint_file(source->id, request.name).string());
    loaded.push_back(checkpoint::load(files.back(), {source->id, options_.compensation}));
  }
  {
    const std::lock_guard lock(data_mutex_);
    for (std::size_t i = 0; i < loaded.size(); ++i) {
      if (!request.gyros[i]->compensator.restore_models(loaded[i])) {
        return {.text = "the learner of gyro " + std::to_string(request.gyros[i]->id) +
                        " is busy; try again"};
      }
    }
  }
  wake_learner();
  Verdict verdict{.outcome = Outcome::kAccepted};
  const auto give_up = std::chrono::steady_clock::now() + kInstalledWithin;
  while (loaded.back()->installed_as == compensation::RestoredLearner::kNotYet) {
    if (requests_closed_ || std::chrono::steady_clock::now() > give_up) {
      verdict.text = "restored " + count_of(files) + "; in force as soon as samples come";
      return verdict;
    }
    std::this_thread::sleep_for(5ms);
  }
  verdict.model_epoch = loaded.back()->installed_as;
  verdict.text =
      "restored " + count_of(files) + ", model epoch " + std::to_string(verdict.model_epoch);
  return verdict;
}

// The learner copies what it knows between two labels.
compensation::LearnerState CompensationNode::learned_by(Gyro& source) {
  std::packaged_task<compensation::LearnerState()> question(
      [&source] { return source.compensator.learner().export_state(); });
  auto answer = question.get_future();
  questions_.push(std::move(question));  // one at a time is asked: never full
  wake_learner();
  return answer.get();
}

}  // namespace zerodrift::services
