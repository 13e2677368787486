// The black-box track of SRBench (La Cava et al. 2021): default options on its splits, beside the results that it
// published.
#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <memory>
#include <numeric>
#include <optional>
#include <set>
#include <stdexcept>

#include "llmt/boosted.hpp"
#include "llmt/csv.hpp"
#include "llmt/readable.hpp"
#include "llmt/size.hpp"
#include "methods.hpp"
#include "resources.hpp"
#include "study/leaderboard.hpp"
#include "study/shuffle_split.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

// Those of SRBench's trials, in its order.
constexpr std::uint32_t track_seeds[] = {23654, 15795, 860, 5390, 29802, 21575, 11964, 11284, 22118, 6265};

// SRBench trains on no more rows. It samples them in a way that cannot be repeated; here they are the first ones.
constexpr std::size_t most_training_rows = 10000;

const std::string llmt_name = "llmt";
const std::string readable_name = "llmt readable";
const std::string sum_name = "llmt (boost)";

struct Arguments {
  std::string folder;
  std::vector<std::string> names;  // of tables; empty: all
  int seeds = 5;
  int threads = 1;
  bool readable = false;
  bool boost = false;
};

// A table as it is in the file, the output last.
struct Data {
  Eigen::MatrixXd inputs;
  Eigen::VectorXd output;
};

Data read_table(const std::string& file) {
  const llmt::Csv csv = llmt::Csv::read(file);
  std::vector<std::string> inputs = csv.columns();
  std::erase(inputs, "y");
  return {csv.numbers(inputs), csv.numbers("y")};
}

// The tables of the folder that have published results, in alphabetical order.
std::vector<std::string> chosen_tables(const Arguments& arguments, const std::map<std::string, Scores>& published) {
  std::vector<std::string> names;
  for (const auto& [name, scores] : published) {
    if (std::filesystem::exists(fmt::format("{}/{}.csv", arguments.folder, name))) names.push_back(name);
  }
  for (const std::string& name : arguments.names) {
    if (std::ranges::find(names, name) == names.end()) {
      throw std::invalid_argument(fmt::format("no table '{}' with published results in {}", name, arguments.folder));
    }
  }
  return arguments.names.empty() ? names : arguments.names;
}

// Inputs that a split compares or a leaf's local model uses.
std::size_t inputs_used(const llmt::Model& model) {
  std::set<int> used;
  for (const llmt::Partition& partition : model.partitions()) {
    for (const llmt::Node& node : partition.nodes) {
      if (!node.is_leaf()) {
        used.insert(node.split_input);
        continue;
      }
      for (std::size_t k = 0; k < model.regressors().size(); ++k) {
        if (node.slope.col(static_cast<Eigen::Index>(k)).isZero(0.0)) continue;
        const llmt::Regressor& regressor = model.regressors()[k];
        used.insert(regressor.input);
        if (regressor.second_input >= 0) used.insert(regressor.second_input);
      }
    }
  }
  return used.size();
}

// Inputs in splits and slopes of the trees.
std::size_t inputs_used(const llmt::BoostedSum& sum) {
  std::set<int> used;
  const auto use = [&](int feature) {
    used.insert(sum.features[feature].first);
    if (sum.features[feature].second >= 0) used.insert(sum.features[feature].second);
  };
  for (const llmt::BoostedTree& tree : sum.trees) {
    for (const llmt::BoostedSplit& split : tree.splits) use(split.feature);
    for (const llmt::BoostedLeaf& leaf : tree.leaves) std::ranges::for_each(leaf.features, use);
  }
  return used.size();
}

std::size_t leaves_of(const llmt::BoostedSum& sum) {
  std::size_t leaves = 0;
  for (const llmt::BoostedTree& tree : sum.trees) leaves += tree.leaves.size();
  return leaves;
}

// As if nothing were soft or held: a split is "if x <= t", a slope "+ b x", a leaf a constant, a tree one sum more.
std::size_t expression_size(const llmt::BoostedSum& sum) {
  std::size_t size = 1;
  for (const llmt::BoostedTree& tree : sum.trees) {
    size += 1 + 4 * tree.splits.size() + tree.leaves.size();
    for (const llmt::BoostedLeaf& leaf : tree.leaves) size += 4 * leaf.slopes.size();
  }
  return size;
}

template <class AnyModel>
double test_r2(const AnyModel& model, const Trial& trial) {
  const Eigen::VectorXd error = trial.test_output - model.predict(trial.test_inputs);
  return 1.0 - error.squaredNorm() / (trial.test_output.array() - trial.test_output.mean()).matrix().squaredNorm();
}

Trial trial_of(const Data& data, std::uint32_t seed) {
  SplitRows rows = shuffle_split(data.output.size(), seed);
  rows.train.resize(std::min(rows.train.size(), most_training_rows));
  return {data.inputs(rows.train, Eigen::all), data.output(rows.train), data.inputs(rows.test, Eigen::all),
          data.output(rows.test)};
}

// What came of one method of ours: one entry a seed.
struct Trials {
  std::vector<double> r2;
  std::vector<double> size;
  std::vector<double> leaves;
  std::vector<double> inputs;
  std::vector<double> seconds;  // CPU, of the fit

  void add(const llmt::Model& model, const Trial& trial, double fit_seconds) {
    r2.push_back(test_r2(model, trial));
    size.push_back(static_cast<double>(llmt::expression_size(model)));
    leaves.push_back(static_cast<double>(model.partitions().front().num_leaves()));
    inputs.push_back(static_cast<double>(inputs_used(model)));
    seconds.push_back(fit_seconds);
  }

