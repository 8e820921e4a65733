// SPDX-License-Identifier: Apache-2.0
#include "tests/architecture/checks.h"

#include <algorithm>
#include <array>
#include <fstream>
#include <functional>
#include <iterator>
#include <optional>
#include <regex>
#include <set>
#include <sstream>

#include "tests/architecture/layers.h"

namespace zerodrift::architecture {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kLicence = "SPDX-License-Identifier: Apache-2.0";
constexpr std::array kOwnFolders{"common", "services", "idl", "tests", "cmake", "deploy", "docker"};
constexpr std::size_t kLongestMain = 40;
// The fixture is wrong on purpose.
constexpr std::string_view kFixtures = "tests/architecture/fixtures/";
// The compiler's command line names it for all sources of a test (tests/support/CMakeLists.txt).
constexpr std::string_view kForcedHeader = "tests/support/paths.h";

// Where files may come from that a pure folder's compilation opens: C++ and C library, kernel
// headers that the C library includes, Eigen, Boost (of which is_pure_header() lets Boost.Math be
// named).
constexpr std::array<std::string_view, 9> kPureSystemFolders{
    "/usr/include/c++/",         "/usr/include/eigen3/",  "/usr/lib/gcc/",
    "/usr/include/x86_64-",      "/usr/include/aarch64-", "/usr/include/linux/",
    "/usr/include/asm-generic/", "/usr/lib/llvm-",        "/usr/include/boost/"};

// Standard headers that pure sources may name: values, containers, algorithms. Not here, because
// pure folders have none of it: threads, clocks, files, streams to the outside, locales.
constexpr std::array<std::string_view, 40> kPureStandardHeaders{
    "algorithm",   "any",      "array",       "atomic",  "bit",       "bitset",     "cassert",
    "cfloat",      "charconv", "chrono",      "cmath",   "compare",   "complex",    "concepts",
    "cstddef",     "cstdint",  "cstring",     "deque",   "exception", "functional", "iterator",
    "limits",      "list",     "map",         "memory",  "new",       "numbers",    "numeric",
    "optional",    "queue",    "ratio",       "set",     "span",      "stdexcept",  "string",
    "string_view", "tuple",    "type_traits", "utility", "variant"};
constexpr std::array<std::string_view, 6> kMorePureHeaders{
    "vector", "sstream", "initializer_list", "unordered_map", "unordered_set", "ranges"};

// <chrono> is for durations and <atomic> for hand-over; reading a clock or drawing unseeded is not.
const std::regex kImpureUse(
    R"(\b(steady_clock|system_clock|high_resolution_clock|random_device|clock_gettime|getenv)\b)"
    R"(|\bstd::(rand|srand|time|printf|fprintf|puts|thread|mutex|cout|cerr)\b)");

const std::regex kInclude(R"(^\s*#\s*include\s*([<"])([^>"]+)[>"])");

std::vector<std::string> lines_of(const fs::path& path) {
  std::ifstream file(path);
  std::vector<std::string> lines;
  for (std::string line; std::getline(file, line);) lines.push_back(line);
  return lines;
}

bool is_below(std::string_view path, std::string_view folder) {
  return path.starts_with(folder) && path.substr(folder.size()).starts_with('/');
}

// `path` below `folder`, or nothing.
std::optional<std::string> below(const std::string& path, const fs::path& folder) {
  const std::string prefix = folder.string();
  if (prefix.empty() || !is_below(path, prefix)) return std::nullopt;
  return path.substr(prefix.size() + 1);
}

// A path of this tree, as "common/...", "services/...", "idl/dds/...".
std::optional<std::string> project_path(const std::string& path, const Tree& tree) {
  if (auto generated = below(path, tree.generated)) return generated;
  if (auto own = below(path, tree.root)) return own;
  return below(path, tree.headers);
}

// The unit that rules speak of: "common/x", "services/x", "idl/dds", "tests/unit".
std::string folder_of(const std::string& path) {
  const auto first = path.find('/');
  if (first == std::string::npos) return path;
  return path.substr(0, path.find('/', first + 1));
}

