// SPDX-License-Identifier: Apache-2.0
// The commands checkpoint and restore: the learner gives a copy of what it knows, or takes one.
#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <utility>

#include "common/checkpoint/checkpoint_file.h"
#include "common/files/boot_id.h"
#include "common/service/monotonic_clock.h"
#include "services/compensation/command_files.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

constexpr const char* kChangeAwaited = "an adopted model is not in force yet; try again";

std::string count_of(const std::vector<std::string>& files) {
  return files.size() == 1 ? files.front()
                           : std::to_string(files.size()) + " checkpoints, last " + files.back();
}

}  // namespace

CompensationNode::Verdict CompensationNode::save(const Request& request) {
  const std::string name = checkpoint_name(request.argument);
  if (name == kLatestCheckpoint)
    return {.text = "'latest' is what the service saves of itself; expected another name"};
  Verdict verdict{.outcome = Outcome::kAccepted};
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    if (awaits_change(*source)) return {.text = kChangeAwaited};
    const compensation::LearnerState state = learned_by(*source);
    const std::string file = checkpoint_file_name(source->id, name);
    if (auto problem = checkpoint::why_no_place(options_.checkpoint_dir / file); !problem.empty())
      return {.text = std::move(problem)};
    save_as(options_.checkpoint_dir, name, {source->id, source->options}, state);
    files.push_back(file);
    verdict.model_epoch = state.epoch;
  }
  verdict.text =
      "saved " + count_of(files) + ", model epoch " + std::to_string(verdict.model_epoch);
  return verdict;
}

// All files are read before the first learner is touched: one bad file, and every model stays.
CompensationNode::Verdict CompensationNode::restore(const Request& request) {
  const std::string name = checkpoint_name(request.argument);
  std::vector<std::shared_ptr<compensation::RestoredLearner>> loaded;
  std::vector<std::string> files;
  for (Gyro* source : request.gyros) {
    if (awaits_change(*source)) return {.text = kChangeAwaited};
    files.push_back(checkpoint_file_name(source->id, name));
    loaded.push_back(
        checkpoint_named(options_.checkpoint_dir, name, {source->id, source->options}));
  }
  {
    const std::lock_guard lock(data_mutex_);
    for (std::size_t i = 0; i < loaded.size(); ++i) {
      if (!request.gyros[i]->compensator().restore_models(loaded[i]))
        return {.text = busy_text(request.gyros, i)};
      save_schedule_.commanded(request.gyros[i]->id);
    }
  }
  learner_.notify();
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
  compensation::Compensator* compensator = &source.compensator();
  learner_.ask([answer, compensator] {
    answer->state = compensator->learner().export_state();
    answer->job = compensator->learner().newest_job();
  });
  return *answer;
}

// What was learned since is lost with the process, never more: at most one period. All that is due
// is one request.
void CompensationNode::save_from_time_to_time() {
  if (options_.checkpoint_dir.empty()) return;
  std::vector<checkpoint::SaveSchedule::Model> models;
  for (const Gyro* source : led_gyros()) {
    if (source->is_saved) models.push_back({source->id, source->newest().model_epoch});
  }
  const auto due = save_schedule_.take_due(models, service::monotonic_ns());
  if (due.empty()) return;
  const auto save_all = [this, due] {
    for (const auto& model : due) save_of_itself(model);
  };
  if (ask_request_thread(save_all)) return;
  for (const auto& model : due) save_schedule_.put_off(model);
}

void CompensationNode::save_of_itself(const checkpoint::SaveSchedule::Model& model) {
  if (requests_closed_) return;
  Gyro* source = nullptr;
  {
    const std::lock_guard lock(data_mutex_);
    source = &gyros_.entries().at(model.gyro_id);
    if (source->change && !source->change->in_force) return save_schedule_.put_off(model);
  }
  const auto report = [&](checkpoint::SaveSchedule::News news, const char* code,
                          service::Severity severity, const std::string& text) {
    if (news == checkpoint::SaveSchedule::News::kNone) return;
    host_.raise_each({.code = code,
                      .severity = severity,
                      .text = "gyro " + std::to_string(model.gyro_id) + ": " + text,
                      .gyro_id = model.gyro_id,
                      .sensor_time_ns = 0});
  };
  try {
    save_as(options_.checkpoint_dir, kLatestCheckpoint, {source->id, source->options},
            learned_by(*source));
    const std::lock_guard lock(data_mutex_);
    report(save_schedule_.saved(model), "checkpoint_saved", service::Severity::kInformation,
           "what was learned is saved again");
  } catch (const std::exception& error) {
    const std::lock_guard lock(data_mutex_);
    report(save_schedule_.failed(model), "checkpoint_failed", service::Severity::kError,
           fmt::format("{}; tried again every {:g} s", error.what(), options_.checkpoint_period_s));
  }
}

// Before the first sample is answered. A checkpoint that can't be used is reported and put aside,
// since another configuration may take it, and learning begins anew.
void CompensationNode::resume(Gyro& source) {
  const auto file = options_.checkpoint_dir / checkpoint_file_name(source.id, kLatestCheckpoint);
  if (options_.checkpoint_dir.empty()) return;
  const auto report = [&](const char* code, service::Severity severity, const std::string& text) {
    host_.raise({.code = code,
                 .severity = severity,
                 .text = "gyro " + std::to_string(source.id) + ": " + text,
                 .gyro_id = source.id,
                 .sensor_time_ns = 0});
  };
  source.is_saved = saved_gyros_.claim(
      source.id, options_.redundant ? files::Claim::kTogether : files::Claim::kAlone);
  if (!source.is_saved) {
    report("checkpoint_taken", service::Severity::kError,
           "another process saves a gyro of this number in " + options_.checkpoint_dir.string() +
               ", so that this one neither goes on from there nor saves; give each its own "
               "--checkpoint-dir");
  }
  std::error_code none;
  if (!source.is_saved || !std::filesystem::exists(file, none)) return;
  const auto report_refused = [&](const std::string& why) {
    const std::string kept = put_aside(options_.checkpoint_dir, source.id);
    report("cannot_resume", service::Severity::kWarning,
           why + (kept.empty() ? "" : "; kept: zerodrift ctl restore " + kept));
  };
  try {
    const auto [loaded, left_behind] =
        checkpoint::resume(file, {source.id, source.configured}, files::boot_id());
    const bool is_of_unknown_age = loaded->is_of_unknown_age;
    const std::string saved =
        how_long_ago(loaded->saved_unix_s, service::unix_time_ns() / 1'000'000'000);
    {
      const std::lock_guard lock(data_mutex_);
      if (!source.compensator().restore_models(loaded))
        throw std::runtime_error("the learner is busy");
    }
    learner_.notify();
    const auto epoch = installed(*loaded);
    if (epoch) {
      const std::lock_guard lock(data_mutex_);
      save_schedule_.resumed({source.id, *epoch});
    }
    if (!left_behind.empty())
      return report_refused(left_behind + "; goes on with its kernels and learns all else anew");
    report("resumed", service::Severity::kInformation,
           "goes on from " + file.string() + ", saved " + saved + ", model epoch " +
               std::to_string(epoch.value_or(0)) +
               (is_of_unknown_age ? ", by another boot of the computer: the bias is learned anew"
                                  : "; what was learned since is lost"));
  } catch (const std::exception& error) {
    report_refused(std::string(error.what()) + "; learning begins anew");
  }
}

}  // namespace zerodrift::services
