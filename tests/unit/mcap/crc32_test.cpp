// SPDX-License-Identifier: Apache-2.0
#include "common/mcap/crc32.h"

#include <gtest/gtest.h>

#include <string>

namespace zerodrift::mcap {
namespace {

// The check value of CRC-32/ISO-HDLC in the catalogue of parametrised CRC algorithms, and others
// that zlib's crc32() gives.
TEST(Crc32Golden, IsTheOneOfZlib) {
  EXPECT_EQ(crc32("123456789"), 0xCBF43926U);
  EXPECT_EQ(crc32(""), 0U);
  EXPECT_EQ(crc32("a"), 0xE8B7BE43U);
  EXPECT_EQ(crc32("The quick brown fox jumps over the lazy dog"), 0x414FA339U);
  EXPECT_EQ(crc32(std::string(32, '\0')), 0x190A55ADU);
  EXPECT_EQ(crc32(std::string(32, '\xff')), 0xFF6CAB0BU);
}

TEST(Crc32Laws, OfTheWholeIsThatOfItsPartsWhereverItIsCut) {
  std::string text;
  for (int i = 0; i < 100; ++i) text.push_back(static_cast<char>(i * 37));
  for (std::size_t cut = 0; cut <= text.size(); ++cut)
    EXPECT_EQ(crc32(text.substr(cut), crc32(text.substr(0, cut))), crc32(text)) << cut;
}

}  // namespace
}  // namespace zerodrift::mcap
