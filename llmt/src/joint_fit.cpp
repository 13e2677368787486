#include "joint_fit.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>

#include "dense.hpp"
#include "parallel.hpp"

namespace llmt {
namespace {

/// Shrinkage that is always there, in rows: nothing to what rows determine, all to what they do not.
constexpr double least_shrinkage = 1e-6;

/// The same for columns that are constant in a leaf, whose variance there is rounding: relative to the leaf's weight,
/// in columns of unit variance over all rows.
constexpr double least_hold = 1e-12;

/// Beyond the outermost rows of a leaf its slopes go on for this part of its range: thresholds lie between rows, and on
/// a grid the nearest queries half a step from them.
constexpr double range_margin = 0.25;

/// a += factor * b: the innermost loop of the assembly.
inline void add_scaled(double* a, const double* b, double factor, std::ptrdiff_t size) {
  for (std::ptrdiff_t k = 0; k < size; ++k) {
    a[k] += factor * b[k];
  }
}

/// Regressors with missing values at the mean of a node's rows.
Eigen::VectorXd imputed(const Eigen::Ref<const Eigen::RowVectorXd>& deviations, const Node& node) {
  return deviations.transpose().array().isNaN().select(node.mean, deviations.transpose());
}

}  // namespace

JointFit::JointFit(const TrainingRows& training, Partition partition, int max_threads)
    : training_(training),
      partition_(std::move(partition)),
      size_(std::ssize(training.regressors) + 1),
      missing_(training.has_missing),
      scale_(training.scale) {
  packed_ = missing_ ? size_ * size_ : size_ * (size_ + 1) / 2;
  const Node& root = partition_.nodes.front();
  set_residual_range();
  root_.resize(size_, root.value.size());
  root_.row(0) = root.value.transpose();
  root_.bottomRows(size_ - 1) = scale_.asDiagonal() * root.slope.transpose();
  assemble(max_threads);
}

bool JointFit::leaves_out_ambiguous(const Evaluator& evaluator) const {
  double ambiguous = 0.0;
  double all = 0.0;
  for (std::ptrdiff_t index = 0; missing_ && index < num_chunks(training_); ++index) {
    const Chunk chunk = fetch(training_, index, {});
    for (std::ptrdiff_t r = 0; r < chunk.count(); ++r) {
      all += chunk.weights(r);
      ambiguous += evaluator.is_ambiguous(chunk.inputs.row(r).data()) ? chunk.weights(r) : 0.0;
    }
  }
  // Where they are most of what there is, they are better than nothing.
  return ambiguous > 0.0 && ambiguous <= 0.5 * all;
}

void JointFit::set_residual_range() {
  const Node& root = partition_.nodes.front();
  Eigen::MatrixXd& range = partition_.residual_range;
  range.resize(root.value.size(), 2);
  range.col(0).setConstant(INFINITY);
  range.col(1).setConstant(-INFINITY);
  for (std::ptrdiff_t index = 0; index < num_chunks(training_); ++index) {
    const Chunk chunk = fetch(training_, index, partition_.outputs);
    for (std::ptrdiff_t r = 0; r < chunk.count(); ++r) {
      const Eigen::VectorXd residual =
          chunk.outputs.row(r).transpose() - root.value - root.slope * imputed(chunk.deviations.row(r), root);
      range.col(0) = range.col(0).cwiseMin(residual);
      range.col(1) = range.col(1).cwiseMax(residual);
    }
  }
}

void JointFit::assemble(int max_threads) {
  const std::size_t nodes = partition_.nodes.size();
  const std::ptrdiff_t outputs = root_.cols();
  std::vector<int> leaf_of_node(nodes, -1);
  for (std::size_t i = 0; i < nodes; ++i) {
    if (partition_.nodes[i].is_leaf()) {
      leaf_of_node[i] = static_cast<int>(leaves_.size());
      leaves_.push_back(static_cast<int>(i));
    }
  }
  const std::ptrdiff_t num_leaves = std::ssize(leaves_);
  gram_.assign(nodes, Eigen::MatrixXd::Zero(size_, size_));
  products_.assign(nodes, Eigen::MatrixXd::Zero(size_, outputs));
  blocks_.resize(leaves_.size());
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    blocks_[i].assign((i + 1) * static_cast<std::size_t>(packed_), 0.0);
  }
  std::vector<Eigen::VectorXd> low(nodes, Eigen::VectorXd::Constant(size_ - 1, INFINITY));
  std::vector<Eigen::VectorXd> high(nodes, Eigen::VectorXd::Constant(size_ - 1, -INFINITY));
  const Evaluator evaluator(partition_, training_.columns, size_ - 1);
  struct Entry {
    int leaf;
    double validity;
  };
  struct Use {
    std::ptrdiff_t row;     // in the chunk
    std::ptrdiff_t before;  // first entry of the row
    std::ptrdiff_t entry;   // that of the leaf
  };
  const bool leave_out = leaves_out_ambiguous(evaluator);
  std::vector<Activation> active;
  for (std::ptrdiff_t index = 0; index < num_chunks(training_); ++index) {
    const Chunk chunk = fetch(training_, index, partition_.outputs);
    const std::ptrdiff_t rows = chunk.count();
    // One after the other: which leaves reach which rows, and the rows' outer products.
    std::vector<Entry> entries;
    std::vector<std::vector<Use>> uses(leaves_.size());
    RowMajor outer(missing_ ? 0 : rows, packed_);
    RowMajor regressors(rows, size_);
    RowMajor residuals(rows, outputs);
    const Eigen::VectorXd& weights = chunk.weights;
    for (std::ptrdiff_t r = 0; r < rows; ++r) {
      const double* inputs = chunk.inputs.row(r).data();
      const double* deviations = chunk.deviations.row(r).data();
      if (leave_out && evaluator.is_ambiguous(inputs)) {
        regressors.row(r).setZero();
        residuals.row(r).setZero();
        continue;
      }
      evaluator.activate(inputs, active);
      std::sort(active.begin(), active.end(), [](const auto& a, const auto& b) { return a.node < b.node; });
      const std::ptrdiff_t before = std::ssize(entries);
      for (const Activation& entry : active) {
        const int leaf = leaf_of_node[static_cast<std::size_t>(entry.node)];
        uses[static_cast<std::size_t>(leaf)].push_back({r, before, std::ssize(entries)});
        entries.push_back({leaf, entry.validity});
      }
      regressors(r, 0) = 1.0;
      for (std::ptrdiff_t k = 1; k < size_; ++k) {
        regressors(r, k) = deviations[k - 1] / scale_(k - 1);
      }
      residuals.row(r) = chunk.outputs.row(r);
      if (!missing_) {
        residuals.row(r) -= regressors.row(r) * root_;
        double* out = outer.row(r).data();
        for (std::ptrdiff_t i = 0; i < size_; ++i) {
          for (std::ptrdiff_t j = 0; j <= i; ++j) {
            *out++ = regressors(r, i) * regressors(r, j);
          }
        }
      } else {
        for (const Activation& entry : active) {
          const Node& node = partition_.nodes[static_cast<std::size_t>(entry.node)];
          for (std::ptrdiff_t k = 0; k < size_; ++k) {
            const double x = std::isnan(regressors(r, k)) ? node.mean(k - 1) / scale_(k - 1) : regressors(r, k);
            residuals.row(r) -= entry.validity * x * root_.row(k);
          }
        }
      }
    }
    // Every leaf for itself: its own sums and its blocks with the leaves before it.
    parallel_for(num_leaves, max_threads, [&](std::ptrdiff_t position) {
      const std::size_t leaf = static_cast<std::size_t>(position);
      const std::size_t node = static_cast<std::size_t>(leaves_[leaf]);
      std::vector<double>& own = blocks_[leaf];
      Eigen::VectorXd sum = Eigen::VectorXd::Zero(packed_);
      if (!missing_) {
        // Of the leaves before: validities of those that share rows with this one, rows x leaves; last column: 1.
        std::vector<int> column_of(leaf + 1, -1);
        std::vector<int> others;
        for (const Use& use : uses[leaf]) {
          for (std::ptrdiff_t e = use.before; e <= use.entry; ++e) {
            const std::size_t other = static_cast<std::size_t>(entries[static_cast<std::size_t>(e)].leaf);
            if (column_of[other] < 0) {
              column_of[other] = static_cast<int>(others.size());
              others.push_back(static_cast<int>(other));
            }
          }
        }
        const std::ptrdiff_t columns = std::ssize(others) + 1;
        RowMajor validities = RowMajor::Zero(std::ssize(uses[leaf]), columns);
        RowMajor products(std::ssize(uses[leaf]), packed_);
        for (std::size_t u = 0; u < uses[leaf].size(); ++u) {
          const Use& use = uses[leaf][u];
          const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(u);
          products.row(row) =
              outer.row(use.row) * (weights(use.row) * entries[static_cast<std::size_t>(use.entry)].validity);
          for (std::ptrdiff_t e = use.before; e <= use.entry; ++e) {
            const Entry& entry = entries[static_cast<std::size_t>(e)];
            validities(row, column_of[static_cast<std::size_t>(entry.leaf)]) = entry.validity;
          }
          validities(row, columns - 1) = 1.0;
        }
        RowMajor sums = RowMajor::Zero(columns, packed_);
        add_transposed_product(columns, packed_, validities.rows(), 1.0, validities.data(), columns, products.data(),
                               packed_, sums.data(), packed_);
        for (std::size_t k = 0; k < others.size(); ++k) {
          Eigen::Map<Eigen::VectorXd>(own.data() + others[k] * packed_, packed_) +=
              sums.row(static_cast<std::ptrdiff_t>(k)).transpose();
        }
        sum = sums.row(columns - 1).transpose();
      }
      Eigen::VectorXd x(size_);
      Eigen::VectorXd other(size_);
      const auto regressors_at = [&](std::ptrdiff_t r, const Node& at, Eigen::VectorXd& to) {
        to(0) = 1.0;
        for (std::ptrdiff_t k = 1; k < size_; ++k) {
          to(k) = std::isnan(regressors(r, k)) ? at.mean(k - 1) / scale_(k - 1) : regressors(r, k);
        }
      };
      for (const Use& use : uses[leaf]) {
        const double validity = entries[static_cast<std::size_t>(use.entry)].validity;
        const double weight = weights(use.row) * validity;
        const double* deviations = chunk.deviations.row(use.row).data();
        for (std::ptrdiff_t k = 0; k < size_ - 1; ++k) {
          low[node](k) = deviations[k] < low[node](k) ? deviations[k] : low[node](k);
          high[node](k) = deviations[k] > high[node](k) ? deviations[k] : high[node](k);
        }
        if (!missing_) {
          products_[node] += weight * regressors.row(use.row).transpose() * residuals.row(use.row);
        } else {
          regressors_at(use.row, partition_.nodes[node], x);
          for (std::ptrdiff_t i = 0; i < size_; ++i) {
            add_scaled(sum.data() + i * size_, x.data(), weight * x(i), size_);
          }
          for (std::ptrdiff_t e = use.before; e <= use.entry; ++e) {
            const Entry& entry = entries[static_cast<std::size_t>(e)];
            regressors_at(use.row,
                          partition_.nodes[static_cast<std::size_t>(leaves_[static_cast<std::size_t>(entry.leaf)])],
                          other);
            for (std::ptrdiff_t i = 0; i < size_; ++i) {
              add_scaled(own.data() + entry.leaf * packed_ + i * size_, other.data(), weight * entry.validity * x(i),
                         size_);
            }
          }
          products_[node] += weight * x * residuals.row(use.row);
        }
      }
      std::ptrdiff_t k = 0;
      for (std::ptrdiff_t i = 0; i < size_; ++i) {
        for (std::ptrdiff_t j = 0; j < (missing_ ? size_ : i + 1); ++j, ++k) {
          gram_[node](i, j) += sum(k);
          if (!missing_ && i != j) {
            gram_[node](j, i) += sum(k);
          }
        }
      }
    });
  }
  const std::vector<int> parents = parents_of(partition_);
  for (std::size_t i = nodes; i-- > 0;) {
    Node& node = partition_.nodes[i];
    for (std::ptrdiff_t k = 0; k < size_ - 1; ++k) {
      if (low[i](k) <= high[i](k)) {
        const double margin = range_margin * (high[i](k) - low[i](k));
        node.low(k) = std::clamp(low[i](k) - margin, training_.spread(0, k), training_.spread(1, k));
        node.high(k) = std::clamp(high[i](k) + margin, training_.spread(0, k), training_.spread(1, k));
      }
    }
    if (i > 0) {
      const std::size_t parent = static_cast<std::size_t>(parents[i]);
      gram_[parent] += gram_[i];
      products_[parent] += products_[i];
      low[parent] = low[parent].cwiseMin(low[i]);
      high[parent] = high[parent].cwiseMax(high[i]);
    }
  }
}

