// SPDX-License-Identifier: Apache-2.0
#include "common/files/claimed_numbers.h"

#include <gtest/gtest.h>

#include <limits>
#include <optional>

#include "tests/support/scratch_folder.h"

namespace zerodrift::files {
namespace {

class ClaimedNumbersLaws : public ScratchFolder {};

TEST_F(ClaimedNumbersLaws, ANumberIsOneOwnersOrThoseThatWriteTheSame) {
  std::optional<ClaimedNumbers> first(folder_);
  ClaimedNumbers second(folder_);
  EXPECT_TRUE(first->claim(1, Claim::kAlone));
  EXPECT_TRUE(first->claim(1, Claim::kAlone));  // its own already
  EXPECT_FALSE(second.claim(1, Claim::kAlone));
  EXPECT_FALSE(second.claim(1, Claim::kTogether));
  EXPECT_TRUE(second.claim(2, Claim::kTogether));
  EXPECT_TRUE(first->claim(2, Claim::kTogether));
  EXPECT_FALSE(ClaimedNumbers(folder_).claim(2, Claim::kAlone));
  EXPECT_TRUE(second.claim(std::numeric_limits<std::uint32_t>::max(), Claim::kAlone));
  first.reset();
  EXPECT_TRUE(second.claim(1, Claim::kAlone));
}

TEST_F(ClaimedNumbersLaws, WhereNothingCanBeWrittenNothingIsClaimed) {
  EXPECT_TRUE(ClaimedNumbers(folder_ / "none").claim(1, Claim::kAlone));
}

}  // namespace
}  // namespace zerodrift::files
