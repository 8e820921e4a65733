// SPDX-License-Identifier: Apache-2.0
// A service's side of commands: receives those addressed to it, obeys each once, answers, and
// reports it by an event `command_<name>`.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <mutex>
#include <string>

#include "common/dds/participant.h"
#include "common/service/host.h"

namespace zerodrift::service {

struct CommandVerdict {
  enum class Outcome : std::uint8_t { kRefused, kAccepted, kLater };  // kLater: answer() is called
  Outcome outcome = Outcome::kRefused;
  std::string text{};  // what was done, or why not
  std::uint64_t model_epoch = 0;
};

class CommandServer {
 public:
  // `obey` runs on the receiving thread, once for each request: senders repeat a command until it
  // is answered, since the addressee may be matched late. So may the sender: the answer is repeated
  // too. `overhear`, if there is one, is given those addressed to others, as often as they come.
  CommandServer(Host& host, std::function<CommandVerdict(const msg::Command&)> obey,
                std::function<void(const msg::Command&)> overhear = {});

  // Any thread.
  void answer(const msg::Command& command, const CommandVerdict& verdict);

 private:
  void on_command(const msg::Command& command);
  struct Obeyed {
    std::size_t key = 0;  // of issuer and request
    bool answered = false;
    msg::CommandReply reply{};
  };
  static std::size_t key_of(const msg::Command& command);
  // True for one that was received before, whose answer is given again if there is one.
  bool is_repeated(const msg::Command& command);

  Host& host_;
  std::function<CommandVerdict(const msg::Command&)> obey_;
  std::function<void(const msg::Command&)> overhear_;
  std::mutex mutex_;                 // of what follows
  std::array<Obeyed, 64> obeyed_{};  // the newest
  std::size_t obeyed_count_ = 0;
  dds::Writer<msg::CommandReply> writer_;
  dds::Reader<msg::Command> reader_;
};

}  // namespace zerodrift::service
