// rivals: the part of run.py that is written in C++.
//
//   rivals fit METHOD TRAIN TEST COLUMNS THREADS     one line of JSON, as every runner prints it (see run.py)
//   rivals sample ROWS INPUTS SEED TRAIN TEST        writes the synthetic function: TRAIN has ROWS rows with noise,
//   TEST
//                                                    100000 fresh rows without
//   rivals sets FOLDER [NAME...]                     data sets with given splits, one line each: name, rows, columns
//   and
//                                                    splits, separated by tabs
//   rivals split FOLDER NAME SPLIT TRAIN TEST        writes the rows of a split
//
// TRAIN and TEST are files of doubles, column after column, the output last.
#include <fmt/format.h>

#include <fstream>
#include <memory>
#include <optional>

#include "data_sets.hpp"
#include "methods.hpp"
#include "program.hpp"
#include "resources.hpp"
#include "synthetic.hpp"

namespace bench {
namespace {

constexpr std::streamsize number_size = sizeof(double);

Eigen::MatrixXd read(const std::string& path, Eigen::Index columns) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamsize bytes = file.tellg();
  Eigen::MatrixXd result(bytes / number_size / columns, columns);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(result.data()), bytes);
  if (!file) throw std::runtime_error(path + ": cannot be read");
  return result;
}

void write(const std::string& path, const Eigen::MatrixXd& x, const Eigen::VectorXd& y) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(x.data()), x.size() * number_size);
  file.write(reinterpret_cast<const char*>(y.data()), y.size() * number_size);
  file.close();
  if (!file) throw std::runtime_error(path + ": cannot be written");
}

struct Files {
  std::string train, test;
};

void add_files(CLI::App& command, Files& files) {
  command.add_option("train", files.train)->required();
  command.add_option("test", files.test)->required();
}

// Seconds of one run of the work, by repeating it for half a second.
template <class Work>
Cost measure_repeated(const Work& work) {
  Cost sum;
  int runs = 0;
  for (; sum.wall < 0.5; ++runs) {
    const Cost once = measure(work);
    sum.wall += once.wall;
    sum.cpu += once.cpu;
  }
  return {sum.wall / runs, sum.cpu / runs};
}

void fit(const std::string& method, const Files& files, Eigen::Index columns, int threads) {
  const Eigen::MatrixXd train = read(files.train, columns);
  const Eigen::MatrixXd test = read(files.test, columns);
  llmt::FitOptions options = method == "llmt-crisp" ? crisp() : llmt::FitOptions{};
  options.max_threads = threads;
  std::optional<llmt::FitResult> result;
  const Cost cost = measure([&] { result = llmt::fit(train.leftCols(columns - 1), train.rightCols(1), options); });
  Eigen::MatrixXd predicted;
  const Cost predict =
      measure_repeated([&] { predicted = result->model.predict(test.leftCols(columns - 1), threads); });
  const double per_million = 1e6 / static_cast<double>(test.rows());
  fmt::print(R"({{"fit_wall": {}, "fit_cpu": {}, "predict_wall": {}, "predict_cpu": {}, )"
             R"("memory": {}, "rmse": {}, "leaves": {}}})"
             "\n",
             cost.wall, cost.cpu, predict.wall * per_million, predict.cpu * per_million, cost.memory,
             llmt::rmse(predicted, test.rightCols(1))(0), result->summary.partitions[0].leaves);
}

void add_fit(CLI::App& program) {
  struct Arguments {
    std::string method;
    Files files;
    Eigen::Index columns = 0;
    int threads = 1;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("fit", "Cost and error of one fit");
  command->add_option("method", arguments->method, "llmt (default options) or llmt-crisp (no blends)")
      ->required()
      ->check(CLI::IsMember({"llmt", "llmt-crisp"}));
  add_files(*command, arguments->files);
  command->add_option("columns", arguments->columns)->required()->check(CLI::PositiveNumber);
  command->add_option("threads", arguments->threads)->required();
  command->callback([arguments] { fit(arguments->method, arguments->files, arguments->columns, arguments->threads); });
}

void add_sample(CLI::App& program) {
  struct Arguments {
    Eigen::Index rows = 0, inputs = 0;
    std::uint64_t seed = 0;
    Files files;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("sample", "Writes a sample of the synthetic function");
  command->add_option("rows", arguments->rows)->required();
  command->add_option("inputs", arguments->inputs)->required();
  command->add_option("seed", arguments->seed)->required();
  add_files(*command, arguments->files);
  command->callback([arguments] {
    const Sample train = sample(arguments->rows, arguments->inputs, 2 * arguments->seed - 1);
    write(arguments->files.train, train.x, train.y);
    const Sample test = sample(100000, arguments->inputs, 2 * arguments->seed);
    write(arguments->files.test, test.x, test.truth);
  });
}

void add_sets(CLI::App& program) {
  struct Arguments {
    std::string folder;
    std::vector<std::string> names;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("sets", "Lists data sets with given splits");
  command->add_option("folder", arguments->folder)->required()->check(CLI::ExistingDirectory);
  command->add_option("names", arguments->names);
  command->callback([arguments] {
    const auto& [folder, names] = *arguments;
    for (const std::string& name : names.empty() ? data_set_names(folder) : names) {
      const DataSet set = read_data_set(folder, name);
      fmt::print("{}\t{}\t{}\t{}\n", name, set.rows.rows(), set.rows.cols(), set.splits());
    }
  });
}

void add_split(CLI::App& program) {
  struct Arguments {
    std::string folder, name;
    Eigen::Index split = 0;
    Files files;
  };
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = program.add_subcommand("split", "Writes the rows of a split");
  command->add_option("folder", arguments->folder)->required()->check(CLI::ExistingDirectory);
  command->add_option("name", arguments->name)->required();
  command->add_option("split", arguments->split, "from 0")->required();
  add_files(*command, arguments->files);
  command->callback([arguments] {
    const DataSet set = read_data_set(arguments->folder, arguments->name);
    if (arguments->split < 0 || arguments->split >= set.splits()) throw std::invalid_argument("no such split");
    const Trial trial = set.trial(arguments->split);
    write(arguments->files.train, trial.train_inputs, trial.train_output);
    write(arguments->files.test, trial.test_inputs, trial.test_output);
  });
}

}  // namespace
}  // namespace bench

int main(int argc, char** argv) {
  return bench::run_program("rivals", "The part of run.py that is written in C++", argc, argv, bench::add_fit,
                            bench::add_sample, bench::add_sets, bench::add_split);
}
