// SPDX-License-Identifier: Apache-2.0
// The commands adopt and revert: another model of the twin becomes the prior, with a learner that
// knows nothing of what it leaves; the prior before and its learner are set aside.
#include <charconv>
#include <utility>

#include "common/compensation/drift_prior.h"
#include "services/compensation/command_files.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

// "[gyro id:]name"
struct Target {
  std::optional<std::uint32_t> gyro_id{};
  std::string name{};
};

Target target_of(const std::string& argument) {
  const std::size_t colon = argument.find(':');
  Target target{.gyro_id = {}, .name = argument};
  if (colon == std::string::npos) return target;
  std::uint32_t id = 0;
  const char* end = argument.data() + colon;
  const auto read = std::from_chars(argument.data(), end, id);
  if (read.ec != std::errc{} || read.ptr != end) return target;
  return {.gyro_id = id, .name = argument.substr(colon + 1)};
}

std::string joined(const std::vector<std::string>& lines) {
  std::string text;
  for (const auto& line : lines) text += (text.empty() ? "" : ", ") + line;
  return text;
}

std::string left_out(const twin::Model& model) {
  const auto effects = compensation::effects_left_out(model);
  return effects.empty() ? std::string() : "; left out: " + joined(effects);
}

// The one that is meant; throws CommandRefused where that isn't clear.
template <typename Gyro>
Gyro& chosen(const std::vector<Gyro*>& gyros, std::optional<std::uint32_t> id) {
  if (!id && gyros.size() == 1) return *gyros.front();
  std::vector<std::string> known;
  for (Gyro* gyro : gyros) {
    if (id == gyro->id) return *gyro;
    known.push_back(std::to_string(gyro->id));
  }
  throw CommandRefused(id ? "found gyro id " + std::to_string(*id) + ", expected one of " +
                                joined(known)
                          : "a model is one gyro's, and several send: expected "
                            "--gyro-id, one of " +
                                joined(known));
}

}  // namespace

void CompensationNode::report_prior() {
  const auto& prior = options_.compensation.prior;
  if (!prior) return;
  const bool complete = compensation::effects_left_out(*prior).empty();
  host_.raise({.code = "prior",
               .severity = complete ? service::Severity::kInformation : service::Severity::kWarning,
               .text = "prior: " + compensation::prior_identity(*prior) + left_out(*prior),
               .gyro_id = 0,
               .sensor_time_ns = 0});
}

CompensationNode::Verdict CompensationNode::adopt(const Request& request) {
  const Target target = target_of(request.argument);
  Gyro& source = chosen(request.gyros, target.gyro_id);
  const twin::Model model = model_named(options_.model_dir, target.name);
  // The compensator's own options: its probes are those that were configured.
  auto change = change_to(model, target.name, source.configured);
  Verdict verdict =
      change_prior(source, std::move(change),
                   "adopted " + compensation::prior_identity(model) +
                       " until the service starts anew (`prior` of its configuration: for good)");
  if (verdict.outcome != Outcome::kAccepted) return verdict;
  // Last, since a long list is cut where the reply ends: the epoch never is.
  verdict.text += left_out(model);
  source.prior_before = std::exchange(source.options.prior, model);
  source.can_revert = true;
  return verdict;
}

CompensationNode::Verdict CompensationNode::revert(const Request& request) {
  Gyro& source = chosen(request.gyros, target_of(request.argument).gyro_id);
  if (!source.can_revert)
    return {.text = "no model was adopted since the start or the last revert"};
  Verdict verdict = change_prior(
      source, source.change,
      "reverted to " + (source.prior_before ? compensation::prior_identity(*source.prior_before)
                                            : std::string("no prior")));
  if (verdict.outcome != Outcome::kAccepted) return verdict;
  source.options.prior = std::exchange(source.prior_before, std::nullopt);
  source.can_revert = false;
  return verdict;
}

// `source.change` keeps what went out of force until the next change: the data path frees nothing.
CompensationNode::Verdict CompensationNode::change_prior(
    Gyro& source, std::shared_ptr<compensation::PriorChange> change, const std::string& what) {
  if (awaits_change(source)) {
    return {.text = "the change before is not in force yet; try again when samples come"};
  }
  {
    const std::lock_guard lock(data_mutex_);
    if (!source.compensator().change_prior(change)) return {.text = busy_text({&source}, 0)};
  }
  source.change = std::move(change);
  learner_.notify();
  Verdict verdict{.outcome = Outcome::kAccepted};
  const auto epoch = installed(*source.change->learner);
  verdict.model_epoch = epoch.value_or(0);
  verdict.text = what + (epoch ? ", model epoch " + std::to_string(*epoch)
                               : std::string("; in force as soon as samples come"));
  return verdict;
}

}  // namespace zerodrift::services
