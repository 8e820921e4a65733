// SPDX-License-Identifier: Apache-2.0
// The rules themselves. Each check returns one line for every offence: file, what was found, what
// would be right.
#pragma once

#include <cstddef>
#include <filesystem>
#include <set>
#include <string>
#include <vector>

#include "tests/architecture/dependency_log.h"

namespace zerodrift::architecture {

using Offences = std::vector<std::string>;

// Where the project's files are. `root` holds common/, services/, ...; a fixture may stand in for
// it, with headers still coming from `headers`.
struct Tree {
  std::filesystem::path root;
  std::filesystem::path headers;
  std::filesystem::path generated;
};

struct EdgeReport {
  std::size_t edges = 0;  // between two different folders of the project
  Offences offences;
};

// --- what the compiler opened
EdgeReport check_edges(const std::vector<Compilation>& compilations, const Tree& tree);
// Folders whose sources nobody compiled: their rules were not looked at.
Offences check_coverage(const std::vector<Compilation>& compilations, const Tree& tree);

// --- what stands in the sources
Offences check_includes(const Tree& tree);
Offences check_pure_sources(const Tree& tree);
Offences check_cmake_depends(const Tree& tree);
Offences check_topic_literals(const Tree& tree);
// Sources of common/twin and common/diagnosis, and those that include their headers, name no effect
// of `names` but in common/twin/effects.
Offences check_effect_names(const Tree& tree, const std::set<std::string>& names);
// The effects of a tree: one file each.
std::set<std::string> effect_names(const Tree& tree);
Offences check_mains(const Tree& tree);
Offences check_licence_lines(const Tree& tree);
// Sources that name their interpreter ("#!") can be called by their name, as documents do.
Offences check_scripts(const Tree& tree);
// Sources of common/ and services/ that are longer and whose first comment doesn't say why ("Longer
// than other files").
Offences check_lengths(const Tree& tree, std::size_t most_lines);
// Classes of more members (x_) than this say why in the comment before them: "More members than
// other classes ...".
Offences check_members(const Tree& tree, std::size_t most_members);
Offences check_test_folders(const Tree& tree);

}  // namespace zerodrift::architecture
