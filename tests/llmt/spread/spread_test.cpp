// The spread of errors, and intervals whose width follows it.
#include "llmt/spread.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "llmt/boosted.hpp"
#include "llmt/bounds.hpp"
#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "oracles/samples.hpp"
#include "oracles/thrown.hpp"
#include "spread/fit_spread.hpp"
#include "spread/scaled_residuals.hpp"

namespace {

using oracle::Sample;

// y = 3 a + sin(6 b) + (0.02 + c^2) noise.
Sample loud_in_c(Eigen::Index rows, std::uint64_t seed) {
  llmt::Random random(seed);
  Sample s{Eigen::MatrixXd(rows, 3), Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    s.x.row(i) << random.uniform(), random.uniform(), random.uniform();
    const double noise = 0.02 + s.x(i, 2) * s.x(i, 2);
    s.y(i, 0) = 3.0 * s.x(i, 0) + std::sin(6.0 * s.x(i, 1)) + noise * random.normal();
  }
  return s;
}

// Shares of rows inside their intervals, in fifths by the third input, and the mean widths there.
struct Fifths {
  Eigen::VectorXd inside = Eigen::VectorXd::Zero(5);
  Eigen::VectorXd width = Eigen::VectorXd::Zero(5);
};

using Predict = std::function<llmt::Bounds(const Sample& train, const Eigen::MatrixXd& x)>;

Fifths fifths_of(const Predict& predict, int seeds) {
  Fifths fifths;
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(5);
  for (int seed = 1; seed <= seeds; ++seed) {
    const Sample fresh = loud_in_c(4000, 900 + static_cast<std::uint64_t>(seed));
    const llmt::Bounds bounds = predict(loud_in_c(1500, static_cast<std::uint64_t>(seed)), fresh.x);
    for (Eigen::Index i = 0; i < fresh.x.rows(); ++i) {
      const auto fifth = static_cast<Eigen::Index>(5.0 * fresh.x(i, 2));
      const double y = fresh.y(i, 0);
      rows(fifth) += 1.0;
      fifths.inside(fifth) += y >= bounds.lower(i, 0) && y <= bounds.upper(i, 0) ? 1.0 : 0.0;
      fifths.width(fifth) += bounds.upper(i, 0) - bounds.lower(i, 0);
    }
  }
  fifths.inside.array() /= rows.array();
  fifths.width.array() /= rows.array();
  return fifths;
}

// The exact widths are 3.29 sd: 0.11 to 2.8 in the mean of the outermost fifths.
void expect_held(const Fifths& fifths) {
  for (Eigen::Index k = 0; k < 5; ++k) {
    EXPECT_GT(fifths.inside(k), 0.85) << k;
    EXPECT_LT(fifths.inside(k), k == 0 ? 1.0 : 0.965) << k;  // the least width is a twentieth of the mean
  }
  EXPECT_LT(fifths.width(0), 0.6);
  EXPECT_NEAR(fifths.width(4), 2.75, 0.4);
}

TEST(Spread, WidthsOfATreeFollowTheNoise) {
  expect_held(fifths_of([](const Sample& train,
                           const Eigen::MatrixXd& x) { return llmt::fit(train.x, train.y).intervals.predict(x, 0.9); },
                        3));
}

TEST(Spread, WidthsOfOneFoldFollowTheNoise) {
  expect_held(fifths_of(
      [](const Sample& train, const Eigen::MatrixXd& x) {
        llmt::TrainingData data{.inputs = train.x, .outputs = train.y};
        for (Eigen::Index row = 0; row < train.x.rows(); row += 3) data.held_out.push_back(row);
        return llmt::fit(data).intervals.predict(x, 0.9);
      },
      3));
}

TEST(Spread, WidthsOfASumFollowTheNoise) {
  expect_held(fifths_of(
      [](const Sample& train, const Eigen::MatrixXd& x) {
        return llmt::fit_boosted({.inputs = train.x, .outputs = train.y}).model.intervals(x, 0.9);
      },
      3));
}

// 24 levels of 1 to 5 rows have noise of 0.8, 6 levels of 100 rows noise of 0.2.
TEST(Spread, LevelsOfFewRowsHaveTheWidthOfSuchLevels) {
  double inside = 0.0;
  double rows = 0.0;
  double common_width = 0.0;
  double rare_width = 0.0;
  for (std::uint64_t seed = 1; seed <= 6; ++seed) {
    llmt::Random random(seed);
    std::vector<double> levels;
    for (int level = 0; level < 6; ++level) levels.insert(levels.end(), 100, level);
    for (int level = 6; level < 30; ++level) levels.insert(levels.end(), 1 + level % 5, level);
    const auto rows_of = [&](const std::vector<double>& of_levels) {
      Sample s{Eigen::MatrixXd(std::ssize(of_levels), 2), Eigen::MatrixXd(std::ssize(of_levels), 1)};
      for (Eigen::Index i = 0; i < s.x.rows(); ++i) {
        s.x.row(i) << random.uniform(), of_levels[static_cast<std::size_t>(i)];
        s.y(i, 0) = 2.0 * s.x(i, 0) + (s.x(i, 1) < 6.0 ? 0.2 : 0.8) * random.normal();
      }
      return s;
    };
    const Sample train = rows_of(levels);
    std::vector<double> asked(3000);
    for (std::size_t i = 0; i < asked.size(); ++i) asked[i] = static_cast<double>(i % 30);
    const Sample fresh = rows_of(asked);
    const llmt::Bounds bounds =
        llmt::fit({.inputs = train.x, .outputs = train.y, .categorical_inputs = {1}}).intervals.predict(fresh.x, 0.9);
    for (Eigen::Index i = 0; i < fresh.x.rows(); ++i) {
      const double width = bounds.upper(i, 0) - bounds.lower(i, 0);
      if (fresh.x(i, 1) < 6.0) {
        common_width += width / 600.0 / 6.0;
        continue;
      }
      rare_width += width / 2400.0 / 6.0;
      rows += 1.0;
      inside += fresh.y(i, 0) >= bounds.lower(i, 0) && fresh.y(i, 0) <= bounds.upper(i, 0) ? 1.0 : 0.0;
    }
  }
  EXPECT_GT(inside / rows, 0.85);
  EXPECT_GT(rare_width, 2.0 * common_width);
}

// Errors of a known size: 1, and 4 where the first column is above 0.7 or the prediction above 2.
struct Errors {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd predictions;
  Eigen::VectorXd sizes;
  std::vector<int> part;
};

Errors errors(Eigen::Index rows, double loud, std::uint64_t seed) {
  llmt::Random random(seed);
  Errors e{Eigen::MatrixXd(rows, 2), Eigen::VectorXd(rows), Eigen::VectorXd(rows), llmt::dealt_parts(rows, 5)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    e.inputs.row(i) << random.uniform(), random.uniform();
    e.predictions(i) = 3.0 * random.uniform();
    const double sd = e.inputs(i, 0) > 0.7 || e.predictions(i) > 2.0 ? loud : 1.0;
    e.sizes(i) = sd * std::abs(random.normal());
  }
  return e;
}

std::vector<llmt::Spread> spreads_of(const Errors& e) {
  const std::vector<llmt::InputColumn> columns(2);
  return llmt::fit_spreads({e.inputs, columns, e.predictions, e.sizes}, e.part, 5);
}

TEST(Spread, OfAnInputAndOfThePredictionAreFound) {
  const Errors e = errors(3000, 4.0, 1);
  Eigen::MatrixXd x(1, 2);
  for (const llmt::Spread& spread : spreads_of(e)) {
    const auto at = [&](double first, double prediction) {
      x << first, 0.5;
      return llmt::spread_at(spread, x, 0, prediction);
    };
    EXPECT_NEAR(at(0.9, 1.0) / at(0.3, 1.0), 4.0, 0.8);
    EXPECT_NEAR(at(0.3, 2.8) / at(0.3, 1.0), 4.0, 0.8);
  }
}

// The share of spreads with a split where there is nothing to find.
TEST(Spread, OfEvenNoiseIsOne) {
  int split = 0;
  for (std::uint64_t seed = 1; seed <= 20; ++seed) {
    for (const llmt::Spread& spread : spreads_of(errors(500, 1.0, seed))) split += spread.nodes.empty() ? 0 : 1;
  }
  EXPECT_LE(split, 50);
}

TEST(Spread, IsNotLearntFromItsOwnPart) {
  const Errors e = errors(600, 4.0, 3);
  Errors other = e;
  for (Eigen::Index i = 0; i < 600; ++i) {
    if (e.part[static_cast<std::size_t>(i)] == 2) other.sizes(i) = 50.0 * e.sizes((i + 1) % 600);
  }
  EXPECT_EQ(spreads_of(e)[2], spreads_of(other)[2]);
  EXPECT_NE(spreads_of(e)[1], spreads_of(other)[1]);
}

TEST(Spread, OfFewerThanAHundredRowsIsOne) {
  for (const llmt::Spread& spread : spreads_of(errors(99, 20.0, 4))) EXPECT_TRUE(spread.nodes.empty());
  EXPECT_FALSE(spreads_of(errors(100, 20.0, 4))[0].nodes.empty());
}

TEST(Spread, PartsAreOfOneSize) {
  std::vector<int> count(5, 0);
  for (const int part : llmt::dealt_parts(103, 5)) ++count.at(static_cast<std::size_t>(part));
  EXPECT_EQ(*std::ranges::min_element(count), 20);
  EXPECT_EQ(*std::ranges::max_element(count), 21);
}

// Against sorting all values; whole numbers, so that many are equal.
TEST(Spread, TheLargestValuesAreThoseOfSorting) {
  llmt::Random random(5);
  for (int trial = 0; trial < 300; ++trial) {
    std::vector<std::vector<double>> residuals(1 + random.below(6));
    std::vector<llmt::ScaledResiduals> parts;
    std::vector<double> all;
    for (std::vector<double>& of_part : residuals) {
      for (std::uint64_t k = random.below(40); k > 0; --k) of_part.push_back(static_cast<double>(random.below(12)));
      std::ranges::sort(of_part);
      parts.push_back({of_part, static_cast<double>(random.below(5)), 0.5 * static_cast<double>(random.below(4))});
      for (const double residual : of_part) all.push_back(parts.back().offset + parts.back().factor * residual);
    }
    std::ranges::sort(all, std::greater<>());
    for (std::size_t rank = 1; rank <= all.size(); ++rank) {
      EXPECT_EQ(llmt::largest_value(parts, static_cast<Eigen::Index>(rank)), all[rank - 1]);
    }
  }
}

TEST(Quantiles, AreTheEndsOfIntervalsInOrder) {
  const std::vector<double> probabilities = {0.1, 0.4, 0.5, 0.75};
  const std::vector<double> levels = llmt::levels_of_quantiles(probabilities);
  ASSERT_EQ(levels.size(), 3U);
  EXPECT_NEAR(levels[0], 0.8, 1e-15);
  EXPECT_NEAR(levels[1], 0.2, 1e-15);
  EXPECT_NEAR(levels[2], 0.5, 1e-15);
  const auto row = [](double value) { return Eigen::MatrixXd::Constant(1, 1, value); };
  // The second interval lies beyond the prediction, 3.
  const std::vector<llmt::Bounds> bounds = {{row(1), row(9)}, {row(4), row(5)}, {row(2), row(6)}};
  const auto found = llmt::quantiles_from(bounds, row(3), probabilities);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0], (Eigen::MatrixXd(1, 4) << 1, 3, 4, 6).finished());
  for (const std::vector<double>& bad : {std::vector<double>{0.0}, {1.0}, {0.5, 0.5}, {0.5, 0.4}, {oracle::missing}}) {
    EXPECT_THROW(llmt::levels_of_quantiles(bad), std::invalid_argument);
  }
}

