/// \file
/// A short list inside its owner, for what is made and copied by the thousand.
#pragma once

#include <array>
#include <cstddef>
#include <vector>

#include "llmt/boosted_model.hpp"

namespace llmt {

/// At most most_boosted_slopes values, without memory of their own.
template <class T>
class Few {
 public:
  std::size_t size() const { return size_; }
  void push_back(const T& value) { values_[size_++] = value; }
  T& operator[](std::ptrdiff_t k) { return values_[k]; }
  const T& operator[](std::ptrdiff_t k) const { return values_[k]; }
  const T* begin() const { return values_.data(); }
  const T* end() const { return values_.data() + size_; }
  operator std::vector<T>() const { return {begin(), end()}; }  // NOLINT(google-explicit-constructor)

 private:
  std::array<T, most_boosted_slopes> values_ = {};
  std::size_t size_ = 0;
};

}  // namespace llmt
