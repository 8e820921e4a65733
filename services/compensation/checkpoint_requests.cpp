// SPDX-License-Identifier: Apache-2.0
// The commands checkpoint and restore: the learner gives a copy of what it knows, or takes one.
#include <algorithm>
#include <utility>

#include "common/checkpoint/checkpoint_file.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

constexpr const char* kDefaultName = "latest";
constexpr std::size_t kLongestName = 64;
constexpr const char* kChangeAwaited = "an adopted model is not in force yet; try again";

// A name becomes part of a file's name: nothing that could leave the folder.
bool is_name(const std::string& name) {
  const auto is_allowed = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '-' ||
           c == '_' || c == '.';
  };
  return !name.empty() && name.size() <= kLongestName &&
         std::all_of(name.begin(), name.end(), is_allowed);
}

// What is wrong with a name, or nothing.
std::optional<std::string> problem_of(const std::string& name) {
  if (is_name(name)) return std::nullopt;
  return "found name '" + name.substr(0, kLongestName) +
         "', expected 1 to 64 of letters, digits, '-', '_' and '.'";
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

CompensationNode::Verdict CompensationNode::save(const Request& request) {
  const std::string name = request.argument.empty() ? kDefaultName : request.argument;
  if (const auto problem = problem_of(name)) return {.text = *problem};
  Verdict verdict{.outcome = Outcome::kAccepted};
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    if (awaits_change(*source)) return {.text = kChangeAwaited};
    const compensation::LearnerState state = learned_by(*source);
    const auto file = checkpoint_file(source->id, name);
    checkpoint::save(file, {source->id, source->options}, state);
    files.push_back(file.string());
    verdict.model_epoch = state.epoch;
  }
  verdict.text =
      "saved " + count_of(files) + ", model epoch " + std::to_string(verdict.model_epoch);
  return verdict;
}

// All files are read before the first learner is touched: one bad file, and every model stays.
CompensationNode::Verdict CompensationNode::restore(const Request& request) {
  const std::string name = request.argument.empty() ? kDefaultName : request.argument;
  if (const auto problem = problem_of(name)) return {.text = *problem};
  std::vector<std::shared_ptr<compensation::RestoredLearner>> loaded;
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    if (awaits_change(*source)) return {.text = kChangeAwaited};
    files.push_back(checkpoint_file(source->id, name).string());
    loaded.push_back(checkpoint::load(files.back(), {source->id, source->options}));
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
  const auto epoch = installed(*loaded.back());
  verdict.model_epoch = epoch.value_or(0);
  verdict.text = "restored " + count_of(files) +
                 (epoch ? ", model epoch " + std::to_string(*epoch)
                        : std::string("; in force as soon as samples come"));
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
