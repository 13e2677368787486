#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "llmt/fit.hpp"
#include "report/terms/terms_summary.hpp"

namespace llmt::report {
namespace {

std::string region_conditions(const std::vector<std::string>& names, const Leaf& leaf) {
  std::vector<std::string> parts;
  for (std::size_t j = 0; j < names.size(); ++j) {
    const Eigen::Index column = j;
    if (std::isfinite(leaf.low(column))) parts.push_back(fmt::format("{} > {}", names[j], number(leaf.low(column), 3)));
    if (std::isfinite(leaf.high(column))) {
      parts.push_back(fmt::format("{} <= {}", names[j], number(leaf.high(column), 3)));
    }
  }
  return parts.empty() ? "everywhere" : fmt::format("{}", fmt::join(parts, " and "));
}

}  // namespace

std::vector<InputRange> ranges_of(const discovery::Inputs& inputs) {
  std::vector<InputRange> ranges;
  for (const auto& column : inputs.values.colwise()) ranges.push_back({column.minCoeff(), column.maxCoeff()});
  return ranges;
}

std::vector<GapRegion> gap_regions(const discovery::Inputs& inputs, const discovery::MeasuredOutputs& measured,
                                   const discovery::Missing& missing) {
  const Eigen::Index p = inputs.values.cols();
  const std::vector<Eigen::Index>& rows = missing.searched;
  // Leaves with a mean and no slopes: the only regressor is constant.
  Eigen::MatrixXd table = Eigen::MatrixXd::Zero(std::ssize(rows), p + 1);
  table.leftCols(p) = inputs.values(rows, Eigen::all);
  FitOptions options;
  options.folds.count = 0;
  options.intervals = false;
  options.validity = ValidityChoice::crisp;
  options.max_leaves = 5;
  options.significance = 0.01;
  options.min_leaf_samples = std::max<Eigen::Index>(5, std::ssize(rows) / 20);
  for (int j = 0; j < p; ++j) options.split_inputs.push_back(j);
  options.regression_inputs = {static_cast<int>(p)};
  std::vector<GapRegion> regions;
  for (std::size_t o = 0; o < measured.names.size(); ++o) {
    const Eigen::Index column = o;
    const Eigen::MatrixXd gap = (measured.values.col(column) - missing.before.col(column)).cwiseAbs()(rows);
    const Model model = fit(table, gap, options).model;
    const Eigen::MatrixXi leaf_of = model.leaf_of(table);
    const std::vector<Leaf> leaves = model.leaves(0);
    std::vector<GapRegion> own;
    for (std::size_t k = 0; k < leaves.size(); ++k) {
      GapRegion region{measured.names[o], region_conditions(inputs.names, leaves[k]), 0, 0.0};
      for (Eigen::Index i = 0; i < gap.rows(); ++i) {
        if (leaf_of(i, 0) != static_cast<int>(k)) continue;
        ++region.rows;
        region.mean_gap += gap(i, 0);
      }
      region.mean_gap /= static_cast<double>(std::max<Eigen::Index>(1, region.rows));
      own.push_back(region);
    }
    std::ranges::stable_sort(own, std::greater<>{}, &GapRegion::mean_gap);
    regions.insert(regions.end(), own.begin(), own.end());
  }
  return regions;
}

}  // namespace llmt::report
