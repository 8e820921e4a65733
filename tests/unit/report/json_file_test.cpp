// SPDX-License-Identifier: Apache-2.0
#include "common/report/json_file.h"

#include <gtest/gtest.h>

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "common/files/file_error.h"
#include "tests/support/scratch_folder.h"

namespace zerodrift::report {
namespace {

class JsonFile : public ScratchFolder {};

TEST_F(JsonFile, KeepsTheOrderOfKeysAndMakesNullOfWhatIsNoNumber) {
  nlohmann::ordered_json value;
  value["z"] = 0.1;
  value["a"] = std::nan("");
  value["m"] = {std::numeric_limits<double>::infinity(), 5};
  write_json(path("a.json"), value);
  EXPECT_EQ(content(path("a.json")),
            "{\n  \"z\": 0.1,\n  \"a\": null,\n  \"m\": [\n    null,\n    5\n  ]\n}\n");
  EXPECT_EQ(file_count(), 1U);
}

TEST_F(JsonFile, EveryFiniteDoubleReadsBackWithTheSameBits) {
  constexpr std::uint64_t kSeed = 3;
  std::mt19937_64 random{kSeed};
  std::vector<double> values{0.0, -0.0, std::numeric_limits<double>::denorm_min(),
                             std::numeric_limits<double>::max(), 1.0 / 3.0};
  while (values.size() < 20000) {
    const double value = std::bit_cast<double>(random());
    if (std::isfinite(value)) values.push_back(value);
  }
  write_json(path("a.json"), values);
  const auto back = nlohmann::json::parse(content(path("a.json")));
  ASSERT_EQ(back.size(), values.size());
  for (std::size_t i = 0; i < values.size(); ++i) {
    ASSERT_EQ(std::bit_cast<std::uint64_t>(back[i].get<double>()),
              std::bit_cast<std::uint64_t>(values[i]))
        << values[i] << " seed " << kSeed;
  }
}

TEST_F(JsonFile, BrokenUtf8IsReplacedNotRefused) {
  write_json(path("a.json"), nlohmann::ordered_json{{"name", "a\xff"}});
  EXPECT_EQ(nlohmann::json::parse(content(path("a.json")))["name"], "a\uFFFD");
}

TEST_F(JsonFile, MissingFolderIsOneErrorLine) {
  EXPECT_THROW(write_json(path("none/a.json"), 1), files::FileError);
}

}  // namespace
}  // namespace zerodrift::report
