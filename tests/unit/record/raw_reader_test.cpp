// SPDX-License-Identifier: Apache-2.0
#include "common/dds/raw_reader.h"

#include <gtest/gtest.h>

#include <mutex>
#include <vector>

#include "tests/unit/dds/test_domain.h"
#include "tests/unit/record/recording.h"

namespace zerodrift::dds {
namespace {

// Fast DDS pads no payload, so the bytes are those of the serialised message.
TEST(RawReaderLaws, GivesTheBytesOfTheWireOfEveryKey) {
  const TestDomain domain(112);
  Participant writing("writing", domain.network());
  Participant reading("reading", domain.network());
  std::mutex mutex;
  std::vector<std::string> payloads;
  std::vector<std::string> probes;
  std::vector<std::uint64_t> numbers;
  const RawReader<msg::Temperature> reader(
      reading, [&](const msg::Temperature& message, Bytes payload, const WireOrigin& origin) {
        const std::lock_guard lock(mutex);
        payloads.emplace_back(payload.begin(), payload.end());
        probes.emplace_back(message.probe().c_str());
        numbers.push_back(origin.number);
      });
  Writer<msg::Temperature> coil(writing);
  Writer<msg::Temperature> case_(writing);
  ASSERT_TRUE(eventually([&] { return coil.matched() > 0 && case_.matched() > 0; }));
  std::vector<std::string> sent;
  for (int i = 0; i < 20; ++i) {
    const bool is_coil = i % 2 == 0;
    auto message = to_message(record::reading_at(i, is_coil ? "coil" : "case", 20.0 + i), 1);
    sent.push_back(encode(message));
    ASSERT_TRUE((is_coil ? coil : case_).write(message));
    ASSERT_TRUE(eventually([&] {
      const std::lock_guard lock(mutex);
      return payloads.size() == sent.size();
    }));
  }
  EXPECT_EQ(payloads, sent);
  EXPECT_EQ(probes[0], "coil");
  EXPECT_EQ(probes[1], "case");
  for (std::size_t i = 0; i < numbers.size(); ++i)
    EXPECT_EQ(numbers[i], i / 2 + 1) << "each of the two writers counts its own";
}

TEST(RawReaderLaws, EveryTopicHasItsIdl) {
  for (const auto& spec : kAllTopics) {
    const IdlText& idl = idl_of(spec);
    EXPECT_NE(idl.text.find("module zerodrift"), std::string_view::npos) << spec.name;
    EXPECT_EQ(idl.text.find("#include"), std::string_view::npos)
        << idl.file << ": a schema has to say all by itself";
  }
}

TEST(RawReaderAbuse, APayloadThatIsNoneIsNotDecoded) {
  msg::AngularRate message;
  EXPECT_FALSE(decode(Bytes(), message));
  EXPECT_FALSE(decode(Bytes("\0\7\0\0", 4), message));
  EXPECT_FALSE(decode(Bytes("\0\1\0\0\1\2\3", 7), message));
}

}  // namespace
}  // namespace zerodrift::dds
