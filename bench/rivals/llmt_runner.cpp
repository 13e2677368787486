// rival_llmt METHOD TRAIN TEST COLUMNS THREADS: one line of JSON as every runner here prints it, see run.py. METHOD:
// llmt (default options) or llmt-crisp (BatchRD without blends).
#include <fmt/format.h>

#include <fstream>
#include <optional>
#include <string_view>

#include "llmt/fit.hpp"
#include "resources.hpp"

namespace {

/// Doubles, column after column.
Eigen::MatrixXd read(const std::string& path, Eigen::Index columns) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamsize bytes = file.tellg();
  Eigen::MatrixXd result(bytes / static_cast<std::streamsize>(sizeof(double)) / columns, columns);
  file.seekg(0);
  file.read(reinterpret_cast<char*>(result.data()), bytes);
  if (!file) {
    throw std::runtime_error(path + ": cannot be read");
  }
  return result;
}

}  // namespace

int main(int argc, char** argv) {
  if (argc != 6) {
    fmt::print(stderr, "usage: rival_llmt METHOD TRAIN TEST COLUMNS THREADS\n");
    return 2;
  }
  try {
    const Eigen::Index columns = std::stol(argv[4]);
    const Eigen::MatrixXd train = read(argv[2], columns);
    const Eigen::MatrixXd test = read(argv[3], columns);
    llmt::FitOptions options;
    options.max_threads = std::stoi(argv[5]);
    if (std::string_view(argv[1]) == "llmt-crisp") {
      options.blend.validity = llmt::ValidityChoice::crisp;
    }
    std::optional<llmt::FitResult> result;
    const bench::Cost fit =
        bench::measure([&] { result.emplace(llmt::fit(train.leftCols(columns - 1), train.rightCols(1), options)); });
    Eigen::MatrixXd predicted;
    int runs = 0;
    bench::Cost predict;
    for (; predict.wall < 0.5; ++runs) {
      const bench::Cost once =
          bench::measure([&] { predicted = result->model.predict(test.leftCols(columns - 1), options.max_threads); });
      predict.wall += once.wall;
      predict.cpu += once.cpu;
    }
    const double per_million = 1e6 / static_cast<double>(runs * test.rows());
    fmt::print(
        R"({{"fit_wall": {}, "fit_cpu": {}, "predict_wall": {}, "predict_cpu": {}, "memory": {}, "rmse": {}, "leaves": {}}})"
        "\n",
        fit.wall, fit.cpu, predict.wall * per_million, predict.cpu * per_million, fit.memory,
        llmt::rmse(predicted, test.rightCols(1))(0), result->summary.partitions[0].leaves);
  } catch (const std::exception& error) {
    fmt::print(stderr, "rival_llmt: {}\n", error.what());
    return 1;
  }
  return 0;
}
