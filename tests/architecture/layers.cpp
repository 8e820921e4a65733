// SPDX-License-Identifier: Apache-2.0
#include "tests/architecture/layers.h"

namespace zerodrift::architecture {

const Layer* find_layer(std::string_view folder) {
  for (const Layer& layer : kLayers) {
    if (layer.folder == folder) return &layer;
  }
  return nullptr;
}

const Layer* layer_of(std::string_view path) {
  for (const Layer& layer : kLayers) {
    if (path.starts_with(layer.folder) && path.substr(layer.folder.size()).starts_with('/')) {
      return &layer;
    }
  }
  return nullptr;
}

std::set<std::string_view> reachable(const Layer& layer) {
  std::set<std::string_view> folders{layer.folder};
  for (const std::string_view direct : layer.may_depend) {
    if (direct.empty()) continue;
    folders.insert(direct);
    if (const Layer* next = find_layer(direct)) folders.merge(reachable(*next));
  }
  return folders;
}

}  // namespace zerodrift::architecture