Eigen::VectorXd JointFit::hold(std::size_t node, double shrinkage) const {
  const Eigen::MatrixXd& gram = gram_[node];
  const double total = gram(0, 0);
  const double floor = least_hold * (total + 1.0);
  Eigen::VectorXd result = Eigen::VectorXd::Constant(size_, floor);
  result(0) = total > 0.0 ? 0.0 : floor;  // rows always determine the constant
  for (std::ptrdiff_t k = 1; k < size_ && total > 0.0; ++k) {
    const double variance = std::max(0.0, (gram(k, k) - gram(0, k) * gram(0, k) / total) / total);
    result(k) += (shrinkage + least_shrinkage) * variance;
  }
  return result;
}

std::vector<Eigen::MatrixXd> JointFit::local_models(std::size_t nodes, double shrinkage) const {
  const std::vector<int> parents = parents_of(partition_);
  std::vector<Eigen::MatrixXd> models(nodes);
  models[0] = Eigen::MatrixXd::Zero(size_, root_.cols());  // the root's model itself
  for (std::size_t i = 1; i < nodes; ++i) {
    const Eigen::MatrixXd& parent = models[static_cast<std::size_t>(parents[i])];
    Eigen::MatrixXd matrix = gram_[i];
    matrix.diagonal() += hold(i, shrinkage);
    models[i] = parent + matrix.llt().solve(products_[i] - gram_[i] * parent);
  }
  return models;
}

