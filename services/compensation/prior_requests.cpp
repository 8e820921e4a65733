// SPDX-License-Identifier: Apache-2.0
// The commands adopt and revert: another model of the twin becomes the prior, with a learner that
// knows nothing of what it leaves; the prior before and its learner are set aside.
#include <charconv>
#include <utility>

#include "common/compensation/drift_prior.h"
#include "common/config/compensation_config.h"
#include "services/compensation/compensation_node.h"

namespace zerodrift::services {
namespace {

// "[gyro id:]path", where a path never begins with a digit: it is absolute.
struct Target {
  std::optional<std::uint32_t> gyro_id{};
  std::string path{};
};

Target target_of(const std::string& argument) {
  const std::size_t colon = argument.find(':');
  Target target{.gyro_id = {}, .path = argument};
  if (colon == std::string::npos) return target;
  std::uint32_t id = 0;
  const char* end = argument.data() + colon;
  const auto read = std::from_chars(argument.data(), end, id);
  if (read.ec != std::errc{} || read.ptr != end) return target;
  return {.gyro_id = id, .path = argument.substr(colon + 1)};
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

// The one that is meant; throws std::invalid_argument where that isn't clear.
template <typename Gyro>
Gyro& chosen(const std::vector<Gyro*>& gyros, std::optional<std::uint32_t> id) {
  if (!id && gyros.size() == 1) return *gyros.front();
  std::vector<std::string> known;
  for (Gyro* gyro : gyros) {
    if (id == gyro->id) return *gyro;
    known.push_back(std::to_string(gyro->id));
  }
  throw std::invalid_argument(id ? "found gyro id " + std::to_string(*id) + ", expected one of " +
                                       joined(known)
                                 : "a model is one gyro's, and several are heard: expected "
                                   "--gyro-id, one of " +
                                       joined(known));
}

}  // namespace

void CompensationNode::tell_of_prior() {
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
  if (target.path.empty()) return {.text = "found no path, expected that of a model file"};
  const twin::Model model = config::load_prior(target.path);
  // The compensator's own options: its probes are those that were configured.
  auto change = std::make_shared<compensation::PriorChange>(options_.compensation, model);
  Verdict verdict =
      change_prior(source, std::move(change), "adopted " + compensation::prior_identity(model));
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
    if (!source.compensator->change_prior(change)) {
      return {.text = "the learner of gyro " + std::to_string(source.id) + " is busy; try again"};
    }
  }
  source.change = std::move(change);
  wake_learner();
  Verdict verdict{.outcome = Outcome::kAccepted};
  const auto epoch = installed(*source.change->learner);
  verdict.model_epoch = epoch.value_or(0);
  verdict.text = what + (epoch ? ", model epoch " + std::to_string(*epoch)
                               : std::string("; in force as soon as samples come"));
  return verdict;
}

}  // namespace zerodrift::services
