#include "data_sets.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

#include "llmt/csv.hpp"

namespace bench {

Trial DataSet::trial(Eigen::Index split) const {
  std::vector<Eigen::Index> train, test;
  for (Eigen::Index row = 0; row < rows.rows(); ++row) (is_test(row, split) > 0.5 ? test : train).push_back(row);
  const Eigen::Index output = rows.cols() - 1;
  const auto columns = Eigen::seqN(0, output);
  return {rows(train, columns), rows(train, output), rows(test, columns), rows(test, output)};
}

std::vector<std::string> data_set_names(const std::string& folder) {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string file = entry.path().filename().string();
    if (const std::size_t end = file.find(".splits.csv"); end != std::string::npos)
      names.push_back(file.substr(0, end));
  }
  std::ranges::sort(names);
  return names;
}

DataSet read_data_set(const std::string& folder, const std::string& name) {
  const llmt::Csv data = llmt::Csv::read(folder + "/" + name + ".csv");
  const llmt::Csv splits = llmt::Csv::read(folder + "/" + name + ".splits.csv");
  if (data.rows() != splits.rows()) {
    throw std::invalid_argument(fmt::format("{}: {} rows, but the splits have {}", name, data.rows(), splits.rows()));
  }
  DataSet set{data.columns(), data.numbers(data.columns()), splits.numbers(splits.columns())};
  set.inputs.pop_back();
  return set;
}

}  // namespace bench