Eigen::MatrixXd JointFit::block(std::size_t row_leaf, std::size_t column_leaf) const {
  const double* values = blocks_[row_leaf].data() + static_cast<std::ptrdiff_t>(column_leaf) * packed_;
  Eigen::MatrixXd result(size_, size_);
  for (std::ptrdiff_t i = 0; i < size_; ++i) {
    for (std::ptrdiff_t j = 0; j < (missing_ ? size_ : i + 1); ++j) {
      result(i, j) = *values++;
      if (!missing_) {
        result(j, i) = result(i, j);
      }
    }
  }
  return result;
}

void JointFit::set_model(Node& node, const Eigen::MatrixXd& coefficients) const {
  const Eigen::MatrixXd total = coefficients + root_;
  node.value = total.row(0).transpose();
  node.slope = total.bottomRows(size_ - 1).transpose() * scale_.cwiseInverse().asDiagonal();
}

Partition JointFit::with_models(std::ptrdiff_t leaves, const std::vector<Eigen::MatrixXd>& models) const {
  Partition result = prefix(partition_, leaves);
  for (std::size_t i = 0; i < result.nodes.size(); ++i) {
    set_model(result.nodes[i], models[i]);
  }
  return result;
}

Partition JointFit::local(std::ptrdiff_t leaves, double shrinkage) const {
  return with_models(leaves, local_models(static_cast<std::size_t>(2 * leaves - 1), shrinkage));
}

