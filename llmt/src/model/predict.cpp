// What a model says of rows: predictions, derivatives, leaves, and how far to trust them.
#include <algorithm>
#include <limits>

#include "base/checks.hpp"
#include "base/parallel.hpp"
#include "llmt/model.hpp"
#include "model/codes.hpp"
#include "partition/evaluator.hpp"
#include "partition/leverage.hpp"
#include "partition/through_regressors.hpp"

namespace llmt {
namespace {

using Inputs = Eigen::Ref<const Eigen::MatrixXd>;

// With fewer rows the way through the tree costs less one by one.
constexpr Eigen::Index few_rows = 16;

void check_columns_of_query(const char* function, const Model& model, const Inputs& inputs) {
  if (inputs.cols() != model.num_inputs()) {
    throw std::invalid_argument(
        fmt::format("{}: inputs has {} columns, the model has {} inputs", function, inputs.cols(), model.num_inputs()));
  }
}

// Splits above the deepest leaf.
Eigen::Index depth_of(const std::vector<Evaluator>& evaluators) {
  Eigen::Index depth = 0;
  for (const Evaluator& evaluator : evaluators) {
    depth = std::max(depth, evaluator.validities().depth());
  }
  return depth;
}

// Calls body(begin, block) for the rows in blocks, which begin at the row `begin`.
template <class Body>
void for_each_block(const char* function, const Model& model, Eigen::Index depth, const Inputs& inputs, int max_threads,
                    const Body& body) {
  check_columns_of_query(function, model, inputs);
  const bool codes = needs_positions(model.inputs());
  const Eigen::Index size = rows_of_block(model.num_inputs(), std::ssize(model.regressors()), depth);
  parallel_for((inputs.rows() + size - 1) / size, max_threads, [&](Eigen::Index index) {
    const Eigen::Index begin = index * size;
    const auto rows = inputs.middleRows(begin, std::min(size, inputs.rows() - begin));
    Eigen::MatrixXd coded;
    if (codes) coded = at_positions(model.inputs(), rows);
    const RowBlock block = make_row_block(codes ? Inputs(coded) : Inputs(rows), model.inputs(), model.regressors());
    if (block.has_infinite) {
      check_finite_or_missing(function, "inputs", inputs);
    }
    body(begin, block);
  });
}

// Position in leaves() of every leaf's node.
std::vector<int> leaf_positions(const Partition& partition, const std::vector<Leaf>& leaves) {
  std::vector<int> position(partition.nodes.size(), -1);
  for (int k = 0; k < std::ssize(leaves); ++k) {
    position[leaves[k].node] = k;
  }
  return position;
}

}  // namespace

Eigen::MatrixXd Model::predict(const Inputs& inputs, int max_threads) const {
  constexpr const char* function = "llmt::Model::predict";
  Eigen::MatrixXd predicted(inputs.rows(), num_outputs());
  if (inputs.rows() < few_rows) {
    check_columns_of_query(function, *this, inputs);
    check_finite_or_missing(function, "inputs", inputs);
    Eigen::VectorXd x(num_inputs());
    Eigen::VectorXd deviations(std::ssize(regressors_));
    Eigen::VectorXd values(num_outputs());
    std::vector<Activation> active;
    active.reserve(32);
    const bool codes = needs_positions(inputs_);
    for (Eigen::Index row = 0; row < inputs.rows(); ++row) {
      x = inputs.row(row).transpose();
      for (Eigen::Index j = 0; codes && j < x.size(); ++j) x(j) = position_of(inputs_[j], x(j));
      deviations_at(inputs_, regressors_, x.data(), deviations.data());
      for (std::size_t p = 0; p < partitions_.size(); ++p) {
        (*evaluators_)[p].activate(x.data(), active);
        (*evaluators_)[p].combine(active, deviations.data(), values.data());
        for (std::size_t o = 0; o < partitions_[p].outputs.size(); ++o) {
          predicted(row, partitions_[p].outputs[o]) = values(o);
        }
      }
    }
    return predicted;
  }
  for_each_block(function, *this, depth_of(*evaluators_), inputs, max_threads,
                 [&](Eigen::Index begin, const RowBlock& block) {
                   std::vector<double> values;
                   for (std::size_t p = 0; p < partitions_.size(); ++p) {
                     (*evaluators_)[p].predict(block, values);
                     const std::size_t outputs = partitions_[p].outputs.size();
                     for (std::size_t o = 0; o < outputs; ++o) {
                       double* column = predicted.col(partitions_[p].outputs[o]).data() + begin;
                       for (std::size_t row = 0; row < static_cast<std::size_t>(block.rows()); ++row) {
                         column[row] = values[row * outputs + o];
                       }
                     }
                   }
                 });
  return predicted;
}

Eigen::MatrixXd Model::jacobian(const Eigen::Ref<const Eigen::VectorXd>& at) const {
  check_columns_of_query("llmt::Model::jacobian", *this, at.transpose());
  check_finite("llmt::Model::jacobian", "point", at.transpose());
  Eigen::VectorXd point = at;
  if (has_codes(inputs_)) point = at_positions(inputs_, at.transpose()).transpose();
  Eigen::VectorXd deviations(std::ssize(regressors_));
  deviations_at(inputs_, regressors_, point.data(), deviations.data());
  Eigen::MatrixXd result(num_outputs(), num_inputs());
  Eigen::MatrixXd by_input;
  Eigen::MatrixXd by_regressor;
  for (std::size_t p = 0; p < partitions_.size(); ++p) {
    (*evaluators_)[p].derivatives(point.data(), deviations.data(), by_input, by_regressor);
    add_through_regressors(inputs_, regressors_, point.data(), by_regressor, by_input);
    for (std::size_t o = 0; o < partitions_[p].outputs.size(); ++o) {
      result.row(partitions_[p].outputs[o]) = by_input.row(o);
    }
  }
  return result;
}

Eigen::MatrixXd Model::validities(const Inputs& inputs, Eigen::Index partition, int max_threads) const {
  const std::vector<Leaf> table = leaves(partition);
  const std::vector<int> position = leaf_positions(partitions_[partition], table);
  const LeafValidities& validities = (*evaluators_)[partition].validities();
  Eigen::MatrixXd result = Eigen::MatrixXd::Zero(inputs.rows(), std::ssize(table));
  for_each_block("llmt::Model::validities", *this, depth_of(*evaluators_), inputs, max_threads,
                 [&](Eigen::Index begin, const RowBlock& block) {
                   validities.for_each_leaf(block, [&](int node, const RowList& list) {
                     for (Eigen::Index i = 0; i < list.count; ++i) {
                       result(begin + list.rows[i], position[node]) = list.validities[i];
                     }
                   });
                 });
  return result;
}

Eigen::MatrixXi Model::leaf_of(const Inputs& inputs, int max_threads) const {
  std::vector<std::vector<int>> positions;
  for (std::size_t p = 0; p < partitions_.size(); ++p) {
    positions.push_back(leaf_positions(partitions_[p], leaves(p)));
  }
  // Far from all centres every Gaussian validity may be 0: such a row is of the first leaf.
  Eigen::MatrixXi result = Eigen::MatrixXi::Zero(inputs.rows(), std::ssize(partitions_));
  for_each_block("llmt::Model::leaf_of", *this, depth_of(*evaluators_), inputs, max_threads,
                 [&](Eigen::Index begin, const RowBlock& block) {
                   for (std::size_t p = 0; p < partitions_.size(); ++p) {
                     Eigen::VectorXd largest = Eigen::VectorXd::Zero(block.rows());
                     (*evaluators_)[p].validities().for_each_leaf(block, [&](int node, const RowList& list) {
                       for (Eigen::Index i = 0; i < list.count; ++i) {
                         if (list.validities[i] > largest(list.rows[i])) {
                           largest(list.rows[i]) = list.validities[i];
                           result(begin + list.rows[i], p) = positions[p][node];
                         }
                       }
                     });
                   }
                 });
  return result;
}

std::vector<Extrapolation> Model::extrapolation(const Inputs& inputs, int max_threads) const {
  std::vector<Extrapolation> result(inputs.rows());
  const auto body = [&](Eigen::Index begin, const RowBlock& block) {
    Extrapolation* const of_row = result.data() + begin;
    for (Eigen::Index j = 0; j < num_inputs(); ++j) {
      const InputColumn& input = inputs_[j];
      if (input.is_categorical() && input.codes.empty()) continue;  // no category is beyond another
      const double range = input.high - input.low;
      for (Eigen::Index row = 0; row < block.rows(); ++row) {
        const double value = inputs(begin + row, j);
        const double excess = std::max(input.low - value, value - input.high);
        if (excess > 0.0) {
          const double distance = range > 0.0 ? excess / range : std::numeric_limits<double>::infinity();
          of_row[row].distance = std::max(of_row[row].distance, distance);
        }
      }
    }
    for (std::size_t p = 0; p < partitions_.size(); ++p) {
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(block.rows());
      std::vector<double> of_leaf;
      (*evaluators_)[p].validities().for_each_leaf(block, [&](int node, const RowList& list) {
        leverages(partitions_[p].nodes[node], list, block, of_leaf);
        for (Eigen::Index i = 0; i < list.count; ++i) {
          sum(list.rows[i]) += list.validities[i] * of_leaf[i];
        }
      });
      for (Eigen::Index row = 0; row < block.rows(); ++row) {
        of_row[row].leverage = std::max(of_row[row].leverage, sum(row));
      }
    }
  };
  for_each_block("llmt::Model::extrapolation", *this, depth_of(*evaluators_), inputs, max_threads, body);
  return result;
}

Eigen::MatrixXd Model::standard_errors(const Inputs& inputs, int max_threads) const {
  constexpr double pooled_rows = 10.0;
  std::vector<Eigen::VectorXd> overall;  // residual variances of the partitions
  for (const Partition& partition : partitions_) {
    const Node& root = partition.nodes.front();
    double coefficients = 0.0;
    Eigen::VectorXd rss = Eigen::VectorXd::Zero(root.rss.size());
    for (const Node& node : partition.nodes) {
      if (node.is_leaf()) {
        coefficients += node.rank;
        rss += node.rss;
      }
    }
    overall.emplace_back(rss / std::max(1.0, static_cast<double>(root.samples) - coefficients));
  }
  Eigen::MatrixXd variance = Eigen::MatrixXd::Zero(inputs.rows(), num_outputs());
  const auto body = [&](Eigen::Index begin, const RowBlock& block) {
    std::vector<double> of_leaf;
    for (std::size_t p = 0; p < partitions_.size(); ++p) {
      const std::vector<int>& outputs = partitions_[p].outputs;
      (*evaluators_)[p].validities().for_each_leaf(block, [&](int node, const RowList& list) {
        const Node& leaf = partitions_[p].nodes[node];
        const double freedom = std::max(0.0, static_cast<double>(leaf.samples - leaf.rank)) + pooled_rows;
        const Eigen::VectorXd of_noise = (leaf.rss + pooled_rows * overall[p]) / freedom;
        leverages(leaf, list, block, of_leaf);
        for (Eigen::Index i = 0; i < list.count; ++i) {
          const double factor = list.validities[i] * of_leaf[i];
          for (std::size_t o = 0; o < outputs.size(); ++o) {
            variance(begin + list.rows[i], outputs[o]) += factor * of_noise(o);
          }
        }
      });
    }
  };
  for_each_block("llmt::Model::standard_errors", *this, depth_of(*evaluators_), inputs, max_threads, body);
  return variance.cwiseSqrt();
}

}  // namespace llmt
