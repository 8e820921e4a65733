// SPDX-License-Identifier: Apache-2.0
// Rule: what the shipped layouts show is there: each message path of Foxglove's
// (topic{field==value}.field.field) and each curve of PlotJuggler's (topic/field/field) begins with
// a channel that the gateway advertises and goes on with fields of that channel's schema; what is
// plotted is a number, and every panel is laid out.
#include <google/protobuf/descriptor.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <boost/property_tree/ptree.hpp>
#include <boost/property_tree/xml_parser.hpp>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <regex>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include "idl/proto/telemetry.pb.h"
#include "tests/unit/console/fake_client.h"
#include "tests/unit/console/samples.h"

namespace zerodrift::services {
namespace {

using google::protobuf::Descriptor;
using google::protobuf::FieldDescriptor;

std::ifstream shipped(const std::string& name) {
  return std::ifstream(std::string(ZERODRIFT_SOURCE_DIR) + "/deploy/monitoring/" + name);
}

nlohmann::json foxglove_layout() {
  auto file = shipped("foxglove_layout.json");
  return nlohmann::json::parse(file);
}

// Full names of schemas by topic, as a client is told them.
std::map<std::string, std::string> advertised() {
  foxglove::Hub hub{{.name = "test"}, {}};
  Gateway gateway{{.version = "1", .domain = 3}, hub};
  FakeClient client{1};
  hub.opened(client);
  gateway.take(sample_at(0, 1.0, 0.5, 1), {.unix_ns = 1});
  return client.schemas;
}

struct Leaf {
  const Descriptor* message = nullptr;     // of the topic, or that the path ends with
  const FieldDescriptor* field = nullptr;  // null: a whole message
};

// Fails with what of the path isn't there.
void resolve(const std::string& path, Leaf& leaf) {
  static const std::map<std::string, std::string> topics = advertised();
  static const std::regex form(
      R"re((/[a-z0-9_/]+)(?:\{([a-z_]+)==("[a-z_]+"|[0-9]+)\})?((?:\.[a-z_]+)*))re");
  std::smatch parts;
  ASSERT_TRUE(std::regex_match(path, parts, form)) << path;
  ASSERT_TRUE(topics.contains(parts[1])) << path;
  leaf.message = google::protobuf::DescriptorPool::generated_pool()->FindMessageTypeByName(
      topics.at(parts[1]));
  ASSERT_NE(leaf.message, nullptr) << path;
  if (parts[2].matched) {
    const auto* filter = leaf.message->FindFieldByName(parts[2]);
    ASSERT_NE(filter, nullptr) << path;
    EXPECT_EQ(filter->cpp_type() == FieldDescriptor::CPPTYPE_STRING, parts[3].str()[0] == '"')
        << path;
  }
  std::istringstream names(parts[4]);
  std::string name;
  std::getline(names, name, '.');  // before the first
  while (std::getline(names, name, '.')) {
    ASSERT_NE(leaf.message, nullptr) << path << ": nothing is below " << name;
    leaf.field = leaf.message->FindFieldByName(name);
    ASSERT_NE(leaf.field, nullptr) << path << ": no " << name;
    leaf.message = leaf.field->message_type();
  }
}

TEST(FoxgloveLayout, ShowsWhatTheGatewaySends) {
  const auto layout = foxglove_layout();
  int paths = 0;
  for (const auto& [panel, config] : layout.at("configById").items()) {
    if (config.contains("topicPath")) {
      Leaf leaf;
      resolve(config["topicPath"], leaf);
      EXPECT_NE(leaf.message, nullptr) << panel;
      EXPECT_EQ(panel.starts_with("Table!"), leaf.field != nullptr && leaf.field->is_repeated());
      ++paths;
    }
    for (const auto& path : config.value("paths", nlohmann::json::array())) {
      Leaf leaf;
      resolve(path.at("value"), leaf);
      ASSERT_NE(leaf.field, nullptr) << panel;
      EXPECT_FALSE(leaf.field->is_repeated()) << panel;
      const auto wanted = panel.starts_with("StateTransitions!") ? FieldDescriptor::CPPTYPE_ENUM
                                                                 : FieldDescriptor::CPPTYPE_DOUBLE;
      EXPECT_EQ(leaf.field->cpp_type(), wanted) << panel;
      ++paths;
    }
  }
  EXPECT_GE(paths, 15);
}

void collect(const nlohmann::json& place, std::multiset<std::string>& panels) {
  if (place.is_string()) {
    panels.insert(place);
    return;
  }
  EXPECT_TRUE(place.at("direction") == "row" || place.at("direction") == "column");
  collect(place.at("first"), panels);
  collect(place.at("second"), panels);
}

TEST(FoxgloveLayout, HasAPlaceForEachPanelOnce) {
  const auto layout = foxglove_layout();
  std::multiset<std::string> laid_out;
  collect(layout.at("layout"), laid_out);
  std::multiset<std::string> configured;
  for (const auto& [panel, config] : layout.at("configById").items()) configured.insert(panel);
  EXPECT_EQ(laid_out, configured);
}

using boost::property_tree::ptree;

// Splitters as many parts as they say, and a curve or more in every area.
void check_area(const ptree& place, std::vector<std::string>& curves) {
  const auto parts = [&] {
    return std::count_if(place.begin(), place.end(),
                         [](const auto& part) { return part.first != "<xmlattr>"; });
  };
  if (const auto count = place.get_optional<std::ptrdiff_t>("<xmlattr>.count")) {
    EXPECT_EQ(parts(), *count);
    const auto sizes = place.get<std::string>("<xmlattr>.sizes");
    EXPECT_EQ(std::count(sizes.begin(), sizes.end(), ';') + 1, *count);
    for (const auto& [kind, part] : place) {
      if (kind != "<xmlattr>") check_area(part, curves);
    }
    return;
  }
  const std::size_t before = curves.size();
  for (const auto& [kind, part] : place.get_child("plot")) {
    if (kind == "curve") curves.push_back(part.get<std::string>("<xmlattr>.name"));
  }
  EXPECT_GT(curves.size(), before) << place.get<std::string>("<xmlattr>.name");
}

TEST(PlotJugglerLayout, ShowsWhatTheGatewaySends) {
  auto file = shipped("plotjuggler_layout.xml");
  ptree layout;
  boost::property_tree::read_xml(file, layout);
  std::vector<std::string> curves;
  check_area(layout.get_child("root.tabbed_widget.Tab.Container.DockSplitter"), curves);
  EXPECT_GE(curves.size(), 10U);
  for (const std::string& curve : curves) {
    // A topic is /gyro_<G>/<name>: what is behind it are fields.
    const std::size_t fields = curve.find('/', curve.find('/', 1) + 1);
    ASSERT_NE(fields, std::string::npos) << curve;
    std::string path = curve;
    std::replace(path.begin() + static_cast<std::ptrdiff_t>(fields), path.end(), '/', '.');
    Leaf leaf;
    resolve(path, leaf);
    ASSERT_NE(leaf.field, nullptr) << curve;
    EXPECT_EQ(leaf.field->cpp_type(), FieldDescriptor::CPPTYPE_DOUBLE) << curve;
    EXPECT_FALSE(leaf.field->is_repeated()) << curve;
  }
}

}  // namespace
}  // namespace zerodrift::services
