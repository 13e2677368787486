/// \file
/// Arrays of NumPy as matrices of Eigen, and back.
#pragma once

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>
#include <Eigen/Core>

#include <memory>
#include <utility>

namespace llmt::python {

namespace nb = nanobind;

using Array = nb::ndarray<const double, nb::ndim<2>, nb::device::cpu>;
using Vector = nb::ndarray<const double, nb::ndim<1>, nb::device::cpu>;

/// A view of the rows and columns of an array, whatever its order in memory.
using Rows = Eigen::Map<const Eigen::MatrixXd, Eigen::Unaligned, Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>>;
inline Rows rows_of(const Array& array) {
  return {array.data(), static_cast<Eigen::Index>(array.shape(0)), static_cast<Eigen::Index>(array.shape(1)),
          Eigen::Stride<Eigen::Dynamic, Eigen::Dynamic>(array.stride(1), array.stride(0))};
}

inline Eigen::VectorXd vector_of(const Vector& array) {
  return Eigen::Map<const Eigen::VectorXd, Eigen::Unaligned, Eigen::InnerStride<>>(
      array.data(), static_cast<Eigen::Index>(array.shape(0)), Eigen::InnerStride<>(array.stride(0)));
}

/// The matrix as an array that owns it.
template <class Scalar>
nb::ndarray<nb::numpy, Scalar, nb::ndim<2>> array_of(Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic> matrix) {
  using Matrix = Eigen::Matrix<Scalar, Eigen::Dynamic, Eigen::Dynamic>;
  auto owned = std::make_unique<Matrix>(std::move(matrix));
  const std::size_t rows = static_cast<std::size_t>(owned->rows());
  const std::size_t columns = static_cast<std::size_t>(owned->cols());
  Scalar* data = owned->data();
  nb::capsule owner(owned.get(), [](void* pointer) noexcept { delete static_cast<Matrix*>(pointer); });
  owned.release();
  return nb::ndarray<nb::numpy, Scalar, nb::ndim<2>>(data, {rows, columns}, owner, {1, static_cast<int64_t>(rows)});
}

}  // namespace llmt::python