std::vector<Partition> JointFit::joint(std::ptrdiff_t leaves,
                                       const std::vector<Regularisation>& regularisations) const {
  const Partition base = prefix(partition_, leaves);
  const std::vector<int> parents = parents_of(partition_);
  // Leaves of the prefix, and for every node of the whole tree the one it lies in.
  std::vector<int> position(partition_.nodes.size(), -1);
  std::vector<int> nodes;
  for (std::size_t i = 0; i < partition_.nodes.size(); ++i) {
    if (i < base.nodes.size() && base.nodes[i].is_leaf()) {
      position[i] = static_cast<int>(nodes.size());
      nodes.push_back(static_cast<int>(i));
    } else if (i >= base.nodes.size()) {
      position[i] = position[static_cast<std::size_t>(parents[i])];
    }
  }
  const std::ptrdiff_t unknowns = std::ssize(nodes) * size_;
  RowMajor matrix = RowMajor::Zero(unknowns, unknowns);  // upper triangle
  for (std::size_t i = 0; i < leaves_.size(); ++i) {
    const std::ptrdiff_t row = position[static_cast<std::size_t>(leaves_[i])];
    for (std::size_t j = 0; j <= i; ++j) {
      const std::ptrdiff_t column = position[static_cast<std::size_t>(leaves_[j])];
      const Eigen::MatrixXd values = block(i, j);
      if (row <= column) {
        matrix.block(row * size_, column * size_, size_, size_) += values;
      }
      if (row >= column && i != j) {
        matrix.block(column * size_, row * size_, size_, size_) += values.transpose();
      }
    }
  }
  std::vector<Partition> results;
  for (const Regularisation& regularisation : regularisations) {
    const std::vector<Eigen::MatrixXd> models = local_models(base.nodes.size(), regularisation.shrinkage);
    // Unknown: the change from the local estimates.
    Eigen::MatrixXd anchors(unknowns, root_.cols());
    Eigen::MatrixXd right(unknowns, root_.cols());
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      const std::size_t node = static_cast<std::size_t>(nodes[k]);
      anchors.middleRows(static_cast<std::ptrdiff_t>(k) * size_, size_) = models[node];
      right.middleRows(static_cast<std::ptrdiff_t>(k) * size_, size_) = products_[node];
    }
    right -= matrix.selfadjointView<Eigen::Upper>() * anchors;
    RowMajor regular;
    // Rounding can leave the matrix indefinite when the overlap is large and the ridge small.
    for (double more = 0.0; more < 1e6; more = 100.0 * std::max(more, 1e-10)) {
      regular = matrix;
      for (std::size_t k = 0; k < nodes.size(); ++k) {
        const std::size_t node = static_cast<std::size_t>(nodes[k]);
        const std::ptrdiff_t at = static_cast<std::ptrdiff_t>(k) * size_;
        regular.block(at, at, size_, size_) += regularisation.ridge * gram_[node];
        regular.diagonal().segment(at, size_) += hold(node, regularisation.shrinkage);
      }
      regular.diagonal().array() += more;
      if (factor_cholesky(regular)) {
        break;
      }
    }
    solve_cholesky(regular, right);
    const Eigen::MatrixXd solution = anchors + right;
    Partition result = with_models(leaves, models);
    for (std::size_t k = 0; k < nodes.size(); ++k) {
      set_model(result.nodes[static_cast<std::size_t>(nodes[k])],
                solution.middleRows(static_cast<std::ptrdiff_t>(k) * size_, size_));
    }
    results.push_back(std::move(result));
  }
  return results;
}

