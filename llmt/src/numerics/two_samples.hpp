/// \file
/// Whether two samples come from one distribution. Each test returns the probability of what is seen, or of more, if
/// they do.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace llmt {

/// A sample in which each of `values`, ascending, occurs as often as `counts` says.
struct CountedSample {
  const std::vector<double>& values;
  const std::vector<Eigen::Index>& counts;
};

/// Lepage's test (1971) of location and scale. With the mid-ranks r of all N = n + m values and a = |r - (N + 1) / 2|,
/// the differences d of the samples' means of (r, a) have the covariance
///   S = (1/n + 1/m) N / (N - 1) cov(r, a)
/// over all orders of the values, ties counted, and d' S^-1 d is about chi square with 2 degrees of freedom. 1 if all
/// values are equal or a sample is empty.
double same_numbers_probability(const CountedSample& one, std::vector<double> other);

/// The chi-square test of homogeneity of the same categories in two samples. The rarest categories are joined until 5
/// rows of each are expected in either sample. 1 where then only one is left.
double same_shares_probability(const std::vector<Eigen::Index>& one, const std::vector<Eigen::Index>& other);

/// Fisher's exact test of the share of something in two samples, two-sided: twice the smaller tail.
double same_share_probability(Eigen::Index found_in_one, Eigen::Index one, Eigen::Index found_in_other,
                              Eigen::Index other);

/// That `count` of `fresh` values or more lie above the largest of `known` values.
double beyond_largest_probability(Eigen::Index count, Eigen::Index fresh, Eigen::Index known);

/// That `outside` of `fresh` values or more lie outside of what leaves `rank` of `known` values outside, or would with
/// one more: beta-binomial with (rank, known + 1 - rank).
double outside_probability(Eigen::Index outside, Eigen::Index fresh, Eigen::Index rank, Eigen::Index known);

/// That the mean of `other` is so much above that of `one`: the permutation test, exact whatever the distribution, by
/// 4999 permutations from a fixed seed; where both samples have more than 20 000 values, by the normal distribution.
double larger_mean_probability(const std::vector<double>& one, const std::vector<double>& other);

/// The probabilities, each times the number of those that are not smaller, and none below a smaller one's; at most 1
/// (Holm 1979). NaN stands for no test, and stays.
std::vector<double> holm(const std::vector<double>& probabilities);

}  // namespace llmt
