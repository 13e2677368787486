// Gaps that are no more than the noise that is known.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "discovery/answer/contests.hpp"
#include "llmt/discovery/missing.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/discovery/terms.hpp"
#include "noise.hpp"

namespace within_noise_test {
namespace {

using namespace llmt::discovery;

// y = size x^2 with noise of 0.1, which the user says to be `known`.
Missing missing_from(double size, double known) {
  constexpr Eigen::Index rows = 500;
  constexpr double noise = 0.1;
  Inputs inputs{{"x"}, Eigen::MatrixXd(rows, 1)};
  inputs.instants = Eigen::VectorXd::LinSpaced(rows, 0.0, 0.05 * (rows - 1));
  inputs.noise = Eigen::VectorXd::Zero(1);
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  measured.noise = Eigen::VectorXd::Constant(1, known);
  Noise random(3);
  for (Eigen::Index i = 0; i < rows; ++i) {
    const double t = inputs.instants(i);
    const double x = std::sin(1.7 * t) + 0.5 * std::sin(4.3 * t + 1.0);
    inputs.values(i, 0) = x;
    measured.values(i, 0) = size * x * x + noise * random.normal();
  }
  return find_missing(tabulated(Eigen::MatrixXd::Zero(rows, 1), {"y"}), inputs, measured, standard_terms(inputs), {});
}

bool says(const Missing& missing, const std::string& text) {
  return std::ranges::any_of(missing.notes,
                             [&](const std::string& note) { return note.find(text) != std::string::npos; });
}

TEST(WithinNoise, WhatIsNoMoreThanItIsNotNamed) {
  constexpr double small = 0.05;
  const Missing quiet = missing_from(small, 0.1);
  EXPECT_EQ(quiet.answer, Answer::nothing_missing);
  EXPECT_TRUE(quiet.found.empty());
  EXPECT_TRUE(says(quiet, " x was found and taken back: without it the gap of y is "));
  EXPECT_FALSE(quiet.visible.empty());
  // Beyond the noise, and where the noise is known to be less or cannot be what is said, it is named.
  for (const auto& [size, known] : {std::pair{0.2, 0.1}, {small, 0.07}, {small, 0.5}}) {
    const Missing named = missing_from(size, known);
    ASSERT_EQ(named.found.size(), 1U) << size << " " << known;
    EXPECT_EQ(named.found[0].inputs, std::vector<std::string>{"x"});
  }
}

TEST(WithinNoise, IsBeyondNeitherTheKnownNoiseNorWhatIsLeft) {
  Missing missing;
  missing.answer = Answer::named;
  missing.found.resize(1);
  const auto with = [&](double before, double floor, double known) {
    missing.gaps = {{.output = "y", .before = before, .after = floor, .noise_floor = floor, .known_noise = known}};
    return is_within_noise(missing);
  };
  EXPECT_TRUE(with(1.0, 1.0, 1.0));
  EXPECT_TRUE(with(1.1, 1.0, 1.0));
  EXPECT_FALSE(with(1.3, 1.3, 1.0));
  EXPECT_FALSE(with(1.0, 0.8, 1.0));
  EXPECT_FALSE(with(0.4, 0.4, 1.0));
  EXPECT_FALSE(with(1.0, 1.0, std::nan("")));
  missing.found.clear();
  missing.answer = Answer::nothing_missing;
  EXPECT_FALSE(with(1.0, 1.0, 1.0));  // there is nothing to take back
  missing.answer = Answer::unknown;
  EXPECT_TRUE(with(1.0, 1.0, 1.0));
}

}  // namespace
}  // namespace within_noise_test
