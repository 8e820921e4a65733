// SPDX-License-Identifier: Apache-2.0
// The commands that are obeyed at once.
#include <string>
#include <string_view>
#include <vector>

#include "common/service/instance_name.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {

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
  Verdict verdict{.text = "no gyro has sent a sample yet"};
  bool accepted = false;
  const std::vector<Gyro*> led = led_gyros();
  if (led.empty() && !gyros_.empty()) return {.text = kOtherLeadsText};
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
    return "learning is frozen until learn, or until this service starts anew";
  }
  if (command == "learn") {
    source.compensator().learn();
    return "learning goes on when at rest";
  }
  if (command == "reset") {
    accepted = source.compensator().reset_models();
    learner_.notify();
    return "all that was learned is forgotten";
  }
  accepted = false;
  return "unknown command '" + std::string(command) +
         "'; known are freeze, learn, reset, checkpoint, restore, adopt, revert";
}

}  // namespace zerodrift::services