// All files of some kinds below a folder of the tree, sorted, paths relative to the tree's root.
std::vector<std::string> files(const Tree& tree, const std::string& folder,
                               const std::function<bool(const fs::path&)>& wanted) {
  std::vector<std::string> found;
  if (!fs::is_directory(tree.root / folder)) return found;
  fs::recursive_directory_iterator entries(tree.root / folder);
  for (; entries != fs::recursive_directory_iterator(); ++entries) {
    const fs::directory_entry& entry = *entries;
    std::string path = fs::relative(entry.path(), tree.root).string();
    if (entry.path().filename() == "node_modules") entries.disable_recursion_pending();  // others'
    if (path.starts_with(kFixtures)) continue;
    if (entry.is_regular_file() && wanted(entry.path())) found.push_back(std::move(path));
  }
  std::sort(found.begin(), found.end());
  return found;
}

bool is_cpp(const fs::path& path) {
  static const std::set<std::string> kKinds{".h", ".hpp", ".cpp", ".cc", ".cxx", ".c"};
  return kKinds.contains(path.extension().string());
}

bool is_source(const fs::path& path) {
  static const std::set<std::string> kKinds{".proto", ".idl", ".cmake", ".sh", ".py", ".js"};
  return is_cpp(path) || kKinds.contains(path.extension().string()) ||
         path.filename() == "CMakeLists.txt" || path.filename().string().starts_with("Dockerfile");
}

std::vector<std::string> subfolders(const fs::path& folder) {
  std::vector<std::string> names;
  if (!fs::is_directory(folder)) return names;
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.is_directory()) names.push_back(entry.path().filename().string());
  }
  std::sort(names.begin(), names.end());
  return names;
}

struct Include {
  std::string file;  // relative to the root
  std::size_t line;
  bool quoted;
  std::string named;

  [[nodiscard]] std::string where() const { return file + ':' + std::to_string(line) + ": "; }
};

std::vector<Include> includes(const Tree& tree, const std::string& folder) {
  std::vector<Include> found;
  for (const std::string& file : files(tree, folder, is_cpp)) {
    const auto lines = lines_of(tree.root / file);
    for (std::size_t i = 0; i < lines.size(); ++i) {
      std::smatch match;
      if (!std::regex_search(lines[i], match, kInclude)) continue;
      found.push_back({file, i + 1, match[1] == "\"", match[2]});
    }
  }
  return found;
}

bool is_fast_dds(const std::string& header) {
  return header.starts_with("fastdds/") || header.starts_with("fastrtps/") ||
         header.starts_with("fastcdr/");
}

bool is_pure_system_file(const std::string& path) {
  if (std::any_of(kPureSystemFolders.begin(), kPureSystemFolders.end(),
                  [&](std::string_view folder) { return path.starts_with(folder); })) {
    return true;
  }
  return fs::path(path).parent_path() == "/usr/include";  // the C library's own
}

// The one source of a pure folder that may use one library more: a baseline scheme that is LIBSVM.
bool may_use_libsvm(const std::string& file) {
  return file == "common/regression/schemes/batch_svr.cpp";
}

bool is_pure_header(const std::string& header) {
  const auto in = [&](const auto& names) {
    return std::find(names.begin(), names.end(), header) != names.end();
  };
  return in(kPureStandardHeaders) || in(kMorePureHeaders) || header.starts_with("Eigen/") ||
         header == "unsupported/Eigen/FFT" ||  // of the same package
         header.starts_with("boost/math/");
}

// --- single edges; empty when allowed

std::string judge_common_edge(const Layer& from, const std::string& to) {
  if (reachable(from).contains(folder_of(to))) return "";
  return std::string(from.folder) + " must not reach " + folder_of(to);
}

std::string judge_service_edge(const std::string& service, const std::string& to) {
  const std::string folder = folder_of(to);
  if (folder == service || folder.starts_with("common/") || folder.starts_with("idl/")) return "";
  return service + " must not reach " + folder + "; services share through common/ only";
}

std::string judge_edge(const std::string& from, const std::string& to) {
  if (const Layer* layer = layer_of(from)) return judge_common_edge(*layer, to);
  if (from.starts_with("common/")) return folder_of(from) + " has no line in layers.h";
  if (from.starts_with("services/")) return judge_service_edge(folder_of(from), to);
  if (from.starts_with("idl/") && !to.starts_with("idl/")) return "idl must reach nothing else";
  return "";
}

}  // namespace

