// SPDX-License-Identifier: Apache-2.0
// The commands that are obeyed at once.
#include <algorithm>
#include <string>
#include <string_view>
#include <vector>

#include "common/service/instance_name.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

constexpr const char* kFrozenText =
    "learning is frozen until learn, or until this service starts anew";
constexpr const char* kLearnsText = "learning goes on when at rest";

}  // namespace

CompensationNode::Verdict CompensationNode::on_command(const msg::Command& command) {
  const std::lock_guard lock(data_mutex_);
  const std::string_view name = command.name().c_str();
  const bool needs_files =
      name == "checkpoint" || name == "restore" || name == "adopt" || name == "revert";
  return needs_files ? hand_over(command) : obey(command);
}

// What another instance obeys, this one takes over with the state: it answers otherwise from then
// on.
void CompensationNode::overhear(const msg::Command& command) {
  const std::string_view name = command.name().c_str();
  if (!service::is_compensation(command.service().c_str()) || name == "checkpoint") return;
  const std::lock_guard lock(data_mutex_);
  for (auto& [id, source] : gyros_.entries()) source.pipeline().expect_change();
}

std::vector<Gyro*> CompensationNode::led_gyros() {
  std::vector<Gyro*> led;
  for (auto& [id, source] : gyros_.entries()) {
    if (source.leads()) led.push_back(&source);
  }
  return led;
}

CompensationNode::Verdict CompensationNode::obey(const msg::Command& command) {
  if (gyros_.empty()) return obey_without_gyro(command.name().c_str());
  Verdict verdict;
  bool accepted = false;
  const std::vector<Gyro*> led = led_gyros();
  if (led.empty()) return {.text = kOtherLeadsText};
  for (std::size_t i = 0; i < led.size(); ++i) {
    verdict.text = obey(*led[i], command.name().c_str(), accepted);
    verdict.model_epoch = led[i]->newest().model_epoch;
    if (accepted) continue;
    if (command.name() == "reset") verdict.text = busy_text(led, i);
    break;
  }
  if (accepted) verdict.outcome = Outcome::kAccepted;
  return verdict;
}

CompensationNode::Verdict CompensationNode::obey_without_gyro(std::string_view command) {
  const bool freezes = command == "freeze";
  if (!freezes && command != "learn") return {.text = "no gyro has sent a sample yet"};
  first_is_frozen_ = freezes;
  return {.outcome = Outcome::kAccepted, .text = freezes ? kFrozenText : kLearnsText};
}

// Both commands are for all gyros, so that any of them tells. A standby has it with the state.
bool CompensationNode::is_commanded_to_freeze() const {
  const auto& known = gyros_.entries();
  if (known.empty()) return first_is_frozen_;
  return std::any_of(known.begin(), known.end(), [](const auto& entry) {
    return entry.second.compensator().is_commanded_to_freeze();
  });
}

std::string CompensationNode::busy_text(const std::vector<Gyro*>& asked, std::size_t busy) {
  std::string text =
      "the learner of gyro " + std::to_string(asked[busy]->id) + " is busy; try again";
  for (std::size_t i = 0; i < busy; ++i)
    text += (i == 0 ? "; done for gyro " : ", ") + std::to_string(asked[i]->id);
  return text;
}

std::string CompensationNode::obey(Gyro& source, std::string_view command, bool& accepted) {
  accepted = true;
  if (command == "freeze") {
    source.compensator().freeze();
    return kFrozenText;
  }
  if (command == "learn") {
    source.compensator().learn();
    return kLearnsText;
  }
  if (command == "reset") {
    accepted = source.compensator().reset_models();
    if (accepted) save_schedule_.commanded(source.id);
    learner_.notify();
    return "all that was learned is forgotten";
  }
  accepted = false;
  return "unknown command '" + std::string(command) +
         "'; known are freeze, learn, reset, checkpoint, restore, adopt, revert";
}

}  // namespace zerodrift::services
