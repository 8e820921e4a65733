// SPDX-License-Identifier: Apache-2.0
#include "common/dds/ros2_diagnostics.h"

#include <gtest/gtest.h>

#include <string>
#include <vector>

namespace zerodrift::dds {
namespace {

using Array = diagnostic_msgs::msg::dds_::DiagnosticArray_;

Array converted(const std::vector<RosStatus>& statuses) {
  Array array;
  to_ros_diagnostics(statuses, 1'234'567'890'123, array);
  return array;
}

TEST(RosDiagnostics, CarryWhatIsSaidAndWhen) {
  const Array array = converted({{.level = RosLevel::kStale,
                                  .name = "zerodrift: compensation",
                                  .message = "says nothing",
                                  .hardware_id = "bench",
                                  .values = {{"process", "12"}}}});
  EXPECT_EQ(array.header_().stamp_().sec_(), 1234);
  EXPECT_EQ(array.header_().stamp_().nanosec_(), 567'890'123U);
  ASSERT_EQ(array.status_().size(), 1U);
  const auto& status = array.status_()[0];
  EXPECT_EQ(status.level_(), 3);
  EXPECT_STREQ(status.name_().c_str(), "zerodrift: compensation");
  EXPECT_STREQ(status.message_().c_str(), "says nothing");
  EXPECT_STREQ(status.hardware_id_().c_str(), "bench");
  ASSERT_EQ(status.values_().size(), 1U);
  EXPECT_STREQ(status.values_()[0].key_().c_str(), "process");
  EXPECT_STREQ(status.values_()[0].value_().c_str(), "12");
}

// Rule: the type support lets no sequence out that is beyond its bound (the sample would be lost).
TEST(RosDiagnostics, KeepWithinTheirBounds) {
  RosStatus status{.name = std::string(300, 'n'), .message = std::string(300, 'm')};
  for (int i = 0; i < 20; ++i) status.values.emplace_back(std::string(100, 'k'), "v");
  Array array = converted(std::vector<RosStatus>(300, status));
  EXPECT_EQ(array.status_().size(), 256U);
  EXPECT_EQ(array.status_()[0].values_().size(), 8U);
  EXPECT_EQ(array.status_()[0].name_().size(), 128U);
  CheckedTypeSupport<Array> support;
  eprosima::fastrtps::rtps::SerializedPayload_t payload(support.m_typeSize);
  EXPECT_TRUE(support.serialize(&array, &payload));
}

TEST(RosDiagnostics, AreNewWithEachMessage) {
  Array array = converted({{.name = "a"}, {.name = "b"}});
  to_ros_diagnostics({{.name = "c"}}, 0, array);
  ASSERT_EQ(array.status_().size(), 1U);
  EXPECT_STREQ(array.status_()[0].name_().c_str(), "c");
}

}  // namespace
}  // namespace zerodrift::dds
