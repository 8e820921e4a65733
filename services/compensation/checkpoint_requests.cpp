// SPDX-License-Identifier: Apache-2.0
// The commands checkpoint and restore: the learner gives a copy of what it knows, or takes one.
#include <algorithm>
#include <chrono>
#include <utility>

#include "common/checkpoint/checkpoint_file.h"
#include "common/service/monotonic_clock.h"
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
      if (!request.gyros[i]->compensator->restore_models(loaded[i])) {
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
  return *learned(source).state;
}

CompensationNode::Learned CompensationNode::learned(Gyro& source) {
  const auto answer = std::make_shared<Learned>();
  compensation::Compensator* compensator = source.compensator.get();
  ask_learner([answer, compensator] {
    answer->state = compensator->learner().export_state();
    answer->job = compensator->learner().newest_job();
  });
  return *answer;
}

// What was learned since is lost with the process, never more: at most one period.
void CompensationNode::save_from_time_to_time() {
  const std::int64_t now = service::monotonic_ns();
  const std::int64_t period_ns = std::chrono::nanoseconds(options_.checkpoint_period).count();
  if (options_.checkpoint_dir.empty() || now - saved_ns_ < period_ns) return;
  saved_ns_ = now;
  for (auto& known : gyros_) {
    Gyro* source = known.get();
    const std::uint64_t epoch = source->newest.model_epoch;
    if (epoch == source->saved_epoch ||
        source->standby.role() != service::HotStandby::Role::kActive)
      continue;
    source->saved_epoch = epoch;
    ask_request_thread([this, source] { save_of_itself(*source); });
  }
}

void CompensationNode::save_of_itself(Gyro& source) {
  const auto file = checkpoint_file(source.id, kDefaultName);
  try {
    if (!awaits_change(source))
      checkpoint::save(file, {source.id, source.options}, learned_by(source));
  } catch (const std::exception& error) {
    host_.raise({.code = "checkpoint_failed",
                 .severity = service::Severity::kError,
                 .text = error.what(),
                 .gyro_id = source.id,
                 .sensor_time_ns = 0});
  }
}

// Before the first sample is answered. A checkpoint that can't be used is told of, and learning
// begins anew.
void CompensationNode::resume(Gyro& source) {
  const auto file = checkpoint_file(source.id, kDefaultName);
  std::error_code none;
  if (options_.checkpoint_dir.empty() || !std::filesystem::exists(file, none)) return;
  const auto tell = [&](const char* code, service::Severity severity, const std::string& text) {
    host_.raise({.code = code,
                 .severity = severity,
                 .text = "gyro " + std::to_string(source.id) + ": " + text,
                 .gyro_id = source.id,
                 .sensor_time_ns = 0});
  };
  try {
    const auto age = std::chrono::duration_cast<std::chrono::seconds>(
        std::filesystem::file_time_type::clock::now() - std::filesystem::last_write_time(file));
    const auto loaded = checkpoint::load(file, {source.id, options_.compensation});
    {
      const std::lock_guard lock(data_mutex_);
      source.compensator->restore_models(loaded);
    }
    wake_learner();
    const auto epoch = installed(*loaded);
    source.saved_epoch = epoch.value_or(0);
    tell("resumed", service::Severity::kInformation,
         "goes on from " + file.string() + ", saved " + std::to_string(age.count()) +
             " s ago, model epoch " + std::to_string(epoch.value_or(0)) +
             "; what was learned since is lost");
  } catch (const std::exception& error) {
    tell("cannot_resume", service::Severity::kWarning,
         std::string(error.what()) + "; learning begins anew");
  }
}

}  // namespace zerodrift::services
