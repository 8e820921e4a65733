// SPDX-License-Identifier: Apache-2.0
// Holds the whole tree to the layer rules (layers.h): by what the compiler really opened,
// and by what stands in the sources. The same checks run over fixtures/wrong_tree, where each must
// find what was put there, so that no check can pass by looking at nothing.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/architecture/checks.h"
#include "tests/architecture/layers.h"

namespace zerodrift::architecture {
namespace {

const Tree& project() {
  static const Tree tree{.root = ZERODRIFT_SOURCE_DIR,
                         .headers = ZERODRIFT_SOURCE_DIR,
                         .generated = std::string(ZERODRIFT_BINARY_DIR) + "/generated"};
  return tree;
}

const Tree& wrong_tree() {
  static const Tree tree{
      .root = std::string(ZERODRIFT_SOURCE_DIR) + "/tests/architecture/fixtures/wrong_tree",
      .headers = ZERODRIFT_SOURCE_DIR,
      .generated = std::string(ZERODRIFT_BINARY_DIR) + "/generated"};
  return tree;
}

const std::vector<Compilation>& compilations() {
  static const auto log = read_dependencies(ZERODRIFT_NINJA, ZERODRIFT_BINARY_DIR);
  return log;
}

std::string listed(const Offences& offences) {
  std::string text;
  for (const std::string& offence : offences) text += offence + '\n';
  return text;
}

// Exactly one offence for each of `parts`, and no other.
void expect_offences(const Offences& found, const std::vector<std::string>& parts) {
  EXPECT_EQ(found.size(), parts.size()) << listed(found);
  for (const std::string& part : parts) {
    EXPECT_EQ(std::count_if(found.begin(), found.end(),
                            [&](const std::string& line) { return line.starts_with(part); }),
              1)
        << "expected: " << part << "\nfound:\n"
        << listed(found);
  }
}

TEST(CompiledDependencies, EveryEdgeIsAllowed) {
  const EdgeReport report = check_edges(compilations(), project());
  EXPECT_EQ(listed(report.offences), "");
  EXPECT_GT(report.edges, 0U) << "no edge seen: nothing was checked";
  RecordProperty("edges", std::to_string(report.edges));
  std::printf("%zu compilations, %zu edges between folders\n", compilations().size(), report.edges);
}

TEST(CompiledDependencies, EverySourceOfTheTreeWasLookedAt) {
  EXPECT_EQ(listed(check_coverage(compilations(), project())), "");
}

TEST(Sources, IncludeOnlyWhatTheirFolderMay) {
  EXPECT_EQ(listed(check_includes(project())), "");
}

TEST(Sources, OfPureFoldersUseNoThreadClockFileOrUnseededRandomness) {
  EXPECT_EQ(listed(check_pure_sources(project())), "");
}

TEST(Sources, CMakeDependsOnlyOnWhatTheFolderMay) {
  EXPECT_EQ(listed(check_cmake_depends(project())), "");
}

TEST(Sources, TopicsAreNamedInOnePlace) {
  EXPECT_EQ(listed(check_topic_literals(project())), "");
}

TEST(Sources, OutsideItsFileNameNoEffect) {
  const auto names = effect_names(project());
  EXPECT_GT(names.size(), 0U) << "no effect found: nothing was checked";
  EXPECT_EQ(listed(check_effect_names(project(), names)), "");
}

TEST(Sources, MainFunctionsStayShort) {
  EXPECT_EQ(listed(check_mains(project())), "");
}

TEST(Sources, BeginWithTheLicenceLine) {
  EXPECT_EQ(listed(check_licence_lines(project())), "");
}

TEST(Sources, AreExecutableIfTheyNameTheirInterpreter) {
  EXPECT_EQ(listed(check_scripts(project())), "");
}

TEST(Sources, AreShortOrSayWhyNot) {
  constexpr std::size_t kLongest = 500;
  EXPECT_EQ(listed(check_lengths(project(), kLongest)), "");
}

TEST(Sources, ClassesHaveFewMembersOrSayWhyNot) {
  constexpr std::size_t kMost = 20;
  EXPECT_EQ(listed(check_members(project(), kMost)), "");
}

TEST(Sources, EveryCommonFolderHasTests) {
  EXPECT_EQ(listed(check_test_folders(project())), "");
}

TEST(Layers, HaveNoCycle) {
  for (const Layer& layer : kLayers) {
    for (const std::string_view direct : layer.may_depend) {
      const Layer* next = find_layer(direct);
      if (next == nullptr) continue;
      EXPECT_FALSE(reachable(*next).contains(layer.folder)) << layer.folder << " <-> " << direct;
      EXPECT_TRUE(layer.purity == Purity::kSystem || next->purity == Purity::kPure)
          << layer.folder << " is pure and depends on " << direct;
    }
  }
}

// --- the checks are able to fail

TEST(WrongTree, CompiledWrongEdgesAreReported) {
  const EdgeReport report = check_edges(compilations(), wrong_tree());
  EXPECT_GT(report.edges, 0U);
  const auto reported = [&](const std::string& start, const std::string& part) {
    return std::any_of(report.offences.begin(), report.offences.end(), [&](const auto& line) {
      return line.starts_with(start) && line.find(part) != std::string::npos;
    });
  };
  EXPECT_TRUE(reported("common/thermal/wrong_edges.cpp: reads common/regression/kernel.h",
                       "common/thermal must not reach common/regression"))
      << listed(report.offences);
  EXPECT_TRUE(reported("common/thermal/wrong_edges.cpp: reads idl/dds/angular_rate.h",
                       "common/thermal must not reach idl/dds"))
      << listed(report.offences);
  EXPECT_TRUE(reported("common/thermal/wrong_edges.cpp: reads /usr/include/fastrtps/",
                       "standard library, Eigen and Boost.Math only"))
      << listed(report.offences);
  EXPECT_TRUE(reported("services/one/main.cpp: reads services/two/two.h",
                       "services/one must not reach services/two"))
      << listed(report.offences);
}

TEST(WrongTree, SourcesThatNobodyCompiledAreReported) {
  expect_offences(check_coverage(compilations(), wrong_tree()),
                  {"common/unknown/unknown.cpp: not in Ninja's log"});
}

TEST(WrongTree, AnEmptyLogHasNoEdgeAndCoversNothing) {
  std::istringstream empty;
  const auto nothing = parse_dependencies(empty, ZERODRIFT_BINARY_DIR);
  EXPECT_EQ(check_edges(nothing, project()).edges, 0U);
  EXPECT_FALSE(check_coverage(nothing, project()).empty());
}

TEST(WrongTree, WrongIncludesAreReported) {
  expect_offences(
      check_includes(wrong_tree()),
      {"common/drivers/wrong_layer.h:2: names common/record/record_reader.h",
       "common/thermal/wrong_edges.cpp:2: names common/regression/kernel.h",
       "common/thermal/wrong_edges.cpp:3: names idl/dds/angular_rate.h",
       "common/unknown/unknown.cpp:3: names common/core/units.h, but common/unknown has no line",
       "services/one/main.cpp:2: names fastcdr/Cdr.h, but only common/dds may name Fast DDS",
       "services/one/main.cpp:4: names services/two/two.h"});
}

TEST(WrongTree, ImpureSourcesAreReported) {
  expect_offences(check_pure_sources(wrong_tree()),
                  {"common/thermal/impure.h:3: <fstream>", "common/thermal/impure.h:4: <mutex>",
                   "common/thermal/impure.h:5: <random>", "common/thermal/impure.h:6: <thread>",
                   "common/thermal/impure.h:10: uses steady_clock",
                   "common/thermal/impure.h:11: uses random_device",
                   "common/thermal/impure.h:13: <libsvm/svm.h>",
                   "common/thermal/impure.h:14: <boost/asio.hpp>"});
}

TEST(WrongTree, WrongCMakeDependsAreReported) {
  expect_offences(
      check_cmake_depends(wrong_tree()),
      {"common/thermal/CMakeLists.txt: depends on zerodrift::dds", "common/unknown: has no line"});
}

TEST(WrongTree, TopicsNamedElsewhereAreReported) {
  expect_offences(check_topic_literals(wrong_tree()),
                  {"services/two/two.h:3: spells out topic \"compensated_rate\"",
                   "services/two/two.h:4: makes a topic"});
}

TEST(WrongTree, EffectsNamedOutsideTheirFilesAreReported) {
  expect_offences(check_effect_names(wrong_tree(), effect_names(project())),
                  {"services/two/effect.h:4: names effect \"shupe\""});
}

TEST(WrongTree, LongAndMissingMainsAreReported) {
  expect_offences(check_mains(wrong_tree()),
                  {"services/one/main.cpp: has 41 lines", "services/two/main.cpp: missing"});
}

TEST(WrongTree, MissingLicenceLinesAreReported) {
  expect_offences(check_licence_lines(wrong_tree()),
                  {"common/unknown/unknown.cpp: does not begin"});
}

TEST(WrongTree, ScriptsThatNobodyCanCallAreReported) {
  expect_offences(check_scripts(wrong_tree()), {"deploy/not_executable.sh: names its interpreter"});
}

TEST(WrongTree, LongSourcesWithoutAReasonAreReported) {
  constexpr std::size_t kOneLess = 40;  // than the longest of the fixtures has
  expect_offences(check_lengths(wrong_tree(), kOneLess), {"services/one/main.cpp: has 41 lines"});
}

TEST(WrongTree, ClassesOfManyMembersWithoutAReasonAreReported) {
  expect_offences(check_members(wrong_tree(), 2),
                  {"common/drivers/wrong_layer.h: Crowded has 3 members"});
}

TEST(WrongTree, MissingTestFoldersAreReported) {
  expect_offences(check_test_folders(wrong_tree()),
                  {"common/dds: has no tests", "common/drivers: has no tests",
                   "common/thermal: has no tests", "common/unknown: has no tests"});
}

TEST(DependencyLog, StaleEntriesAreLeftOutAndRelativePathsResolved) {
  std::istringstream log(
      "a.o: #deps 2, deps mtime 1 (VALID)\n    ../src/a.cpp\n    gen/a.h\n\n"
      "b.o: #deps 2, deps mtime 1 (STALE)\n    ../src/b.cpp\n    gen/b.h\n\n");
  const auto parsed = parse_dependencies(log, "/x/build");
  ASSERT_EQ(parsed.size(), 1U);
  EXPECT_EQ(parsed[0].source, "/x/src/a.cpp");
  EXPECT_EQ(parsed[0].opened, std::vector<std::string>{"/x/build/gen/a.h"});
}

TEST(DependencyLog, OfUnitedSourcesEachCountsWithWhatAnyOpened) {
  std::istringstream log(
      "f/Unity/unity_run_0_cxx.cxx.o: #deps 5, deps mtime 1 (VALID)\n"
      "    f/Unity/unity_run_0_cxx.cxx\n    ../src/a.cpp\n    gen/a.h\n    ../src/b.cpp\n"
      "    gen/b.h\n\n");
  const auto parsed = parse_dependencies(log, "/x/build");
  ASSERT_EQ(parsed.size(), 2U);
  const std::vector<std::string> headers{"/x/build/gen/a.h", "/x/build/gen/b.h"};
  EXPECT_EQ(parsed[0].source, "/x/src/a.cpp");
  EXPECT_EQ(parsed[0].opened, headers);
  EXPECT_EQ(parsed[1].source, "/x/src/b.cpp");
  EXPECT_EQ(parsed[1].opened, headers);
}

}  // namespace
}  // namespace zerodrift::architecture
