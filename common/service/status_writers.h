// SPDX-License-Identifier: Apache-2.0
// Who writes the statuses of which services: a service is gone with the last who wrote of it.
#pragma once

#include <algorithm>
#include <map>
#include <set>
#include <string>
#include <utility>

namespace zerodrift::service {

// One thread.
template <typename Writer>
class StatusWriters {
 public:
  void note(const Writer& writer, const std::string& service) {
    services_of_[writer].insert(service);
  }

  // The writer is gone: the services that no other writes of, by name.
  [[nodiscard]] std::set<std::string> take_gone(const Writer& writer) {
    auto gone = services_of_.extract(writer);
    if (gone.empty()) return {};
    std::erase_if(gone.mapped(), [this](const std::string& service) {
      return std::any_of(services_of_.begin(), services_of_.end(),
                         [&](const auto& entry) { return entry.second.contains(service); });
    });
    return std::move(gone.mapped());
  }

 private:
  std::map<Writer, std::set<std::string>> services_of_;  // bounded by the participants of a domain
};

}  // namespace zerodrift::service
