// SPDX-License-Identifier: Apache-2.0
#include "services/control/service_table.h"

#include <algorithm>
#include <set>
#include <utility>

#include "common/service/host.h"
#include "common/service/instance_name.h"

namespace zerodrift::services {
namespace {

std::string part_of(const std::string& service, std::uint32_t gyro) {
  return service + ':' + std::to_string(gyro);
}

}  // namespace

std::string_view service_of(std::string_view status) noexcept {
  return status.substr(0, status.find(':'));
}

void ServiceTable::note(const msg::ServiceStatus& status, const Guid& writer, std::int64_t now_ns) {
  const std::string name = status.service().c_str();
  Service* service = services_.find_or_make(name);
  if (service == nullptr) return;
  writers_.note(writer, name);
  service->metrics.clear();
  for (const auto& metric : status.metrics()) {
    service->metrics[metric.name().c_str()] = metric.value();
  }
  service->ended_in_order =
      static_cast<service::State>(status.state()) == service::State::kStopping;
  service->is_alive = !service->ended_in_order;
  service->said_ns = now_ns;
}

void ServiceTable::note_gone(const Guid& writer) {
  for (const std::string& name : writers_.take_gone(writer))
    services_.entries().at(name).is_alive = false;
}

const ServiceTable::Service* ServiceTable::find(const std::string& name) const {
  const auto known = entries().find(name);
  return known == entries().end() ? nullptr : &known->second;
}

double ServiceTable::metric(const std::string& name, const std::string& metric,
                            double otherwise) const {
  const Service* service = find(name);
  if (service == nullptr) return otherwise;
  const auto value = service->metrics.find(metric);
  return value == service->metrics.end() ? otherwise : value->second;
}

bool ServiceTable::is_there(const std::string& name) const {
  const Service* service = find(name);
  return service != nullptr && service->is_alive;
}

std::vector<std::string> ServiceTable::instances() const {
  std::set<std::string> found;
  for (const auto& [name, service] : entries()) {
    if (service::is_compensation(service_of(name))) found.emplace(service_of(name));
  }
  std::vector<std::string> names{found.begin(), found.end()};
  // Numbers have no leading zeros.
  std::sort(names.begin(), names.end(), [](const std::string& a, const std::string& b) {
    return std::pair(a.size(), a) < std::pair(b.size(), b);
  });
  return names;
}

std::vector<std::uint32_t> ServiceTable::gyros() const {
  std::set<std::uint32_t> ids;
  for (const auto& [name, service] : entries()) {
    if (!service::is_compensation(service_of(name))) continue;
    if (const auto id = service::gyro_told_of(name)) ids.insert(*id);
  }
  return {ids.begin(), ids.end()};
}

std::optional<std::string> ServiceTable::leader_of(std::uint32_t gyro) const {
  for (const std::string& instance : instances()) {
    const std::string part = part_of(instance, gyro);
    if (is_there(part) && metric(part, "active", 0.0) > 0.0) return instance;
  }
  return std::nullopt;
}

std::string ServiceTable::first_there_or_last_gone(const std::string& part) const {
  std::string last;
  std::int64_t last_said_ns = 0;
  for (const std::string& instance : instances()) {
    const Service* service = find(instance + part);
    if (service == nullptr) continue;
    if (service->is_alive) return instance;
    if (!last.empty() && service->said_ns <= last_said_ns) continue;
    last = instance;
    last_said_ns = service->said_ns;
  }
  return last;
}

std::string ServiceTable::compensation_of(std::uint32_t gyro) const {
  if (const auto leader = leader_of(gyro)) return *leader;
  return first_there_or_last_gone(part_of("", gyro));
}

std::string ServiceTable::compensation() const {
  for (const std::uint32_t gyro : gyros()) {
    if (const auto leader = leader_of(gyro)) return *leader;
  }
  return first_there_or_last_gone("");
}

bool ServiceTable::has_compensation() const {
  return is_there(compensation());
}

std::vector<std::string> ServiceTable::addressees(std::uint32_t gyro) const {
  std::set<std::string> leaders;
  for (const std::uint32_t id : gyros()) {
    if (gyro != 0 && gyro != id) continue;
    if (const auto leader = leader_of(id)) leaders.insert(*leader);
  }
  if (!leaders.empty()) return {leaders.begin(), leaders.end()};
  if (!has_compensation()) return {};
  return {first_there_or_last_gone("")};
}

bool ServiceTable::all_are_led() const {
  const std::vector<std::uint32_t> known = gyros();
  const std::vector<std::string> all = instances();
  const bool is_told = std::any_of(all.begin(), all.end(), [&](const std::string& instance) {
    const auto parts = std::count_if(known.begin(), known.end(), [&](std::uint32_t gyro) {
      return is_there(part_of(instance, gyro));
    });
    return parts > 0 && metric(instance, "gyros", 0.0) == static_cast<double>(parts);
  });
  return is_told && std::all_of(known.begin(), known.end(),
                                [&](std::uint32_t gyro) { return leader_of(gyro).has_value(); });
}

}  // namespace zerodrift::services
