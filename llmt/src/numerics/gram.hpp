/// \file
/// Gram matrices of rows of features, and the residual sums of squares that follow from them: the two kernels in which
/// growth spends its time.
///
/// Compiled for several instruction sets like dense.hpp, with the same sums in the same order on all of them.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <span>
#include <vector>

#include "numerics/tolerances.hpp"

namespace llmt {

/// Rows of features [1, z, r]: the constant, the regressors and the residuals of the outputs, each times the square
/// root of the row's weight. Rows lie one after the other in memory. Behind the last there is padding for the whole
/// vector registers in which rows are read.
class Features {
 public:
  Features() = default;
  Features(Eigen::Index rows, Eigen::Index coefficients, Eigen::Index outputs)
      : rows_(rows), coefficients_(coefficients), outputs_(outputs), values_(rows * columns() + padding, 0.0) {}

  Eigen::Index rows() const { return rows_; }
  Eigen::Index coefficients() const { return coefficients_; }  ///< constant and regressors
  Eigen::Index outputs() const { return outputs_; }
  Eigen::Index columns() const { return coefficients_ + outputs_; }
  double* row(Eigen::Index i) { return values_.data() + i * columns(); }
  const double* row(Eigen::Index i) const { return values_.data() + i * columns(); }
  /// Prefetches a row that will be needed soon.
  void prefetch(Eigen::Index i) const {
    for (const double* at = row(i); at < row(i + 1); at += 8) {
      __builtin_prefetch(at);
    }
  }

 private:
  static constexpr Eigen::Index padding = 16;
  Eigen::Index rows_ = 0;
  Eigen::Index coefficients_ = 0;
  Eigen::Index outputs_ = 0;
  std::vector<double> values_;
};

/// The memory layout of the lower triangle of a Gram matrix: row after row, each padded to whole vector registers, and
/// padded to a number of rows that is a multiple of four. Values of the padding are undefined.
class GramShape {
 public:
  GramShape(Eigen::Index coefficients, Eigen::Index outputs)
      : coefficients_(coefficients), columns_(coefficients + outputs) {}
  explicit GramShape(const Features& features) : GramShape(features.coefficients(), features.outputs()) {}

  Eigen::Index coefficients() const { return coefficients_; }
  Eigen::Index columns() const { return columns_; }
  static constexpr Eigen::Index row_begin(Eigen::Index i) {
    const Eigen::Index group = i / lanes;
    return lanes * (lanes * group * (group + 1) / 2 + (i - lanes * group) * (group + 1));
  }
  Eigen::Index at(Eigen::Index i, Eigen::Index j) const { return row_begin(i) + j; }  ///< i >= j
  Eigen::Index size() const { return row_begin((columns_ + 3) / 4 * 4); }             ///< in doubles

  static constexpr Eigen::Index lanes = 8;

 private:
  Eigen::Index coefficients_;
  Eigen::Index columns_;
};

/// Adds the Gram matrix of the given rows of `features` to `gram`.
void add_rows(const Features& features, const int* rows, Eigen::Index count, double* gram);

/// gram += other, entry by entry.
void add(const GramShape& shape, const double* other, double* gram);

/// Computes, from Gram matrices, the weighted residual sum of squares of the least-squares fit of the residuals on
/// constant and regressors, and the rank of constant and regressors; for several matrices at once.
///
/// It uses an LDL' factorisation that leaves out columns whose pivot is at most `pivot_tolerance` times their sum of
/// squares. `weights`: of the outputs.
class ResidualSums {
 public:
  ResidualSums(const GramShape& shape, const Eigen::VectorXd& weights);

  /// rss[i] and rank[i] of grams[i], i < count.
  void evaluate(const double* const* grams, Eigen::Index count, double* rss, int* rank);

  /// The same of all matrices in `grams`, which lie one after the other.
  void evaluate(const std::vector<double>& grams, std::vector<double>& rss, std::vector<int>& rank);

  /// Frees the working memory, eight times that of a Gram matrix. evaluate() takes it again.
  void forget() { std::vector<Slot>().swap(scratch_); }

 private:
  struct alignas(64) Slot {
    std::array<double, 8> values;
  };
  GramShape shape_;
  std::vector<double> weights_;
  std::vector<Slot> scratch_;
};

/// Both sides of every cut between two of several parts of rows that follow each other; of cut k, the parts up to k and
/// those behind it.
struct SidesOfCuts {
  std::vector<double> left;  ///< Gram matrices, one after the other
  std::vector<double> right;
  std::vector<double> rss_left;
  std::vector<double> rss_right;
  std::vector<int> rank_left;
  std::vector<int> rank_right;

  /// Sums up the Gram matrices of the parts. Sums are only added to, from the outermost part inwards, and never
  /// subtracted from, so that no digits are lost at the ends. `before`, `behind`: Gram matrices of rows that are left
  /// or right of all cuts; null: there are none.
  void sum(const GramShape& shape, std::span<const double* const> parts, const double* before = nullptr,
           const double* behind = nullptr);

  /// The models that follow from the sums.
  void evaluate(ResidualSums& models);
};

}  // namespace llmt