EdgeReport check_edges(const std::vector<Compilation>& compilations, const Tree& tree) {
  EdgeReport report;
  for (const Compilation& compilation : compilations) {
    auto from = below(compilation.source, tree.generated);
    if (!from) from = below(compilation.source, tree.root);
    if (!from || from->starts_with("tests/")) continue;
    const Layer* layer = layer_of(*from);
    std::set<std::string> offences;
    for (const std::string& opened : compilation.opened) {
      if (const auto to = project_path(opened, tree)) {
        if (folder_of(*to) == folder_of(*from) || *to == kForcedHeader) continue;
        ++report.edges;
        const std::string offence = judge_edge(*from, *to);
        if (!offence.empty()) offences.insert(*from + ": reads " + *to + ", but " + offence);
      } else if (layer != nullptr && layer->purity == Purity::kPure &&
                 !is_pure_system_file(opened) &&
                 !(may_use_libsvm(*from) && opened == "/usr/include/libsvm/svm.h")) {
        offences.insert(*from + ": reads " + opened + ", but " + std::string(layer->folder) +
                        " may use the standard library, Eigen and Boost.Math only");
      }
    }
    report.offences.insert(report.offences.end(), offences.begin(), offences.end());
  }
  return report;
}

Offences check_coverage(const std::vector<Compilation>& compilations, const Tree& tree) {
  std::set<std::string> compiled;
  for (const Compilation& compilation : compilations) {
    if (const auto source = below(compilation.source, tree.root)) compiled.insert(*source);
  }
  Offences offences;
  for (const char* top : {"common", "services"}) {
    for (const std::string& file :
         files(tree, top, [](const fs::path& path) { return path.extension() == ".cpp"; })) {
      if (!compiled.contains(file)) offences.push_back(file + ": not in Ninja's log; build it");
    }
  }
  return offences;
}

Offences check_includes(const Tree& tree) {
  Offences offences;
  for (const char* top : {"common", "services"}) {
    for (const Include& include : includes(tree, top)) {
      if (is_fast_dds(include.named) && !include.file.starts_with("common/dds/")) {
        offences.push_back(include.where() + "names " + include.named +
                           ", but only common/dds may name Fast DDS");
      }
      const bool of_project = include.named.starts_with("common/") ||
                              include.named.starts_with("services/") ||
                              include.named.starts_with("idl/");
      if (!of_project) continue;
      if (!include.quoted) {
        offences.push_back(include.where() + "<" + include.named + "> should stand in quotes");
      }
      if (folder_of(include.named) == folder_of(include.file)) continue;
      const Layer* layer = layer_of(include.file);
      const auto allowed = [&] {
        return std::find(layer->may_depend.begin(), layer->may_depend.end(),
                         folder_of(include.named)) != layer->may_depend.end();
      };
      if (layer != nullptr && !allowed()) {
        offences.push_back(include.where() + "names " + include.named + ", but " +
                           std::string(layer->folder) + " may not name " +
                           folder_of(include.named));
      } else if (layer == nullptr) {
        const std::string offence = judge_edge(include.file, include.named);
        if (!offence.empty()) {
          offences.push_back(include.where() + "names " + include.named + ", but " + offence);
        }
      }
    }
  }
  return offences;
}

Offences check_pure_sources(const Tree& tree) {
  Offences offences;
  for (const Layer& layer : kLayers) {
    if (layer.purity != Purity::kPure) continue;
    const std::string folder(layer.folder);
    for (const Include& include : includes(tree, folder)) {
      if (include.named == "libsvm/svm.h" && may_use_libsvm(include.file)) continue;
      if (!include.quoted && !is_pure_header(include.named)) {
        offences.push_back(include.where() + "<" + include.named +
                           "> is not among the headers that pure folders may use");
      }
    }
    for (const std::string& file : files(tree, folder, is_cpp)) {
      const auto lines = lines_of(tree.root / file);
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string code = lines[i].substr(0, lines[i].find("//"));
        std::smatch match;
        if (!std::regex_search(code, match, kImpureUse)) continue;
        offences.push_back(file + ':' + std::to_string(i + 1) + ": uses " + match[0].str() +
                           "; pure folders take time and randomness as arguments");
      }
    }
  }
  return offences;
}

