// SPDX-License-Identifier: Apache-2.0
// Commands to services, and their answers. A command is written again and again until it is
// answered, since its service may be matched later than others; the service obeys once, by issuer
// and request id.
#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>
#include <thread>

#include "common/dds/participant.h"

namespace zerodrift::service {

struct CommandRequest {
  std::string service{};   // at most 64 characters
  std::string name{};      // at most 32
  std::string argument{};  // at most 255
  std::string issuer{};    // at most 64: who asks, for the service's own record
};

struct CommandAnswer {
  enum class Outcome : std::uint8_t {
    kDone,
    kRefused,
    kNobody,  // no answer within the time
    kNotSent  // too long for the topic, or too many are under way
  };
  Outcome outcome = Outcome::kNobody;
  std::string text{};  // the service's; else one line that says what is the matter
  std::uint64_t model_epoch = 0;
  std::uint64_t request_id = 0;
};

class CommandClient {
 public:
  explicit CommandClient(dds::Participant& participant, dds::EndpointObserver observer = {});
  ~CommandClient();  // open commands are given up without an answer
  CommandClient(const CommandClient&) = delete;
  CommandClient& operator=(const CommandClient&) = delete;

  // Any thread; never waits. `answered` is called once: at once where the command can't be sent,
  // else on the client's own thread. The request id.
  using Answered = std::function<void(const CommandAnswer&)>;
  std::uint64_t send(const CommandRequest& request, std::chrono::milliseconds at_most,
                     Answered answered);

 private:
  using Clock = std::chrono::steady_clock;
  struct Open {
    msg::Command command;
    Clock::time_point give_up;
    Clock::time_point next;
    std::chrono::milliseconds at_most;
    Answered answered;
  };
  void note(const msg::CommandReply& reply);
  void serve();
  void write_due(Clock::time_point now);
  void give_up_late(Clock::time_point now);

  std::mutex mutex_;
  std::condition_variable changed_;
  std::map<std::uint64_t, Open> open_;  // by request id
  std::map<std::uint64_t, CommandAnswer> answers_;
  std::uint64_t last_id_ = 0;
  bool stopping_ = false;
  dds::Writer<msg::Command> writer_;
  dds::Reader<msg::CommandReply> replies_;
  std::thread thread_;
};

}  // namespace zerodrift::service
