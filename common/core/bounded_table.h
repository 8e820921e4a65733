// SPDX-License-Identifier: Apache-2.0
// A table whose keys come from outside: it holds so many and no more. Who is in it stays in it, so
// that made-up keys take no place from a known one; what is refused is counted.
#pragma once

#include <cstddef>
#include <cstdint>
#include <map>
#include <utility>

namespace zerodrift::core {

// One thread. Lookups are O(log entries); only a new entry allocates.
template <typename Key, typename Value>
class BoundedTable {
 public:
  explicit BoundedTable(std::size_t most_entries) : most_entries_(most_entries) {}

  // The key's value, made from `initial` where the key is new; nullptr where the table is full,
  // which is counted.
  template <typename... Initial>
  Value* find_or_make(const Key& key, Initial&&... initial) {
    if (const auto known = entries_.find(key); known != entries_.end()) return &known->second;
    if (entries_.size() >= most_entries_) {
      ++refused_;
      return nullptr;
    }
    return &entries_.try_emplace(key, std::forward<Initial>(initial)...).first->second;
  }
  // The key's value, valid for the table's life; nullptr where it has none.
  [[nodiscard]] Value* find(const Key& key) {
    const auto known = entries_.find(key);
    return known == entries_.end() ? nullptr : &known->second;
  }
  [[nodiscard]] bool contains(const Key& key) const { return entries_.contains(key); }

  // In the order of their keys.
  [[nodiscard]] const std::map<Key, Value>& entries() const noexcept { return entries_; }
  [[nodiscard]] std::map<Key, Value>& entries() noexcept { return entries_; }
  [[nodiscard]] std::size_t size() const noexcept { return entries_.size(); }
  [[nodiscard]] bool empty() const noexcept { return entries_.empty(); }
  [[nodiscard]] std::uint64_t refused() const noexcept { return refused_; }

 private:
  std::size_t most_entries_;
  std::map<Key, Value> entries_;
  std::uint64_t refused_ = 0;
};

}  // namespace zerodrift::core
