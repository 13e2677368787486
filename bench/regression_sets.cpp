// Test error of one tree with default options on data sets with given splits, beside least squares.
//
// regression_sets [--local-models linear|quadratic|auto] [--sparse never|auto|always] [--validity auto|crisp]
// [--splits N] FOLDER [NAME...]: for every NAME.csv in FOLDER with a NAME.splits.csv (the target is the last column
// of NAME.csv; every column of NAME.splits.csv is a split, 1 = test, 0 = training), or for the names given. Prints mean
// test RMSE over the splits, and how many test rows lie in the intervals of nominal 90 %: CV+, and split conformal from
// the first fold alone. The options are those of llmt fit; --splits takes the first N splits only.
#include <fmt/format.h>

#include <chrono>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>
#include <stdexcept>

#include "llmt/csv.hpp"
#include "llmt/fit.hpp"

namespace {

struct Errors {
  double tree = 0.0;
  double least_squares = 0.0;
  double worst_ratio = 0.0;  // tree / least squares over the splits
  double leaves = 0.0;
  double coefficients = 0.0;
  int quadratic = 0;  // splits that took quadratic local models
  int sparse = 0;
  double seconds = 0.0;
  double coverage = 0.0;  // of CV+ intervals
  double width = 0.0;
  double split_coverage = 0.0;  // of split conformal intervals
  double split_width = 0.0;
};

struct Held {
  double share = 0.0;
  double width = 0.0;
};

Held held(const llmt::Intervals& intervals, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& outputs) {
  const llmt::Bounds bounds = intervals.predict(inputs, 0.9);
  const auto inside = outputs.array() >= bounds.lower.array() && outputs.array() <= bounds.upper.array();
  return {static_cast<double>(inside.count()) / static_cast<double>(outputs.rows()),
          (bounds.upper - bounds.lower).mean()};
}

struct Arguments {
  llmt::FitOptions options;
  Eigen::Index splits = std::numeric_limits<Eigen::Index>::max();
  std::vector<std::string> rest;  // folder and names
};

Arguments read_arguments(int argc, char** argv) {
  using llmt::LocalTerms;
  using llmt::SparseChoice;
  const std::map<std::string, LocalTerms> terms = {
      {"linear", LocalTerms::linear}, {"quadratic", LocalTerms::quadratic}, {"auto", LocalTerms::automatic}};
  const std::map<std::string, SparseChoice> sparse = {
      {"never", SparseChoice::never}, {"auto", SparseChoice::automatic}, {"always", SparseChoice::always}};
  const std::map<std::string, llmt::ValidityChoice> validity = {{"auto", llmt::ValidityChoice::automatic},
                                                                {"crisp", llmt::ValidityChoice::crisp}};
  Arguments result;
  for (int i = 1; i < argc; ++i) {
    const std::string argument = argv[i];
    const std::string value = i + 1 < argc ? argv[i + 1] : "";
    if (!argument.starts_with("--")) {
      result.rest.push_back(argument);
      continue;
    }
    ++i;
    if (argument == "--local-models" && terms.contains(value)) {
      result.options.local_models.terms = terms.at(value);
    } else if (argument == "--sparse" && sparse.contains(value)) {
      result.options.local_models.sparse = sparse.at(value);
    } else if (argument == "--validity" && validity.contains(value)) {
      result.options.blend.validity = validity.at(value);
    } else if (argument == "--splits") {
      result.splits = std::stol(value);
    } else {
      throw std::invalid_argument(fmt::format("{} {} is not known", argument, value));
    }
  }
  return result;
}

Errors measure(const std::string& folder, const std::string& name, const Arguments& arguments) {
  const llmt::Csv data = llmt::Csv::read(folder + "/" + name + ".csv");
  const llmt::Csv splits = llmt::Csv::read(folder + "/" + name + ".splits.csv");
  const Eigen::MatrixXd all = data.numbers(data.columns());
  const Eigen::MatrixXd all_splits = splits.numbers(splits.columns());
  const Eigen::MatrixXd is_test = all_splits.leftCols(std::min(all_splits.cols(), arguments.splits));
  Errors sum;
  for (Eigen::Index split = 0; split < is_test.cols(); ++split) {
    std::vector<Eigen::Index> train;
    std::vector<Eigen::Index> test;
    for (Eigen::Index row = 0; row < all.rows(); ++row) {
      (is_test(row, split) > 0.5 ? test : train).push_back(row);
    }
    const Eigen::MatrixXd train_rows = all(train, Eigen::all);
    const Eigen::MatrixXd test_rows = all(test, Eigen::all);
    const Eigen::Index inputs = all.cols() - 1;
    const auto start = std::chrono::steady_clock::now();
    const llmt::FitResult result = llmt::fit(train_rows.leftCols(inputs), train_rows.rightCols(1), arguments.options);
    sum.seconds += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
    const double tree = llmt::rmse(result.model.predict(test_rows.leftCols(inputs)), test_rows.rightCols(1))(0);
    llmt::FitOptions one_leaf;
    one_leaf.growth.max_leaves = 1;
    one_leaf.selection.folds.count = 0;
    const llmt::Model linear = llmt::fit(train_rows.leftCols(inputs), train_rows.rightCols(1), one_leaf).model;
    const double least_squares = llmt::rmse(linear.predict(test_rows.leftCols(inputs)), test_rows.rightCols(1))(0);
    const Held cv_plus = held(result.intervals, test_rows.leftCols(inputs), test_rows.rightCols(1));
    const llmt::Intervals first_fold({result.intervals.models()[0]}, {result.intervals.residuals()[0]});
    const Held split_conformal = held(first_fold, test_rows.leftCols(inputs), test_rows.rightCols(1));
    const double part = 1.0 / static_cast<double>(is_test.cols());
    sum.coverage += part * cv_plus.share;
    sum.width += part * cv_plus.width;
    sum.split_coverage += part * split_conformal.share;
    sum.split_width += part * split_conformal.width;
    sum.tree += tree;
    sum.least_squares += least_squares;
    sum.worst_ratio = std::max(sum.worst_ratio, tree / least_squares);
    sum.leaves += static_cast<double>(result.summary.partitions[0].leaves);
    sum.coefficients += static_cast<double>(result.summary.partitions[0].coefficients);
    sum.quadratic += result.summary.quadratic ? 1 : 0;
    sum.sparse += result.summary.partitions[0].chosen.candidate.sparse ? 1 : 0;
  }
  for (double* value : {&sum.tree, &sum.least_squares, &sum.leaves, &sum.coefficients, &sum.seconds}) {
    *value /= static_cast<double>(is_test.cols());
  }
  return sum;
}

}  // namespace

