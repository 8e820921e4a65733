// SPDX-License-Identifier: Apache-2.0
// `zerodrift bench fleet` at its smallest: every figure is there and consistent, every pair of the
// law is matched, and its light vehicle is what the services are. No time is judged.
#include <gtest/gtest.h>

#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>

#include "tests/system/files.h"
#include "tests/system/system_under_test.h"

namespace zerodrift::system_test {
namespace {

using namespace std::chrono_literals;
using Json = nlohmann::json;

std::string domain_of(const SystemUnderTest& system) {
  return std::to_string(system.network().domain);
}

TEST(BenchFleet, EveryGyroIsFoundAndAnsweredAndEveryFigureIsThere) {
  SystemUnderTest system(Domain::kBenchFleetGyros);
  const auto file = system.path("gyros.json");
  // 60 s to be late: only a chain that stands still is. 20 Hz: no machine is full.
  const Finished bench =
      system.run("zerodrift", {"bench", "fleet", "--only", "gyros", "--gyros", "1,3", "--rate",
                               "20", "--seconds", "0.5", "--deadline", "60000", "--repeat", "1",
                               "--json", file.string(), "--domain", domain_of(system)});
  ASSERT_EQ(bench.exit_code, 0) << bench.err << bench.out;
  const Json figures = Json::parse(content(file));
  ASSERT_EQ(figures.at("gyros").size(), 2u);
  for (const Json& row : figures.at("gyros")) {
    for (const auto& [name, value] : row.items()) {
      if (name == "lost" || name == "late" || name == "load") continue;
      // Counted by the kernel in hundredths of a second, of which half a second may take none.
      if (name.find("_cpu_percent") != std::string::npos) continue;
      EXPECT_GT(value.get<double>(), 0.0) << name;
    }
    const double gyros = row.at("gyros").get<double>();
    EXPECT_EQ(row.at("lost").get<double>(), 0.0);
    EXPECT_EQ(row.at("sent").get<double>(), 10.0 * gyros);
    // A datagram to compensation and one to the subscriber at least, each with its three rates as
    // doubles; the half second is a window of a second at most.
    EXPECT_GE(row.at("datagrams_per_s").get<double>(), 20.0 * gyros);
    EXPECT_GE(row.at("bytes_per_s").get<double>(), 24.0 * row.at("datagrams_per_s").get<double>());
  }
}

TEST(BenchFleet, TheMatchedPairsOfEveryFleetAreThoseOfTheLaw) {
  SystemUnderTest system(Domain::kBenchFleet);  // and the domain after it
  const auto file = system.path("fleets.json");
  const Finished bench =
      system.run("zerodrift",
                 {"bench", "fleet", "--only", "vehicles", "--vehicles", "1,2", "--repeat", "1",
                  "--json", file.string(), "--domain", domain_of(system)},
                 110s);
  ASSERT_EQ(bench.exit_code, 0) << bench.err << bench.out;
  const Json figures = Json::parse(content(file));
  std::map<std::string, int> pairs_of_two;
  for (const Json& fleet : figures.at("fleets")) {
    const auto scheme = fleet.at("scheme").get<std::string>();
    ASSERT_EQ(fleet.at("measured").size(), 2u) << scheme;
    for (const Json& row : fleet.at("measured")) {
      EXPECT_EQ(row.at("matched_by_writers"), row.at("expected_pairs")) << scheme;
      EXPECT_EQ(row.at("matched_by_readers"), row.at("expected_by_readers")) << scheme;
      // The console's readers of status and events hear the two servers, where both name no
      // partition.
      const int of_servers = scheme == "servers" ? 2 * 2 * row.at("vehicles").get<int>() : 0;
      EXPECT_EQ(row.at("expected_by_readers").get<int>(),
                row.at("expected_pairs").get<int>() + of_servers)
          << scheme;
      for (const char* name : {"match_s", "datagrams", "bytes", "cpu_s", "idle_datagrams_per_s",
                               "idle_bytes_per_s", "idle_cpu_percent", "resident_mib"}) {
        EXPECT_GT(row.at(name).get<double>(), 0.0) << scheme << ' ' << name;
      }
      // No datagram is shorter than the heads of IP, UDP and RTPS: 20 + 8 + 20 bytes.
      EXPECT_GE(row.at("bytes").get<double>(), 48.0 * row.at("datagrams").get<double>()) << scheme;
      const bool has_servers = scheme.rfind("servers", 0) == 0;
      EXPECT_EQ(row.at("servers_resident_mib").get<double>() > 0.0, has_servers) << scheme;
    }
    for (const char* size : {"10", "100", "1000"})
      EXPECT_GT(fleet.at("extrapolated").at(size).at("bytes").get<double>(), 0.0) << scheme;
    pairs_of_two[scheme] = fleet.at("measured").at(1).at("matched_by_writers").get<int>();
  }
  ASSERT_EQ(pairs_of_two.size(), 5u);
  // With the square of the vehicles where they share all, as many as there are vehicles else.
  EXPECT_EQ(pairs_of_two["shared"], 2 * pairs_of_two["domains"]);
  EXPECT_EQ(pairs_of_two["servers"], 2 * pairs_of_two["domains"]);
  EXPECT_EQ(pairs_of_two["shared-partitions"], pairs_of_two["domains"]);
  EXPECT_EQ(pairs_of_two["servers-partitions"], pairs_of_two["domains"]);
  EXPECT_NE(bench.out.find("extrapolated"), std::string::npos) << bench.out;
}

// By the name of the process: its endpoints, each topic with "w" or "r". A thermometer's publisher
// has a writer a probe; here each topic counts once.
using Endpoints = std::map<std::string, std::set<std::pair<std::string, char>>>;

Endpoints of_the_bench(const Json& vehicle) {
  Endpoints endpoints;
  for (const Json& process : vehicle) {
    auto name = process.at("service").get<std::string>();
    const int instance = process.at("instance").get<int>();
    if (instance > 0) name += '/' + std::to_string(instance);
    for (const auto& topic : process.at("writers")) endpoints[name].insert({topic, 'w'});
    for (const auto& topic : process.at("readers")) endpoints[name].insert({topic, 'r'});
  }
  return endpoints;
}

Endpoints of_the_services(dds::Participant& participant) {
  constexpr std::size_t kAll = 10000;
  Endpoints endpoints;
  for (const auto& endpoint : participant.remote_endpoints(kAll)) {
    const std::string name = endpoint.process.substr(0, endpoint.process.find(" ("));
    endpoints[name].insert({endpoint.topic, endpoint.is_writer ? 'w' : 'r'});
  }
  return endpoints;
}

TEST(BenchFleet, ItsLightVehicleHasTheEndpointsOfTheServices) {
  SystemUnderTest bench_system(Domain::kBenchFleet);
  const auto file = bench_system.path("vehicle.json");
  const Finished bench =
      bench_system.run("zerodrift", {"bench", "fleet", "--only", "vehicles", "--vehicles", "1",
                                     "--schemes", "domains", "--repeat", "1", "--json",
                                     file.string(), "--domain", domain_of(bench_system)});
  ASSERT_EQ(bench.exit_code, 0) << bench.err << bench.out;
  const Endpoints light = of_the_bench(Json::parse(content(file)).at("vehicle"));
  ASSERT_EQ(light.size(), 7u);

  SystemUnderTest system(Domain::kBenchFleetServices);
  dds::Participant watching("test", system.network());
  const std::string folder = std::string(ZERODRIFT_SOURCE_DIR) + "/config/";
  const Arguments source{"--source",  "simulation",
                         "--model",   folder + "models/paper_fog.yaml",
                         "--profile", folder + "profiles/paper_chamber.yaml"};
  system.start("allan_monitor", {});
  system.start("navigation_filter", {"--latitude", "48", "--heading", "30"});
  system.start(
      "console",
      {"--listen",
       "127.0.0.1:" + std::to_string(20000 + static_cast<int>(Domain::kBenchFleetServices))});
  system.start("compensation", {"--instance", "0", "--redundant"});
  system.start("compensation", {"--instance", "1", "--redundant"});
  system.start("thermal_publisher", source);
  system.start("gyro_publisher", source);
  // Compensation's writer is there from a gyro's first sample on.
  EXPECT_TRUE(eventually([&] { return of_the_services(watching) == light; }));
  EXPECT_EQ(of_the_services(watching), light);
}

}  // namespace
}  // namespace zerodrift::system_test
