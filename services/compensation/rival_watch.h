// SPDX-License-Identifier: Apache-2.0
// Whether another compensation answers the same gyros without being told of this one: readers take
// each sample from whichever was first, and get a mixture of two models.
#pragma once

#include <cstdint>
#include <map>
#include <mutex>
#include <string>

#include "common/dds/participant.h"
#include "common/service/host.h"

namespace zerodrift::services {

class RivalWatch {
 public:
  // Every compensation is a rival of one that is alone; of one of several only another of its
  // number is.
  RivalWatch(service::Host& host, bool is_redundant);

  // The tick: reports each once, and tells whether there is one now.
  bool has_rival();

 private:
  using Guid = eprosima::fastrtps::rtps::GUID_t;
  struct Other {
    std::string who{};
    int spoke = 0;
    bool is_reported = false;
  };
  // Statuses that it has to speak, four a second: one that is being replaced gives two at most
  // before it says that it is stopping.
  static constexpr int kStays = 5;

  void note(const msg::ServiceStatus& status, const Guid& writer);
  void forget(const Guid& writer);
  [[nodiscard]] bool is_rival(const std::string& service) const;

  service::Host& host_;
  const bool is_redundant_;
  std::mutex mutex_;
  std::map<Guid, Other> others_;  // bounded by the participants of a domain
  dds::Reader<msg::ServiceStatus> reader_;
};

}  // namespace zerodrift::services
