#include "stream/reservoir.hpp"

#include <iterator>

#include "data/row_hash.hpp"

namespace llmt {
namespace {

// One row in eight is held out.
constexpr std::uint64_t held_out_one_in = 8;

}  // namespace

bool Reservoir::add(const double* values, Eigen::Index times) {
  if (capacity_ == 0) return false;
  std::uint64_t hash = 0;
  for (Eigen::Index k = 0; k < width_; ++k) hash = row_hash(hash, values[k]);
  const bool full = std::ssize(rows_) >= capacity_;
  if (full && hash > std::prev(rows_.end())->first) return false;
  const bool held_out = row_hash(hash, 0.0) % held_out_one_in == 0;
  const auto [at, added] = rows_.try_emplace(hash, Row{{}, held_out, 0});
  at->second.times += times;
  times_ += times;
  if (added) {
    at->second.values.assign(values, values + width_);
    if (full) {
      const auto last = std::prev(rows_.end());
      times_ -= last->second.times;
      rows_.erase(last);
    }
  }
  return held_out;
}

void Reservoir::remove_if(const std::function<bool(const double* values)>& drop) {
  std::erase_if(rows_, [&](const auto& entry) {
    const bool dropped = drop(entry.second.values.data());
    times_ -= dropped ? entry.second.times : 0;
    return dropped;
  });
}

Eigen::Index Reservoir::bytes() const {
  // A node of the map: three pointers and a colour beside key and value.
  const Eigen::Index node = 4 * sizeof(void*) + sizeof(std::pair<std::uint64_t, Row>);
  return std::ssize(rows_) * (node + width_ * Eigen::Index{sizeof(double)});
}

}  // namespace llmt
