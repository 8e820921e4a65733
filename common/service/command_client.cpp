// SPDX-License-Identifier: Apache-2.0
#include "common/service/command_client.h"

#include <fmt/format.h>
#include <pthread.h>

#include <algorithm>
#include <utility>
#include <vector>

#include "common/core/one_line.h"
#include "common/service/monotonic_clock.h"

namespace zerodrift::service {
namespace {

using std::chrono_literals::operator""ms;

constexpr auto kRepeatEvery = 200ms;
constexpr auto kLookForMatchEvery = 20ms;
constexpr std::size_t kMostOpen = 64;
// Bounds of the topic.
constexpr std::size_t kLongestService = 64;
constexpr std::size_t kLongestName = 32;
constexpr std::size_t kLongestArgument = 255;
constexpr std::size_t kLongestIssuer = 64;

std::string what_is_too_long(const CommandRequest& request) {
  const auto check = [](const char* what, const std::string& text, std::size_t longest) {
    return text.size() <= longest ? ""
                                  : fmt::format("the {} has {} characters, at most {} are sent",
                                                what, text.size(), longest);
  };
  for (std::string found : {check("service's name", request.service, kLongestService),
                            check("command's name", request.name, kLongestName),
                            check("argument", request.argument, kLongestArgument)}) {
    if (!found.empty()) return found;
  }
  return "";
}

}  // namespace

CommandClient::CommandClient(dds::Participant& participant, dds::EndpointObserver observer)
    : writer_(participant, observer),
      replies_(
          participant, [this](const msg::CommandReply& m, const dds::SampleOrigin&) { note(m); },
          std::move(observer)),
      thread_([this] { serve(); }) {}

CommandClient::~CommandClient() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
  }
  changed_.notify_all();
  thread_.join();
}

std::uint64_t CommandClient::send(const CommandRequest& request, std::chrono::milliseconds at_most,
                                  Answered answered) {
  using Outcome = CommandAnswer::Outcome;
  std::string refusal = what_is_too_long(request);
  std::uint64_t id = 0;
  {
    const std::lock_guard lock(mutex_);
    id = last_id_ = std::max(last_id_ + 1, static_cast<std::uint64_t>(unix_time_ns()));
    if (refusal.empty() && open_.size() >= kMostOpen)
      refusal = "too many commands wait for their answers; try again";
    if (refusal.empty()) {
      Open open{.command = {},
                .give_up = Clock::now() + at_most,
                .next = Clock::now(),
                .at_most = at_most,
                .answered = std::move(answered)};
      open.command.service(request.service.c_str());
      open.command.name(request.name.c_str());
      open.command.argument(request.argument.c_str());
      open.command.issuer(request.issuer.substr(0, kLongestIssuer).c_str());
      open.command.request_id(id);
      open_.emplace(id, std::move(open));
    }
  }
  if (refusal.empty()) {
    changed_.notify_all();
  } else {
    answered({.outcome = Outcome::kNotSent, .text = std::move(refusal), .request_id = id});
  }
  return id;
}

void CommandClient::note(const msg::CommandReply& reply) {
  {
    const std::lock_guard lock(mutex_);
    if (!open_.contains(reply.request_id())) return;  // another's, or given up
    using Outcome = CommandAnswer::Outcome;
    answers_[reply.request_id()] = {
        .outcome = reply.accepted() != 0 ? Outcome::kDone : Outcome::kRefused,
        .text = reply.text().c_str(),
        .model_epoch = reply.model_epoch(),
        .request_id = reply.request_id()};
  }
  changed_.notify_all();
}

void CommandClient::write_due(Clock::time_point now) {
  if (writer_.matched() == 0 || replies_.matched() == 0) return;
  for (auto& [id, open] : open_) {
    if (now < open.next) continue;
    open.next = now + kRepeatEvery;
    writer_.write(open.command);
  }
}

void CommandClient::give_up_late(Clock::time_point now) {
  for (const auto& [id, open] : open_) {
    if (now < open.give_up || answers_.contains(id)) continue;
    answers_[id] = {.outcome = CommandAnswer::Outcome::kNobody,
                    .text = fmt::format("no service '{}' answered within {:g} s",
                                        core::one_line(open.command.service().c_str()),
                                        std::chrono::duration<double>(open.at_most).count()),
                    .request_id = id};
  }
}

void CommandClient::serve() {
  pthread_setname_np(pthread_self(), "commands");
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    const auto now = Clock::now();
    write_due(now);
    give_up_late(now);
    std::vector<std::pair<Answered, CommandAnswer>> done;
    for (auto& [id, answer] : std::exchange(answers_, {})) {
      const auto open = open_.find(id);
      if (open == open_.end()) continue;
      done.emplace_back(std::move(open->second.answered), std::move(answer));
      open_.erase(open);
    }
    if (!done.empty()) {
      lock.unlock();
      for (const auto& [answered, answer] : done) answered(answer);
      lock.lock();
    } else if (open_.empty()) {
      changed_.wait(lock);
    } else {
      changed_.wait_for(lock, kLookForMatchEvery);
    }
  }
}

}  // namespace zerodrift::service