Offences check_cmake_depends(const Tree& tree) {
  static const std::regex kDepends(R"(zerodrift::(\w+))");
  Offences offences;
  for (const std::string& name : subfolders(tree.root / "common")) {
    const std::string folder = "common/" + name;
    const Layer* layer = find_layer(folder);
    if (layer == nullptr) {
      offences.push_back(folder + ": has no line in tests/architecture/layers.h");
      continue;
    }
    const auto lines = lines_of(tree.root / folder / "CMakeLists.txt");
    for (const std::string& line : lines) {
      const std::string code = line.substr(0, line.find('#'));
      for (std::sregex_iterator it(code.begin(), code.end(), kDepends), end; it != end; ++it) {
        const std::string target = (*it)[1];
        const std::string on = target == "idl"                  ? "idl/dds"
                               : target == "proto"              ? "idl/proto"
                               : target == "regression_schemes" ? "common/regression"
                                                                : "common/" + target;
        if (!reachable(*layer).contains(on)) {
          offences.push_back(folder + "/CMakeLists.txt: depends on zerodrift::" + target +
                             ", which layers.h does not allow");
        }
      }
    }
  }
  return offences;
}

Offences check_topic_literals(const Tree& tree) {
  static const std::regex kSpec(R"re(TopicSpec\s+k\w+\{\s*"(\w+)")re");
  // Names of one word ("event", "temperature") are ordinary words that other literals may hold.
  std::set<std::string> names;
  std::size_t specs = 0;
  for (const std::string& line : lines_of(tree.root / "common/dds/topics.h")) {
    std::smatch match;
    if (!std::regex_search(line, match, kSpec)) continue;
    ++specs;
    if (match[1].str().find('_') != std::string::npos) names.insert(match[1]);
  }
  Offences offences;
  if (specs == 0) offences.push_back("common/dds/topics.h: no TopicSpec found");
  static const std::regex kLiteral(R"re("(\w+)")re");
  static const std::regex kMakesTopic(R"(create_topic\s*\(|TopicSpec\s*(\w+\s*)?\{)");
  for (const char* top : {"common", "services"}) {
    for (const std::string& file : files(tree, top, is_cpp)) {
      if (file == "common/dds/topics.h") continue;
      const auto lines = lines_of(tree.root / file);
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string code = lines[i].substr(0, lines[i].find("//"));
        const std::string where = file + ':' + std::to_string(i + 1) + ": ";
        for (std::sregex_iterator it(code.begin(), code.end(), kLiteral), end; it != end; ++it) {
          if (names.contains((*it)[1])) {
            offences.push_back(where + "spells out topic " + it->str() +
                               "; topics are named in common/dds/topics.h only");
          }
        }
        if (!file.starts_with("common/dds/") && std::regex_search(code, kMakesTopic)) {
          offences.push_back(where + "makes a topic; only common/dds does");
        }
      }
    }
  }
  return offences;
}

std::set<std::string> effect_names(const Tree& tree) {
  std::set<std::string> names;
  for (const auto& entry : fs::directory_iterator(tree.root / "common/twin/effects")) {
    if (entry.path().extension() == ".cpp") names.insert(entry.path().stem());
  }
  return names;
}

Offences check_effect_names(const Tree& tree, const std::set<std::string>& names) {
  static const std::regex kLiteral(R"re("(\w+)")re");
  const auto is_of_twin = [](const std::string& path) {
    return path.starts_with("common/twin/") || path.starts_with("common/diagnosis/");
  };
  Offences offences;
  for (const char* top : {"common", "services"}) {
    std::set<std::string> looked_at;
    for (const Include& include : includes(tree, top)) {
      if (is_of_twin(include.named) || is_of_twin(include.file)) looked_at.insert(include.file);
    }
    for (const std::string& file : looked_at) {
      if (file.starts_with("common/twin/effects/")) continue;
      const auto lines = lines_of(tree.root / file);
      for (std::size_t i = 0; i < lines.size(); ++i) {
        const std::string code = lines[i].substr(0, lines[i].find("//"));
        for (std::sregex_iterator it(code.begin(), code.end(), kLiteral), end; it != end; ++it) {
          if (!names.contains((*it)[1])) continue;
          offences.push_back(file + ':' + std::to_string(i + 1) + ": names effect " + it->str() +
                             "; what a search must know of it stands in its definition");
        }
      }
    }
  }
  return offences;
}

Offences check_mains(const Tree& tree) {
  Offences offences;
  for (const std::string& service : subfolders(tree.root / "services")) {
    const fs::path main = tree.root / "services" / service / "main.cpp";
    const std::string name = "services/" + service + "/main.cpp";
    if (!fs::exists(main)) {
      offences.push_back(name + ": missing");
      continue;
    }
    const std::size_t lines = lines_of(main).size();
    if (lines > kLongestMain) {
      offences.push_back(name + ": has " + std::to_string(lines) + " lines, at most " +
                         std::to_string(kLongestMain) + " are allowed");
    }
  }
  return offences;
}

