#include "llmt/held_out.hpp"

#include "data/fold_rows.hpp"
#include "data/table.hpp"

namespace llmt {

std::vector<std::vector<Eigen::Index>> held_out_rows(const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                                                     const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                                                     const FitOptions& options) {
  const FitData data(inputs, outputs, options, true);
  const std::vector<Fold> folds = selection_folds(data.table().inputs.rows(), data.folds());
  std::vector<int> fold_of(data.table().inputs.rows(), -1);
  for (std::size_t f = 0; f < folds.size(); ++f) {
    for (const Eigen::Index row : folds[f].held_out) fold_of[row] = static_cast<int>(f);
  }
  std::vector<std::vector<Eigen::Index>> rows(folds.size());
  for (std::size_t row = 0; row < data.row_of().size(); ++row) {
    const int of_table = data.row_of()[row];
    if (of_table >= 0 && fold_of[of_table] >= 0) rows[fold_of[of_table]].push_back(static_cast<Eigen::Index>(row));
  }
  return rows;
}

}  // namespace llmt