void describe_leaves(const TrainingRows& training, Partition& partition) {
  const std::ptrdiff_t regressors = std::ssize(training.regressors);
  const std::ptrdiff_t outputs = std::ssize(partition.outputs);
  const Evaluator evaluator(partition, training.columns, regressors);
  for (Node& node : partition.nodes) {
    node.rss.setZero(outputs);
    node.inverse_gram = node.is_leaf() ? Eigen::MatrixXd::Zero(regressors + 1, regressors + 1) : Eigen::MatrixXd();
  }
  std::vector<Activation> active;
  Eigen::VectorXd values(outputs);
  Eigen::VectorXd a(regressors + 1);
  for (std::ptrdiff_t index = 0; index < num_chunks(training); ++index) {
    const Chunk chunk = fetch(training, index, partition.outputs);
    for (std::ptrdiff_t row = 0; row < chunk.count(); ++row) {
      const double* inputs = chunk.inputs.row(row).data();
      const double* deviations = chunk.deviations.row(row).data();
      const double weight = chunk.weights(row);
      evaluator.activate(inputs, active);
      evaluator.combine(active, deviations, values.data());
      const Eigen::VectorXd residual = chunk.outputs.row(row).transpose() - values;
      for (int at = 0; at >= 0;) {
        Node& node = partition.nodes[static_cast<std::size_t>(at)];
        if (node.is_leaf()) {
          node.rss += weight * residual.cwiseAbs2();
          break;
        }
        // An inner node for its own local model, as if it were a leaf.
        evaluator.local(at, deviations, values.data());
        evaluator.finish(deviations, values.data());
        node.rss += weight * (chunk.outputs.row(row).transpose() - values).cwiseAbs2();
        at = evaluator.child_of(at, inputs);
      }
      for (const Activation& entry : active) {
        Node& leaf = partition.nodes[static_cast<std::size_t>(entry.node)];
        a(0) = 1.0;
        a.tail(regressors) = imputed(chunk.deviations.row(row), leaf);
        leaf.inverse_gram.selfadjointView<Eigen::Lower>().rankUpdate(a, weight * entry.validity);
      }
    }
  }
  // Pseudo-inverse in scaled columns, with a floor: a direction without rows has a large leverage, not an infinite one.
  for (Node& node : partition.nodes) {
    if (!node.is_leaf()) {
      continue;
    }
    const Eigen::MatrixXd gram = node.inverse_gram.selfadjointView<Eigen::Lower>();
    Eigen::VectorXd scale(regressors + 1);
    for (std::ptrdiff_t k = 0; k <= regressors; ++k) {
      const double range =
          k == 0 ? 1.0 : std::max(std::abs(partition.nodes[0].low(k - 1)), std::abs(partition.nodes[0].high(k - 1)));
      scale(k) = range > 0.0 ? range : 1.0;
    }
    const Eigen::MatrixXd scaled = scale.cwiseInverse().asDiagonal() * gram * scale.cwiseInverse().asDiagonal();
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scaled);
    const double floor = std::max(1e-6, 1e-12 * eigen.eigenvalues().maxCoeff());
    const Eigen::MatrixXd inverse = eigen.eigenvectors() *
                                    eigen.eigenvalues().cwiseMax(floor).cwiseInverse().asDiagonal() *
                                    eigen.eigenvectors().transpose();
    node.inverse_gram = scale.cwiseInverse().asDiagonal() * inverse * scale.cwiseInverse().asDiagonal();
  }
}

}  // namespace llmt