Offences check_licence_lines(const Tree& tree) {
  Offences offences;
  for (const char* top : kOwnFolders) {
    for (const std::string& file : files(tree, top, is_source)) {
      const auto lines = lines_of(tree.root / file);
      const bool script = !lines.empty() && lines.front().starts_with("#!");
      const std::size_t first = script ? 1 : 0;
      if (lines.size() > first && lines[first].ends_with(kLicence)) continue;
      offences.push_back(file + ": does not begin with \"" + std::string(kLicence) + "\"");
    }
  }
  return offences;
}

Offences check_scripts(const Tree& tree) {
  Offences offences;
  for (const char* top : kOwnFolders) {
    for (const std::string& file : files(tree, top, is_source)) {
      const auto lines = lines_of(tree.root / file);
      if (lines.empty() || !lines.front().starts_with("#!")) continue;
      const auto rights = fs::status(tree.root / file).permissions();
      if ((rights & fs::perms::owner_exec) == fs::perms::none)
        offences.push_back(file + ": names its interpreter, but is not executable (chmod +x)");
    }
  }
  return offences;
}

Offences check_lengths(const Tree& tree, std::size_t most_lines) {
  Offences offences;
  for (const char* top : {"common", "services"}) {
    for (const std::string& file : files(tree, top, is_source)) {
      const auto lines = lines_of(tree.root / file);
      const auto comment_ends = std::find_if(
          lines.begin(), lines.end(), [](const auto& line) { return !line.starts_with("//"); });
      const bool says_why = std::any_of(lines.begin(), comment_ends, [](const auto& line) {
        return line.starts_with("// Longer than other files");
      });
      if (lines.size() <= most_lines || says_why) continue;
      offences.push_back(file + ": has " + std::to_string(lines.size()) + " lines; more than " +
                         std::to_string(most_lines) +
                         " want a reason in the first comment, \"Longer than other files ...\"");
    }
  }
  return offences;
}

namespace {

// How many members a line of a class declares, by this project's format and names.
std::size_t members_declared(const std::string& line) {
  static const std::regex kDeclaration(
      R"(^  [A-Za-z].*\b\w+_(\[\w+\]|\{.*\}|\s*=.*)?;\s*(//.*)?$)");
  static const std::regex kMember(R"(\b\w+_(?=\s*[,;{=\[]))");
  if (!std::regex_search(line, kDeclaration)) return 0;
  const std::string code = line.substr(0, line.find("//"));
  return static_cast<std::size_t>(
      std::distance(std::sregex_iterator(code.begin(), code.end(), kMember), {}));
}

}  // namespace

Offences check_members(const Tree& tree, std::size_t most_members) {
  const auto gives_reason = [](const std::string& line) {
    return line.find("More members than other classes") != std::string::npos;
  };
  static const std::regex kClass(R"(^class (\w+)[^;]*\{(\s*//.*)?$)");
  Offences offences;
  for (const char* top : {"common", "services"}) {
    for (const std::string& file : files(tree, top, is_cpp)) {
      std::string name;
      std::size_t members = 0;
      bool says_why = false;
      for (const std::string& line : lines_of(tree.root / file)) {
        std::smatch match;
        if (std::regex_search(line, match, kClass)) {
          name = match[1];
          members = 0;
          says_why = says_why || gives_reason(line);
        } else if (line == "};" && !name.empty()) {
          if (members > most_members && !says_why) {
            offences.push_back(file + ": " + name + " has " + std::to_string(members) +
                               " members; more than " + std::to_string(most_members) +
                               " want a reason in its comment, \"More members than other "
                               "classes ...\"");
          }
          name.clear();
          says_why = false;
        } else if (name.empty()) {
          const bool is_comment = line.starts_with("//");
          says_why = is_comment && (says_why || gives_reason(line));
        } else {
          members += members_declared(line);
        }
      }
    }
  }
  return offences;
}

Offences check_test_folders(const Tree& tree) {
  Offences offences;
  for (const std::string& folder : subfolders(tree.root / "common")) {
    if (fs::exists(tree.root / "tests/unit" / folder / "CMakeLists.txt")) continue;
    offences.push_back("common/" + folder + ": has no tests/unit/" + folder + "/CMakeLists.txt");
  }
  return offences;
}

}  // namespace zerodrift::architecture