TEST(Spread, FollowsItsNodes) {
  const llmt::Spread spread{.nodes = {{.column = 1, .threshold = 0.5, .missing_left = true, .left = 1, .right = 2},
                                      {.factor = 0.5},
                                      {.column = 2, .threshold = 10.0, .left = 3, .right = 4},
                                      {.factor = 2.0},
                                      {.factor = 3.0}},
                            .levels = {{}, {0.1, 0.9, 0.7}}};
  Eigen::MatrixXd x(5, 2);
  x << 0.0, 0.0, 0.0, 1.0, 0.0, 7.0, 0.0, oracle::missing, 0.0, -1.0;
  EXPECT_EQ(llmt::spread_at(spread, x, 0, 20.0), 0.5);
  EXPECT_EQ(llmt::spread_at(spread, x, 1, 10.0), 2.0);
  EXPECT_EQ(llmt::spread_at(spread, x, 1, 10.5), 3.0);
  for (const Eigen::Index row : {2, 3, 4}) EXPECT_EQ(llmt::spread_at(spread, x, row, 0.0), 2.0);  // the value of others
  EXPECT_EQ(llmt::spread_at({}, x, 0, 20.0), 1.0);
}

TEST(Spread, ThatIsNoTreeIsRefused) {
  const std::vector<llmt::InputColumn> columns = {{.name = "a"}, {.name = "b", .levels = {"one", "two"}}};
  const llmt::Spread good{.nodes = {{.column = 2, .threshold = 0.5, .left = 1, .right = 2}, {.factor = 0.5}, {}},
                          .levels = {{}, {1.0, 2.0, 3.0}}};
  EXPECT_NO_THROW(llmt::check_spread(good, columns));
  EXPECT_NO_THROW(llmt::check_spread({}, columns));
  const auto refusal = [&](const std::function<void(llmt::Spread&)>& edit) {
    llmt::Spread bad = good;
    edit(bad);
    return oracle::thrown([&] { llmt::check_spread(bad, columns); });
  };
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.levels.pop_back(); }), "llmt::Spread: 1 lists of levels for 2 inputs");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.levels[1].pop_back(); }),
            "llmt::Spread: 2 values of input 1, which has 2 levels");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.levels[1][0] = oracle::missing; }),
            "llmt::Spread: a value of a level of input 1 is not finite");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.nodes.clear(); }), "llmt::Spread: it has levels and no nodes");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.nodes[0].right = 3; }), "llmt::Spread: child 3 of node 0 must come later");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.nodes[0].left = 0; }), "llmt::Spread: child 0 of node 0 must come later");
  for (const int child : {1, -1}) {
    EXPECT_NE(refusal([&](llmt::Spread& s) { s.nodes[0].right = child; }), "nothing was thrown") << child;
  }
  for (const int column : {-1, 3}) {
    EXPECT_EQ(refusal([&](llmt::Spread& s) { s.nodes[0].column = column; }),
              "llmt::Spread: node 0 has no such column, or no threshold");
  }
  for (const double factor : {0.0, -1.0, 2e6, oracle::missing}) {
    EXPECT_NE(refusal([&](llmt::Spread& s) { s.nodes[1].factor = factor; }), "nothing was thrown") << factor;
  }
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.noise_share = 1.5; }),
            "llmt::Spread: the share of noise is 1.5, it must be from 0 to 1");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.usual_weight = 0.0; }),
            "llmt::Spread: the usual weight is 0, it must be positive");
  EXPECT_EQ(refusal([](llmt::Spread& s) { s.nodes.emplace_back(); }),
            "llmt::Spread: each node but the first needs one parent");
}

}  // namespace
