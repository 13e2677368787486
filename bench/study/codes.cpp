// What it brings to take numbers for codes where held-out rows say so, on generated tables: some hold codes, in others
// the number is an amount. Mean test RMSE over the samples, 4000 test rows; CPU seconds per fit, one thread.
#include <fmt/format.h>

#include <array>
#include <cmath>
#include <memory>
#include <numbers>
#include <optional>

#include "llmt/fit.hpp"
#include "llmt/random.hpp"
#include "resources.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using llmt::Random;

double number(Random& random, int low, int high) {
  return low + std::floor(random.uniform(0.0, 1.0) * (high - low + 1));
}

// A row of inputs, and the output.
using Row = double (*)(Random& random, Eigen::Ref<Eigen::VectorXd> x);

// The load of a building by its compactness, height, orientation 2 ... 5, share of glass and where that is, 0 ... 5.
double heat(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  constexpr std::array of_side = {0.0, 1.7, -1.1, 0.9};
  constexpr std::array of_glass = {0.0, 0.3, 2.6, -0.4, 1.9, -1.2};
  x << random.uniform(0.6, 1.0), number(random, 0, 1), number(random, 2, 5), number(random, 0, 3), number(random, 0, 5);
  const double glass = 0.1 * x(3);
  const double side = of_side[static_cast<std::size_t>(x(2)) - 2];
  return 40.0 * (x(0) - 0.6) * (x(0) - 0.4) + (4.0 + 3.0 * glass) * x(1) + 20.0 * glass +
         2.5 * glass * (of_glass[static_cast<std::size_t>(x(4))] + side) + 0.4 * side + 0.3 * random.normal();
}

// A wage by month 1 ... 12, which has no order, age, years of school and of work.
double wage(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  constexpr std::array of_month = {0.0, 2.1, -1.3, 0.8, 3.0, -2.2, 0.4, 1.9, -0.7, 2.5, -1.8, 0.2};
  x << number(random, 1, 12), random.uniform(18.0, 65.0), number(random, 8, 18), random.uniform(0.0, 30.0), 0.0;
  return 10.0 + 0.9 * x(2) + 0.5 * x(1) - 0.005 * x(1) * x(1) + 0.3 * std::min(x(3), 15.0) +
         of_month[static_cast<std::size_t>(x(0)) - 1] + 2.0 * random.normal();
}

// One of four codes turns a slope.
double slopes(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  constexpr std::array of_code = {0.0, 1.0, -1.0, 0.7};
  x << number(random, 2, 5), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0, 0.0;
  return of_code[static_cast<std::size_t>(x(0)) - 2] * (0.3 + x(1)) + std::sin(4.0 * x(2)) + 0.3 * random.normal();
}

// Grades: more is more, evenly, by a logarithm, around an optimum, in a step; and months of a smooth year.
double grade(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  x << number(random, 1, 8), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0, 0.0;
  return 1.2 * x(0) + 0.6 * x(0) * x(1) + 3.0 * std::sin(3.0 * x(2)) + random.normal();
}

double logarithm(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  x << number(random, 1, 6), number(random, 0, 4), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0;
  return 3.0 * std::log(x(0)) + 0.5 * x(1) * x(1) * x(2) + 3.0 * std::sin(3.0 * x(3)) + random.normal();
}

double optimum(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  x << number(random, 0, 7), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0, 0.0;
  return 0.25 * (x(0) - 3.2) * (x(0) - 3.2) + 0.6 * x(0) * x(1) + std::sin(4.0 * x(2)) + 0.7 * random.normal();
}

double step(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  x << number(random, 1, 7), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0, 0.0;
  return (x(0) >= 4.0 ? 2.0 + x(1) : -x(1)) + std::sin(4.0 * x(2)) + 0.5 * random.normal();
}

double year(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  x << number(random, 1, 12), random.uniform(0.0, 1.0), random.uniform(0.0, 1.0), 0.0, 0.0;
  return 2.0 * std::cos(std::numbers::pi * x(0) / 6.0) + 0.2 * x(0) * x(1) + std::sin(4.0 * x(2)) +
         0.8 * random.normal();
}

double noise(Random& random, Eigen::Ref<Eigen::VectorXd> x) {
  for (double& value : x) value = number(random, 1, 5);
  return random.normal();
}

struct Kind {
  const char* name;
  Row row;
  Eigen::Index inputs;
};

constexpr Kind kinds[] = {{"heat", heat, 5},   {"wage", wage, 4},           {"slopes", slopes, 3},
                          {"grade", grade, 3}, {"logarithm", logarithm, 4}, {"optimum", optimum, 3},
                          {"step", step, 3},   {"year", year, 3},           {"noise", noise, 5}};

struct Rows {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;
};

Rows make_rows(const Kind& kind, Eigen::Index count, std::uint64_t seed) {
  Random random(seed);
  Rows rows{Eigen::MatrixXd(count, 5), Eigen::VectorXd(count)};
  Eigen::VectorXd x(5);
  for (Eigen::Index row = 0; row < count; ++row) {
    rows.y(row) = kind.row(random, x);
    rows.x.row(row) = x.transpose();
  }
  rows.x.conservativeResize(Eigen::NoChange, kind.inputs);
  return rows;
}

// Sums over the samples.
struct Sum {
  double rmse = 0.0;
  double seconds = 0.0;
  Eigen::Index taken = 0;
};

void add_fit(const Rows& train, const Rows& test, bool may_have_codes, Sum& sum) {
  const llmt::TrainingData data{.inputs = train.x, .outputs = train.y, .may_have_codes = may_have_codes};
  std::optional<llmt::FitResult> fit;
  sum.seconds += measure([&] { fit = llmt::fit(data, {.max_threads = 1}); }).cpu;
  sum.rmse += llmt::rmse(fit->model.predict(test.x), test.y)(0);
  sum.taken += std::ssize(fit->summary.codes.taken);
}

void study_kind(const Kind& kind, Eigen::Index count, int samples) {
  Sum chosen;
  Sum numbers;
  for (int k = 1; k <= samples; ++k) {
    const Rows train = make_rows(kind, count, static_cast<std::uint64_t>(k));
    const Rows test = make_rows(kind, 4000, static_cast<std::uint64_t>(1000 + k));
    add_fit(train, test, true, chosen);
    add_fit(train, test, false, numbers);
  }
  fmt::print("{:10} {:6} {:12.4g} {:12.4g} {:8.3f} {:12.2f} {:10.3f} {:8.2f}\n", kind.name, count,
             numbers.rmse / samples, chosen.rmse / samples, chosen.rmse / numbers.rmse,
             static_cast<double>(chosen.taken) / samples, numbers.seconds / samples, chosen.seconds / numbers.seconds);
  std::fflush(stdout);
}

}  // namespace

void add_codes(CLI::App& study) {
  CLI::App* command = study.add_subcommand("codes", "Numbers that are codes, on generated tables");
  const auto samples = std::make_shared<int>(5);
  command->add_option("--samples", *samples, "samples of each table")->capture_default_str();
  command->callback([samples] {
    fmt::print("{:10} {:>6} {:>12} {:>12} {:>8} {:>12} {:>10} {:>8}\n", "table", "rows", "as numbers", "default",
               "ratio", "codes taken", "CPU s", "ratio");
    for (const Kind& kind : kinds) {
      for (const Eigen::Index rows : {300, 1000}) study_kind(kind, rows, *samples);
    }
  });
}

}  // namespace bench
