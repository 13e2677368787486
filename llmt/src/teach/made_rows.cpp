#include "teach/made_rows.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "base/matrix.hpp"
#include "base/parallel.hpp"
#include "data/column_order.hpp"
#include "llmt/random.hpp"

namespace llmt {
namespace {

// Near rows are looked for among at most so many, evenly spaced ones.
constexpr Eigen::Index most_near_rows = 4000;

// The squared distance of categories that differ, and of a missing value from one that is there: that of two random
// values in the mean, in standard deviations.
constexpr double squared_difference = 2.0;

// `count` places, evenly spaced among `all`.
std::vector<int> places(Eigen::Index count, Eigen::Index all) {
  std::vector<int> result(count);
  for (Eigen::Index k = 0; k < count; ++k) result[k] = static_cast<int>(k * all / count);
  return result;
}

// Squared distances between rows: numbers in standard deviations; NaN: missing.
class Distances {
 public:
  Distances(const Eigen::MatrixXd& inputs, const std::vector<int>& categorical) : scaled_(inputs) {
    for (Eigen::Index j = 0; j < inputs.cols(); ++j) {
      is_number_.push_back(std::ranges::find(categorical, j) == categorical.end());
      if (!is_number_.back()) continue;
      const Eigen::ArrayXd values = inputs.col(j);
      const auto present = (!values.isNaN()).cast<double>().eval();
      const double count = std::max(1.0, present.sum());
      const double mean = (values.isNaN()).select(0.0, values / count).sum();
      const double square = (values.isNaN()).select(0.0, (values - mean).square() / count).sum();
      scaled_.col(j) = square > 0.0 ? ((values - mean) / std::sqrt(square)).eval() : (values - mean).eval();
    }
    has_special_ = scaled_.hasNaN() || std::ranges::count(is_number_, false) > 0;
  }

  double operator()(int a, int b) const {
    const double* const first = scaled_.row(a).data();
    const double* const second = scaled_.row(b).data();
    double sum = 0.0;
    if (!has_special_) {
      for (Eigen::Index j = 0; j < scaled_.cols(); ++j) sum += (first[j] - second[j]) * (first[j] - second[j]);
      return sum;
    }
    for (Eigen::Index j = 0; j < scaled_.cols(); ++j) {
      const double difference = first[j] - second[j];
      if (std::isnan(difference)) {
        sum += std::isnan(first[j]) && std::isnan(second[j]) ? 0.0 : squared_difference;
      } else {
        sum += is_number_[j] ? difference * difference : difference == 0.0 ? 0.0 : squared_difference;
      }
    }
    return sum;
  }

 private:
  RowMajor scaled_;
  std::vector<bool> is_number_;
  bool has_special_ = false;
};

// The nearest rows of one row that differ from it, nearest first.
std::vector<int> near_rows(const Distances& distances, int row, const std::vector<int>& among, int count) {
  std::vector<std::pair<double, int>> found;
  for (const int other : among) {
    const double distance = distances(row, other);
    if (distance > 0.0) found.emplace_back(distance, other);
  }
  const auto size = std::min<std::size_t>(count, found.size());
  std::partial_sort(found.begin(), found.begin() + static_cast<std::ptrdiff_t>(size), found.end());
  std::vector<int> rows;
  for (std::size_t k = 0; k < size; ++k) rows.push_back(found[k].second);
  return rows;
}

}  // namespace

MadeRows make_rows(const Eigen::MatrixXd& inputs, const std::vector<int>& categorical, const TeachOptions& options,
                   int max_threads) {
  const Eigen::Index rows = inputs.rows();
  MadeRows made;
  made.made_of = places(std::min(options.made_rows * rows, options.most_made_rows), rows);
  made.inputs = inputs(made.made_of, Eigen::all);
  std::vector<int> different = made.made_of;
  different.erase(std::unique(different.begin(), different.end()), different.end());
  const std::vector<int> among = places(std::min(rows, most_near_rows), rows);
  const Distances distances(inputs, categorical);
  std::vector<std::vector<int>> near(rows);
  parallel_for(std::ssize(different), max_threads, [&](Eigen::Index k) {
    near[different[k]] = near_rows(distances, different[k], among, options.neighbours);
  });
  const std::vector<int> columns = column_order(inputs);
  Random random(options.seed);
  for (std::size_t k = 0; k < made.made_of.size(); ++k) {
    const std::vector<int>& others = near[made.made_of[k]];
    if (others.empty()) continue;
    const int other = others[random.below(others.size())];
    for (const int j : columns) {
      if (random.uniform() < options.swapped) made.inputs(static_cast<Eigen::Index>(k), j) = inputs(other, j);
    }
  }
  return made;
}

}  // namespace llmt
