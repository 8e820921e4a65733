// SPDX-License-Identifier: Apache-2.0
// The layer rules of the project, as data. A new folder gets a line here, or the test fails.
#pragma once

#include <array>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace zerodrift::architecture {

enum class Purity { kPure, kSystem };  // kPure: std, Eigen, Boost.Math only, see checks.cpp

struct Layer {
  std::string_view folder;  // below the root
  Purity purity;
  std::array<std::string_view, 11> may_depend;  // folders it may name itself; unused entries empty
};

// clang-format off
inline constexpr std::array kLayers{
    Layer{"common/core",         Purity::kPure,   {}},
    Layer{"common/thermal",      Purity::kPure,   {"common/core"}},
    Layer{"common/regression",   Purity::kPure,   {"common/core"}},
    Layer{"common/experts",      Purity::kPure,   {"common/core"}},
    Layer{"common/navigation",   Purity::kPure,   {"common/core"}},
    Layer{"common/allan",        Purity::kPure,   {"common/core"}},
    Layer{"common/twin",         Purity::kPure,   {"common/core"}},
    Layer{"common/compensation", Purity::kPure,   {"common/core", "common/thermal", "common/regression", "common/experts", "common/navigation", "common/twin"}},
    Layer{"common/comparison",   Purity::kPure,   {"common/core", "common/thermal", "common/regression", "common/experts", "common/allan", "common/compensation"}},
    Layer{"common/diagnosis",    Purity::kPure,   {"common/core", "common/twin", "common/allan"}},
    Layer{"common/files",        Purity::kSystem, {"common/core"}},
    Layer{"common/mcap",         Purity::kSystem, {"common/core", "common/files"}},
    Layer{"common/record",       Purity::kSystem, {"common/core", "common/files", "common/mcap"}},
    Layer{"common/checkpoint",   Purity::kSystem, {"common/core", "common/thermal", "common/regression", "common/compensation", "common/files", "idl/proto"}},
    Layer{"common/report",       Purity::kSystem, {"common/core", "common/files"}},
    Layer{"common/measurement",  Purity::kSystem, {"common/core", "common/twin", "common/diagnosis", "common/record", "common/report"}},
    Layer{"common/evaluation",   Purity::kSystem, {"common/core", "common/allan", "common/twin", "common/compensation", "common/comparison", "common/navigation", "common/mcap", "common/record", "common/report", "common/measurement", "common/config"}},
    Layer{"common/drivers",      Purity::kSystem, {"common/core"}},
    Layer{"common/config",       Purity::kSystem, {"common/core", "common/thermal", "common/regression", "common/navigation", "common/compensation", "common/twin", "common/files", "idl/proto"}},
    Layer{"common/dds",          Purity::kSystem, {"common/core", "common/files", "idl/dds"}},
    Layer{"common/web",          Purity::kSystem, {"common/core", "common/files"}},
    Layer{"common/foxglove",     Purity::kSystem, {"common/core", "common/web"}},
    Layer{"common/replay",       Purity::kSystem, {"common/core", "common/twin", "common/config", "common/record", "common/dds", "common/service", "idl/dds"}},
    Layer{"common/recording",    Purity::kSystem, {"common/core", "common/files", "common/mcap", "common/record", "common/dds", "common/service"}},
    Layer{"common/service",      Purity::kSystem, {"common/core", "common/compensation", "common/dds", "idl/dds"}},
};
// clang-format on

// The layer a path below the root belongs to: the longest "common/<folder>". Null for others.
const Layer* layer_of(std::string_view path);
const Layer* find_layer(std::string_view folder);

// What the compiler may see while it compiles `layer`: the folder itself and all that it may
// depend on, at any depth.
std::set<std::string_view> reachable(const Layer& layer);

}  // namespace zerodrift::architecture
