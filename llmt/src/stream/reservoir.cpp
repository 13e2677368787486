#include "stream/reservoir.hpp"

#include <bit>
#include <cmath>
#include <iterator>
#include <limits>

namespace llmt {
namespace {

// A step of splitmix64 (Steele, Lea & Flood 2014).
std::uint64_t mixed(std::uint64_t state, std::uint64_t bits) {
  std::uint64_t z = state + bits + 0x9e3779b97f4a7c15ULL;
  z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
  z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
  return z ^ (z >> 31);
}

// One row in eight is held out.
constexpr std::uint64_t held_out_one_in = 8;

}  // namespace

bool Reservoir::add(const double* values) {
  if (capacity_ == 0) return false;
  std::uint64_t hash = 0;
  for (Eigen::Index k = 0; k < width_; ++k) {
    const double value = std::isnan(values[k]) ? std::numeric_limits<double>::infinity() : values[k] + 0.0;  // -0 as 0
    hash = mixed(hash, std::bit_cast<std::uint64_t>(value));
  }
  const bool full = std::ssize(rows_) >= capacity_;
  if (full && hash > std::prev(rows_.end())->first) return false;
  const bool held_out = mixed(hash, 0) % held_out_one_in == 0;
  const auto [at, added] = rows_.try_emplace(hash, Row{{}, held_out, 0});
  ++at->second.times;
  ++times_;
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
