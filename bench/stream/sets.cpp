// Test R2 of a stream on data sets with given splits, beside that of least squares: training rows in a random order,
// a new one for each pass.
#include <fmt/format.h>

#include <algorithm>
#include <memory>
#include <optional>

#include "data_sets.hpp"
#include "methods.hpp"
#include "resources.hpp"
#include "stream/stream.hpp"

namespace bench {
namespace {

struct Arguments {
  std::string folder;
  int passes = 1;
  Eigen::Index splits = 5;
};

// Means over the splits.
struct Result {
  double r2 = 0.0;
  double r2_crisp = 0.0;
  double r2_linear = 0.0;
  double leaves = 0.0;
  double rmse = 0.0;
  double seconds = 0.0;  // CPU: learning, the snapshot and its prediction
};

double r2_of(const Eigen::VectorXd& predicted, const Eigen::VectorXd& y) {
  return 1.0 - (predicted - y).squaredNorm() / (y.array() - y.mean()).square().sum();
}

void learn(llmt::Stream& stream, const Trial& trial, int passes, llmt::Random& random) {
  for (int pass = 0; pass < passes; ++pass) {
    const auto order = random.permutation(trial.train_inputs.rows());
    stream.add(trial.train_inputs(order, Eigen::all), trial.train_output(order));
  }
}

void add_split(Result& sum, const Trial& trial, int passes, std::uint64_t seed, double part) {
  llmt::Random random(seed);
  llmt::Stream stream(trial.train_inputs.cols(), 1);
  std::optional<llmt::Model> model;
  Eigen::VectorXd predicted;
  sum.seconds += part * measure([&] {
                          learn(stream, trial, passes, random);
                          model = stream.snapshot();
                          predicted = model->predict(trial.test_inputs);
                        }).cpu;
  const auto r2 = [&](const llmt::Model& other) { return r2_of(other.predict(trial.test_inputs), trial.test_output); };
  sum.leaves += part * static_cast<double>(model->partitions().front().num_leaves());
  sum.r2 += part * r2_of(predicted, trial.test_output);
  sum.rmse += part * llmt::rmse(predicted, trial.test_output)(0);
  sum.r2_crisp += part * r2(stream.snapshot(llmt::ValidityChoice::crisp));
  sum.r2_linear += part * r2(llmt::fit(trial.train_inputs, trial.train_output, least_squares()).model);
}

void sets(const Arguments& arguments) {
  fmt::print("{:12} {:>9} {:>9} {:>9} {:>7} {:>9} {:>8}\n", "data", "R2", "R2 crisp", "R2 LS", "leaves", "RMSE", "s");
  std::vector<double> all_r2;
  for (const std::string& name : data_set_names(arguments.folder)) {
    const DataSet set = read_data_set(arguments.folder, name);
    const Eigen::Index splits = std::min(set.splits(), arguments.splits);
    Result mean;
    for (Eigen::Index split = 0; split < splits; ++split) {
      add_split(mean, set.trial(split), arguments.passes, split + 1, 1.0 / static_cast<double>(splits));
    }
    all_r2.push_back(mean.r2);
    fmt::print("{:12} {:9.4f} {:9.4f} {:9.4f} {:7.1f} {:9.4g} {:8.3f}\n", name, mean.r2, mean.r2_crisp, mean.r2_linear,
               mean.leaves, mean.rmse, mean.seconds);
    std::fflush(stdout);
  }
  if (all_r2.empty()) return;
  std::ranges::sort(all_r2);
  fmt::print("median of {} sets: {:.4f}\n", all_r2.size(),
             0.5 * (all_r2[(all_r2.size() - 1) / 2] + all_r2[all_r2.size() / 2]));
}

}  // namespace

void add_sets(CLI::App& program) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("sets", "Test R2 on data sets with given splits");
  command->add_option("folder", arguments->folder, "with NAME.csv and NAME.splits.csv")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--passes", arguments->passes, "over the training rows")->capture_default_str();
  command->add_option("--trials", arguments->splits, "largest number of splits")
      ->check(CLI::PositiveNumber)
      ->capture_default_str();
  command->callback([arguments] { sets(*arguments); });
}

}  // namespace bench
