/// \file
/// Sums over rows as values: they can be added to each other and written as bytes.
///
/// A sum is one of these:
/// - a number, an Eigen matrix, or a class with `operator+=`. Such a class is trivially copyable or has `fields`;
/// - a class with a static function `fields(sum)` that returns std::tie of its members, which are sums;
/// - a vector of sums, one of which corresponds to each entry of the other vector;
/// - a map of sums: the sum of two maps has the keys of both.
///
/// Bytes are those of the numbers in the machine's memory. They are meant for other processes of the same program.
#pragma once

#include <Eigen/Core>
#include <concepts>
#include <cstring>
#include <limits>
#include <map>
#include <stdexcept>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

namespace llmt {

template <class T>
concept HasFields = requires(T& sum) {
  T::fields(sum);
};

template <class T>
concept EigenMatrix = std::derived_from<T, Eigen::PlainObjectBase<T>>;

template <class T>
struct IsVector : std::false_type {};
template <class T>
struct IsVector<std::vector<T>> : std::true_type {};

/// sum += other. Vectors and matrices must have the same sizes.
template <class T>
void merge(T& sum, T&& other) {
  if constexpr (requires { sum += std::move(other); }) {
    sum += std::move(other);
  } else if constexpr (HasFields<T>) {
    const auto each = [&](auto&... to) {
      std::apply([&](auto&... from) { (merge(to, std::move(from)), ...); }, T::fields(other));
    };
    std::apply(each, T::fields(sum));
  } else if constexpr (IsVector<T>::value) {
    if constexpr (std::is_arithmetic_v<typename T::value_type>) {
      using Array = Eigen::ArrayX<typename T::value_type>;
      Eigen::Map<Array>(sum.data(), std::ssize(sum)) += Eigen::Map<const Array>(other.data(), std::ssize(other));
    } else {
      for (std::size_t i = 0; i < sum.size(); ++i) merge(sum[i], std::move(other[i]));
    }
  } else {
    sum.merge(other);  // moves those whose key `sum` does not have
    for (auto& [key, value] : other) merge(sum.at(key), std::move(value));
  }
}

/// Appends the bytes of a sum.
template <class T>
void write(const T& sum, std::string& bytes) {
  const auto append = [&](const void* from, std::size_t size) { bytes.append(static_cast<const char*>(from), size); };
  if constexpr (EigenMatrix<T>) {
    write(sum.rows(), bytes);
    write(sum.cols(), bytes);
    append(sum.data(), sum.size() * sizeof(typename T::Scalar));
  } else if constexpr (HasFields<T>) {
    std::apply([&](const auto&... field) { (write(field, bytes), ...); }, T::fields(sum));
  } else if constexpr (std::is_trivially_copyable_v<T>) {
    append(&sum, sizeof sum);
  } else {  // a vector or a map
    write(std::ssize(sum), bytes);
    for (const auto& entry : sum) {
      if constexpr (IsVector<T>::value) {
        write(entry, bytes);
      } else {
        write(entry.first, bytes);
        write(entry.second, bytes);
      }
    }
  }
}

template <class T>
std::string to_bytes(const T& sum) {
  std::string bytes;
  write(sum, bytes);
  return bytes;
}

/// Takes a sum off the front of `bytes`. Throws std::runtime_error if they are cut off.
template <class T>
void read(std::string_view& bytes, T& sum) {
  // The number of parts that follow, each of which has at least one byte.
  const auto read_count = [&]() -> Eigen::Index {
    Eigen::Index count = 0;
    read(bytes, count);
    if (count < 0 || count > std::ssize(bytes)) throw std::runtime_error("llmt: the bytes of a sum are cut off");
    return count;
  };
  const auto take = [&](void* to, std::size_t size) {
    if (size > bytes.size()) throw std::runtime_error("llmt: the bytes of a sum are cut off");
    if (size > 0) std::memcpy(to, bytes.data(), size);
    bytes.remove_prefix(size);
  };
  if constexpr (EigenMatrix<T>) {
    Eigen::Index rows = 0;
    Eigen::Index cols = 0;
    read(bytes, rows);
    read(bytes, cols);
    const Eigen::Index most = std::ssize(bytes) / static_cast<Eigen::Index>(sizeof(typename T::Scalar));
    if (rows < 0 || cols < 0 || (cols > 0 && rows > most / cols)) {
      throw std::runtime_error("llmt: the bytes of a sum are cut off");
    }
    const auto fits = [](int fixed, Eigen::Index size) { return fixed == Eigen::Dynamic || fixed == size; };
    if (!fits(T::RowsAtCompileTime, rows) || !fits(T::ColsAtCompileTime, cols)) {
      throw std::runtime_error("llmt: the bytes of a sum hold a matrix where a vector is expected");
    }
    sum.resize(rows, cols);
    take(sum.data(), sum.size() * sizeof(typename T::Scalar));
  } else if constexpr (HasFields<T>) {
    std::apply([&](auto&... field) { (read(bytes, field), ...); }, T::fields(sum));
  } else if constexpr (std::is_trivially_copyable_v<T>) {
    take(&sum, sizeof sum);
  } else if constexpr (IsVector<T>::value) {
    sum.resize(read_count());
    for (auto& entry : sum) read(bytes, entry);
  } else {
    sum.clear();
    for (Eigen::Index left = read_count(); left > 0; --left) {
      typename T::key_type key{};
      read(bytes, key);
      read(bytes, sum[key]);
    }
  }
}

/// The sum that to_bytes() has written. Throws std::runtime_error if these are not the bytes of one.
template <class T>
T from_bytes(std::string_view bytes) {
  T sum{};
  read(bytes, sum);
  if (!bytes.empty()) throw std::runtime_error("llmt: there are more bytes than those of a sum");
  return sum;
}

/// Smallest and largest of the values seen.
struct Extent {
  double low = std::numeric_limits<double>::infinity();
  double high = -std::numeric_limits<double>::infinity();

  void widen(double value) {
    low = value < low ? value : low;
    high = value > high ? value : high;
  }
  Extent& operator+=(const Extent& other) {
    low = other.low < low ? other.low : low;
    high = other.high > high ? other.high : high;
    return *this;
  }
};

/// Sum of some values with weights.
struct WeightedMean {
  double product = 0.0;
  double weight = 0.0;

  /// 0 if there is no weight.
  double value() const { return weight > 0.0 ? product / weight : 0.0; }
  void add(double value, double of_value) {
    product += of_value * value;
    weight += of_value;
  }
  WeightedMean& operator+=(const WeightedMean& other) {
    product += other.product;
    weight += other.weight;
    return *this;
  }
};

}  // namespace llmt