  void add(const llmt::BoostedModel& model, const Trial& trial, double fit_seconds) {
    const llmt::BoostedSum& sum = model.sums().front();
    r2.push_back(test_r2(model, trial));
    size.push_back(static_cast<double>(expression_size(sum)));
    leaves.push_back(static_cast<double>(leaves_of(sum)));
    inputs.push_back(static_cast<double>(inputs_used(sum)));
    seconds.push_back(fit_seconds);
  }
};

struct Runs {
  Trials llmt;
  Trials readable;
  Trials sum;
  Trials least_squares;
};

Runs run(const Data& data, const Arguments& arguments) {
  llmt::FitOptions options;
  options.max_threads = arguments.threads;
  Runs runs;
  for (int k = 0; k < arguments.seeds; ++k) {
    const Trial trial = trial_of(data, track_seeds[k]);
    std::optional<llmt::PreparedFit> prepared;
    std::optional<llmt::FitResult> fit;
    Cost cost = measure([&] {
      prepared.emplace(llmt::TrainingData{trial.train_inputs, trial.train_output}, options);
      fit = llmt::fit(*prepared);
    });
    runs.llmt.add(fit->model, trial, cost.cpu);
    if (arguments.readable) {
      std::optional<llmt::ReadableResult> readable;
      cost = measure([&] { readable = llmt::fit_readable(*prepared, fit->summary); });
      runs.readable.add(readable->model, trial, cost.cpu);
    }
    if (arguments.boost) {
      std::optional<llmt::BoostResult> sum;
      cost = measure([&] {
        sum = llmt::fit_boosted({trial.train_inputs, trial.train_output}, {.max_threads = arguments.threads});
      });
      runs.sum.add(sum->model, trial, cost.cpu);
    }
    fit = llmt::fit(trial.train_inputs, trial.train_output, least_squares(options));
    runs.least_squares.add(fit->model, trial, 0.0);
  }
  return runs;
}

void print_head() {
  fmt::print("{:33} {:>6} {:>6} {:>8} {:>8} | {:>7} {:>5} {:>5} {:>6} {:>5} {:>6} {:>7} | {}\n", "table", "rows",
             "inputs", "Linear", "lst. sq.", "R2", "rank", "among", "leaves", "used", "size", "CPU s", "R2 per seed");
}

void print_trials(const ScoredTable& table, const std::string& method, const Trials& trials) {
  fmt::print(" {:7.4f} {:5.1f} {:5} {:6.1f} {:5.1f} {:6.0f} {:7.2f} |", median(trials.r2),
             rank_by_r2(table, method, llmt_name), table.published.size() + 1, median(trials.leaves),
             median(trials.inputs), median(trials.size), mean(trials.seconds));
  for (const double value : trials.r2) fmt::print(" {:7.4f}", value);
  fmt::print("\n");
}

void print_lines(const ScoredTable& table, const Runs& runs) {
  const auto linear = table.published.find("Linear");
  fmt::print("{:33} {:6} {:6} {:>8} {:8.4f} |", table.name, table.rows, table.inputs,
             linear == table.published.end() ? "" : fmt::format("{:.4f}", linear->second.r2),
             median(runs.least_squares.r2));
  print_trials(table, llmt_name, runs.llmt);
  if (table.ours.contains(readable_name)) {
    fmt::print("{:65} |", "  readable");
    print_trials(table, readable_name, runs.readable);
  }
  if (table.ours.contains(sum_name)) {
    fmt::print("{:65} |", "  sum of trees");
    print_trials(table, sum_name, runs.sum);
  }
  std::fflush(stdout);
}

Score score_of(const Trials& trials) { return {median(trials.r2), median(trials.size)}; }

double sum(const std::vector<double>& values) { return std::accumulate(values.begin(), values.end(), 0.0); }

void study_srbench(const Arguments& arguments) {
  const std::map<std::string, Scores> published = read_published(arguments.folder + "/published.csv");
  print_head();
  std::vector<ScoredTable> tables;
  double seconds = 0.0;
  double readable_seconds = 0.0;
  for (const std::string& name : chosen_tables(arguments, published)) {
    const Data data = read_table(fmt::format("{}/{}.csv", arguments.folder, name));
    const Runs runs = run(data, arguments);
    Scores ours = {{llmt_name, score_of(runs.llmt)}};
    if (arguments.readable) ours[readable_name] = score_of(runs.readable);
    if (arguments.boost) ours[sum_name] = score_of(runs.sum);
    tables.push_back({name, data.inputs.rows(), data.inputs.cols(), ours, published.at(name)});
    print_lines(tables.back(), runs);
    seconds += sum(runs.llmt.seconds);
    readable_seconds += sum(runs.readable.seconds);
  }
  fmt::print("\n{} tables, {} seeds, at most {} training rows; CPU s of fits: {:.1f}", tables.size(), arguments.seeds,
             most_training_rows, seconds);
  fmt::print("{}\n",
             arguments.readable ? fmt::format(", of readable models after them: {:.1f}", readable_seconds) : "");
  print_means(tables);
  print_ranks(tables, llmt_name);
}

}  // namespace

void add_srbench(CLI::App& study) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = study.add_subcommand("srbench", "Default options on SRBench's tables beside published results");
  command->add_option("tables", arguments->names, "names of tables; default: all");
  command->add_option("--data", arguments->folder, "folder with NAME.csv, target y, and published.csv")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->add_option("--seeds", arguments->seeds, "number of SRBench's ten splits, from the first one on")
      ->check(CLI::Range(1, static_cast<int>(std::size(track_seeds))))
      ->capture_default_str();
  command->add_option("--threads", arguments->threads, "threads of a fit, 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_flag("--readable", arguments->readable, "also the readable model of each fit, ranked in its place");
  command->add_flag("--boost", arguments->boost, "also a sum of trees, ranked in its place");
  command->callback([arguments] { study_srbench(*arguments); });
}

}  // namespace bench
