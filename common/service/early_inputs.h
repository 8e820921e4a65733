// SPDX-License-Identifier: Apache-2.0
// What came for a gyro of which no rate has come yet. Whoever sends it makes no gyro: an id costs
// no more than what is kept here, and ids and items are bounded.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <utility>

namespace zerodrift::service {

template <typename Item>
class EarlyInputs {
 public:
  EarlyInputs(std::size_t most_gyros, std::size_t most_items)
      : most_gyros_(most_gyros), most_items_(most_items) {}

  // Of too many gyros the one that was quiet longest is forgotten; of a gyro's items the oldest.
  void keep(std::uint32_t gyro_id, Item item) {
    auto known = find(gyro_id);
    if (known == gyros_.end()) {
      if (gyros_.size() == most_gyros_) {
        gyros_.pop_front();
        ++forgotten_;
      }
      gyros_.push_back({gyro_id, {}});
    } else {
      std::rotate(known, known + 1, gyros_.end());
    }
    std::deque<Item>& items = gyros_.back().items;
    if (items.size() == most_items_) items.pop_front();
    items.push_back(std::move(item));
  }

  // In order of arrival; they are gone then.
  [[nodiscard]] std::deque<Item> take(std::uint32_t gyro_id) {
    const auto known = find(gyro_id);
    if (known == gyros_.end()) return {};
    std::deque<Item> items = std::move(known->items);
    gyros_.erase(known);
    return items;
  }

  [[nodiscard]] std::uint64_t forgotten() const noexcept { return forgotten_; }

 private:
  struct Gyro {
    std::uint32_t id = 0;
    std::deque<Item> items{};
  };
  auto find(std::uint32_t gyro_id) {
    return std::find_if(gyros_.begin(), gyros_.end(),
                        [gyro_id](const Gyro& gyro) { return gyro.id == gyro_id; });
  }

  std::size_t most_gyros_;
  std::size_t most_items_;
  std::deque<Gyro> gyros_;  // the one received last at the end
  std::uint64_t forgotten_ = 0;
};

}  // namespace zerodrift::service
