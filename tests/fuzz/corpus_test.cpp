// SPDX-License-Identifier: Apache-2.0
// Every committed input through its target, with any compiler: what a fuzzer once found stays
// found.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <set>
#include <string>
#include <vector>

#include "tests/fuzz/expectations.h"

namespace zerodrift::fuzz {
namespace {

namespace fs = std::filesystem;

constexpr std::uintmax_t kLargestSeed = 4096;

fs::path corpus() {
  return fs::path(ZERODRIFT_SOURCE_DIR) / "tests/fuzz/corpus";
}

std::vector<fs::path> inputs_of(std::string_view target) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(corpus() / target)) files.push_back(entry.path());
  std::sort(files.begin(), files.end());
  return files;
}

std::vector<std::uint8_t> content(const fs::path& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

class Corpus : public testing::TestWithParam<Target> {};

TEST_P(Corpus, IsTakenOrRefusedButBreaksNothing) {
  const auto inputs = inputs_of(GetParam().name);
  ASSERT_FALSE(inputs.empty());
  for (const auto& input : inputs) EXPECT_NO_THROW(GetParam().run(content(input))) << input;
}

TEST_P(Corpus, IsSmall) {
  for (const auto& input : inputs_of(GetParam().name))
    EXPECT_LE(fs::file_size(input), kLargestSeed) << input;
}

// Cheap mutations of each seed, the same ones every time: what needs no fuzzer to be found.
TEST_P(Corpus, BreaksNothingCutShortOrWithAByteChanged) {
  for (const auto& path : inputs_of(GetParam().name)) {
    const auto input = content(path);
    const std::size_t step = input.size() / 16 + 1;
    for (std::size_t at = 0; at < input.size(); at += step) {
      auto changed = input;
      changed[at] = static_cast<std::uint8_t>(changed[at] ^ 0x80U);
      EXPECT_NO_THROW(GetParam().run(changed)) << path << " changed at " << at;
      EXPECT_NO_THROW(GetParam().run(Bytes(input).first(at))) << path << " cut at " << at;
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Target, Corpus, testing::ValuesIn(kTargets),
                         [](const auto& parameter) { return std::string(parameter.param.name); });

TEST(FuzzTargets, HaveACorpusEachAndEachCorpusATarget) {
  std::set<std::string> folders;
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(corpus()))
    folders.insert(entry.path().filename().string());
  for (const Target& target : kTargets) names.insert(std::string(target.name));
  EXPECT_EQ(folders, names);
}

TEST(FuzzTargets, RefuseAnErrorOfTwoLines) {
  EXPECT_THROW(demand_one_line("file.yaml:1: a key\nof two lines"), Broken);
  EXPECT_THROW(demand_one_line(""), Broken);
  EXPECT_NO_THROW(demand_one_line("file.yaml:1: °C"));
}

}  // namespace
}  // namespace zerodrift::fuzz
