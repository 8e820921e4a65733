// SPDX-License-Identifier: Apache-2.0
#include "services/compensation/rival_watch.h"

#include "common/service/instance_name.h"

namespace zerodrift::services {

RivalWatch::RivalWatch(service::Host& host, bool is_redundant)
    : host_(host),
      is_redundant_(is_redundant),
      reader_(
          host.participant(),
          [this](const msg::ServiceStatus& status, const dds::SampleOrigin& origin) {
            note(status, origin.writer);
          },
          host.observer(), [this](const Guid& writer, dds::Departure) { forget(writer); }) {}

bool RivalWatch::is_rival(const std::string& service) const {
  return is_redundant_ ? service == host_.name() : service::is_compensation(service);
}

void RivalWatch::note(const msg::ServiceStatus& status, const Guid& writer) {
  const std::string service = status.service().c_str();
  if (service.find(':') != std::string::npos || !is_rival(service)) return;
  if (host_.participant().is_own(writer)) return;
  if (static_cast<service::State>(status.state()) == service::State::kStopping)
    return forget(writer);
  const std::lock_guard lock(mutex_);
  Other& other = others_[writer];
  ++other.spoke;
  other.who = service + " (host " + status.host().c_str() + ", pid " +
              std::to_string(status.process_id()) + ")";
}

void RivalWatch::forget(const Guid& writer) {
  const std::lock_guard lock(mutex_);
  others_.erase(writer);
}

bool RivalWatch::has_rival() {
  bool has_one = false;
  const std::lock_guard lock(mutex_);
  for (auto& [writer, other] : others_) {
    if (other.spoke < kStays) continue;
    has_one = true;
    if (other.is_reported) continue;
    other.is_reported = true;
    host_.raise({.code = "second_compensation",
                 .severity = service::Severity::kError,
                 .text = other.who +
                         " answers the same gyros: readers get a mixture of two models; end one, "
                         "or start both with --redundant and a number of its own (--instance)",
                 .subject = other.who});
  }
  return has_one;
}

}  // namespace zerodrift::services