int main(int argc, char** argv) {
  try {
    const Arguments arguments = read_arguments(argc, argv);
    if (arguments.rest.empty()) {
      fmt::print(stderr, "usage: regression_sets [OPTION VALUE...] FOLDER [NAME...]\n");
      return 2;
    }
    const std::string& folder = arguments.rest.front();
    std::set<std::string> names(arguments.rest.begin() + 1, arguments.rest.end());
    if (names.empty()) {
      for (const auto& entry : std::filesystem::directory_iterator(folder)) {
        const std::string file = entry.path().filename().string();
        if (const std::size_t end = file.find(".splits.csv"); end != std::string::npos) {
          names.insert(file.substr(0, end));
        }
      }
    }
    fmt::print("{:12} {:>14} {:>14} {:>18} {:>8} {:>12} {:>16} {:>10} {:>10} {:>10} {:>12} {:>10}\n", "data",
               "least squares", "llmt", "worst split, ratio", "leaves", "coefficients", "quadratic/sparse", "s per fit",
               "CV+ 90 %", "width", "split conf.", "width");
    for (const std::string& name : names) {
      const Errors errors = measure(folder, name, arguments);
      fmt::print(
          "{:12} {:14.5g} {:14.5g} {:18.3f} {:8.1f} {:12.1f} {:>16} {:10.3f} {:10.4f} {:10.4g} {:12.4f} {:10.4g}\n",
          name, errors.least_squares, errors.tree, errors.worst_ratio, errors.leaves, errors.coefficients,
          fmt::format("{}/{}", errors.quadratic, errors.sparse), errors.seconds, errors.coverage, errors.width,
          errors.split_coverage, errors.split_width);
    }
  } catch (const std::exception& error) {
    fmt::print(stderr, "regression_sets: {}\n", error.what());
    return 1;
  }
  return 0;
}
