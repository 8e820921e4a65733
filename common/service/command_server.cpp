// SPDX-License-Identifier: Apache-2.0
#include "common/service/command_server.h"

#include <algorithm>
#include <string_view>
#include <utility>

#include "common/core/one_line.h"

namespace zerodrift::service {
namespace {

constexpr std::size_t kLongestText = 255;  // of a reply

}  // namespace

CommandServer::CommandServer(Host& host, std::function<CommandVerdict(const msg::Command&)> obey,
                             std::function<void(const msg::Command&)> overhear)
    : host_(host),
      obey_(std::move(obey)),
      overhear_(std::move(overhear)),
      writer_(host.participant(), host.observer()),
      reader_(
          host.participant(),
          [this](const msg::Command& m, const dds::SampleOrigin&) { on_command(m); },
          host.observer()) {}

void CommandServer::on_command(const msg::Command& command) {
  if (host_.name() != command.service().c_str()) {
    if (overhear_) overhear_(command);
    return;
  }
  if (is_repeated(command)) return;
  const CommandVerdict verdict = obey_(command);
  if (verdict.outcome != CommandVerdict::Outcome::kLater) answer(command, verdict);
}

std::size_t CommandServer::key_of(const msg::Command& command) {
  return std::hash<std::string_view>{}(command.issuer().c_str()) ^ command.request_id();
}

bool CommandServer::is_repeated(const msg::Command& command) {
  const std::size_t key = key_of(command);
  const std::lock_guard lock(mutex_);
  for (std::size_t i = 0; i < std::min(obeyed_count_, obeyed_.size()); ++i) {
    Obeyed& known = obeyed_[i];
    if (known.key != key) continue;
    if (known.answered) writer_.write(known.reply);
    return true;
  }
  obeyed_[obeyed_count_++ % obeyed_.size()] = {.key = key};
  return false;
}

void CommandServer::answer(const msg::Command& command, const CommandVerdict& verdict) {
  msg::CommandReply reply;
  reply.service(host_.name().c_str());
  reply.request_id(command.request_id());
  reply.accepted(verdict.outcome == CommandVerdict::Outcome::kAccepted ? 1 : 0);
  reply.model_epoch(verdict.model_epoch);
  reply.text(core::shortened(verdict.text, kLongestText).c_str());
  {
    const std::lock_guard lock(mutex_);
    for (Obeyed& known : obeyed_) {
      if (known.key != key_of(command)) continue;
      known.answered = true;
      known.reply = reply;
    }
    writer_.write(reply);
  }
  const std::string name = command.name().c_str();
  host_.raise_each({.code = "command_" + name,
                    .severity = Severity::kInformation,
                    .text = name + " from " + command.issuer().c_str() + ": " + verdict.text,
                    .gyro_id = 0,
                    .sensor_time_ns = 0});
}

}  // namespace zerodrift::service
