#include "trees/corrected_table.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>

#include "llmt/csv.hpp"
#include "llmt/files.hpp"

namespace llmt::apps {

void write_corrected(const std::string& path, const CorrectedTable& table) {
  const bool has_measured = table.measured.size() > 0;
  std::vector<const LabelColumn*> labels;
  for (const LabelColumn& label : table.labels) {
    if (std::ranges::find(table.inputs, label.name) == table.inputs.end()) labels.push_back(&label);
  }
  std::vector<std::string> header;
  for (const LabelColumn* label : labels) header.push_back(csv_field(label->name));
  for (const std::string& name : table.inputs) header.push_back(csv_field(name));
  for (const std::string& name : table.outputs) {
    header.push_back(csv_field(name + "_simulated"));
    header.push_back(csv_field(name + "_corrected"));
    if (has_measured) header.push_back(csv_field(name + "_measured"));
  }
  std::string text = fmt::format("{}\n", fmt::join(header, ","));
  for (Eigen::Index i = 0; i < table.values.rows(); ++i) {
    for (const LabelColumn* label : labels) text += csv_field(label->cells[i]) + ",";
    std::vector<double> cells(table.values.row(i).begin(), table.values.row(i).end());
    for (Eigen::Index o = 0; o < table.simulated.cols(); ++o) {
      cells.push_back(table.simulated(i, o));
      cells.push_back(table.corrected(i, o));
      if (has_measured) cells.push_back(table.measured(i, o));
    }
    text += fmt::format("{}\n", fmt::join(cells, ","));
  }
  write_file(path, text);
}

}  // namespace llmt::apps
