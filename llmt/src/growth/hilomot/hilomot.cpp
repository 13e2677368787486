#include "growth/hilomot/hilomot.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <optional>

#include "base/parallel.hpp"
#include "growth/growth_data.hpp"
#include "growth/hilomot/category_cut.hpp"
#include "growth/hilomot/gate_search.hpp"
#include "numerics/aicc.hpp"
#include "numerics/node_fit.hpp"

namespace llmt {
namespace {

// AICc has to improve within this many further leaves.
constexpr Eigen::Index patience = 10;

// Rows with less validity than this take no part in growth below.
constexpr double negligible = 1e-5;

// Directions of this part of the largest variance, in standardised inputs, are collinear with others.
constexpr double collinear = 1e-8;

// A local model that no other stands below.
struct OpenLeaf {
  int node = 0;
  std::vector<int> rows;     // that it reaches
  Eigen::VectorXd validity;  // there
  Eigen::VectorXd normal;    // of the split above it, in standardised inputs; empty: there is none
  double effective = 0.0;    // parameters
  bool splittable = true;
};

// How a leaf may be split.
struct Cut {
  double loss = std::numeric_limits<double>::infinity();
  Eigen::VectorXd normal;  // of length 1 in standardised inputs; empty: by levels
  double threshold = 0.0;  // by levels: share of rows without one
  double half_width = 0.0;
  int input = -1;  // by levels
  std::vector<int> level_side;
  Eigen::VectorXd share;  // of the left child in the leaf's rows
};

class Hilomot {
 public:
  Hilomot(const GrowthProblem& problem, const HilomotOptions& options)
      : data_(problem), options_(options), leaf_of_row_(data_.training.count(), 0) {
    const TrainingRows& training = data_.training;
    deviations_.resize(training.count(), std::ssize(training.regressors));
    for (Eigen::Index index = 0; index < num_chunks(training); ++index) {
      const Chunk chunk = fetch(training, index, {});
      deviations_.middleRows(index * chunk_rows, chunk.count()) =
          chunk.deviations.array().isNaN().select(0.0, chunk.deviations);
    }
    standardise_inputs();
  }

  GrownPartition run() {
    open_root();
    StopReason stop = StopReason::leaf_samples;
    double best_criterion = criterion();
    Eigen::Index best_leaves = 1;
    while (true) {
      if (data_.problem.options.max_leaves > 0 && std::ssize(leaves_) >= data_.problem.options.max_leaves) {
        stop = StopReason::max_leaves;
        break;
      }
      if (is_exact()) {
        stop = StopReason::exact_fit;
        break;
      }
      if (!split_worst()) break;
      if (options_.stop_by_aicc) {
        const double now = criterion();
        if (now < best_criterion) {
          best_criterion = now;
          best_leaves = std::ssize(leaves_);
        } else if (std::ssize(leaves_) >= best_leaves + patience) {
          break;
        }
      }
    }
    if (options_.stop_by_aicc && best_leaves < std::ssize(leaves_)) {
      nodes_ = prefix(Partition{.outputs = {}, .nodes = std::move(nodes_)}, best_leaves).nodes;
      stop = StopReason::aicc;
    }
    in_units_of_outputs();
    return {std::move(nodes_), stop, {.exact_nodes = 0, .evaluations = evaluations_}};
  }

 private:
  // Numeric split inputs that vary, about their centres and by their standard deviations; missing values are 0.
  void standardise_inputs() {
    const TrainingRows& training = data_.training;
    const double total = data_.weights.sum();
    for (Eigen::Index j = 0; j < data_.split_inputs(); ++j) {
      const int input = data_.problem.options.split_inputs[j];
      if (data_.num_levels[j] > 0) {
        categorical_.push_back(input);
        continue;
      }
      const double centre = training.columns[input].centre;
      Eigen::VectorXd values(training.count());
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        const double value = data_.split_value(static_cast<int>(i), j);
        values(i) = std::isnan(value) ? 0.0 : value - centre;
      }
      const double largest = values.cwiseAbs().maxCoeff();
      if (largest > 0.0) {
        const double spread = largest * std::sqrt(data_.weights.dot((values / largest).cwiseAbs2()) / total);
        numeric_.push_back(input);
        spreads_.push_back(spread);
        standardised_.conservativeResize(values.size(), std::ssize(numeric_));
        standardised_.rightCols(1) = values / spread;
      }
    }
  }

  void open_root() {
    OpenLeaf root;
    root.rows.resize(leaf_of_row_.size());
    for (std::size_t i = 0; i < root.rows.size(); ++i) {
      root.rows[i] = static_cast<int>(i);
    }
    root.validity = Eigen::VectorXd::Ones(std::ssize(root.rows));
    Node parentless;
    parentless.value = Eigen::VectorXd::Zero(data_.outputs.cols());
    parentless.slope = Eigen::MatrixXd::Zero(data_.outputs.cols(), deviations_.cols());
    nodes_ = {local_model(root, parentless)};
    nodes_[0].samples = data_.training.count();
    predicted_ = predictions(root, nodes_[0]);
    leaves_ = {std::move(root)};
    describe(leaves_[0]);
  }

  // Least squares weighted with the validity, as a correction of the parent's model.
  Node local_model(const OpenLeaf& leaf, const Node& parent) const {
    const RowMajor x = deviations_(leaf.rows, Eigen::all);
    const Eigen::MatrixXd residuals = (data_.outputs(leaf.rows, Eigen::all) - x * parent.slope.transpose()).rowwise() -
                                      Eigen::RowVectorXd(parent.value.transpose());
    const NodeFit fitted = fit_node(x, residuals, leaf.validity.cwiseProduct(data_.weights(leaf.rows)));
    Node node;
    node.rank = fitted.rank;
    node.rss = fitted.rss;
    node.value = parent.value + fitted.centre_change;
    node.slope = parent.slope + fitted.slope_change;
    node.mean = Eigen::VectorXd::Zero(deviations_.cols());
    node.low = fitted.low;
    node.high = fitted.high;
    return node;
  }

  Eigen::MatrixXd predictions(const OpenLeaf& leaf, const Node& model) const {
    return (deviations_(leaf.rows, Eigen::all) * model.slope.transpose()).rowwise() +
           Eigen::RowVectorXd(model.value.transpose());
  }

  // Weighted squared errors of the whole model at some rows, of all outputs.
  Eigen::VectorXd squared_errors(const std::vector<int>& rows) const {
    const Eigen::MatrixXd error = data_.outputs(rows, Eigen::all) - predicted_(rows, Eigen::all);
    return data_.weights(rows).cwiseProduct(error.cwiseAbs2() * data_.output_weights);
  }

  void describe(OpenLeaf& leaf) const {
    if (options_.stop_by_aicc) {
      leaf.effective =
          effective_parameters(deviations_(leaf.rows, Eigen::all), data_.weights(leaf.rows), leaf.validity);
    }
  }

  bool is_exact() const {
    const Eigen::RowVectorXd squares = data_.weights.transpose() * (data_.outputs - predicted_).cwiseAbs2();
    return (squares.transpose().array() <= data_.weights.sum() * data_.rounding.array().square()).all();
  }

  double criterion() const {
    if (!options_.stop_by_aicc) return 0.0;
    const double outputs = static_cast<double>(data_.outputs.cols());
    double effective = 0.0;
    for (const OpenLeaf& leaf : leaves_) {
      effective += outputs * leaf.effective;
    }
    // Planes are fitted too.
    for (const Node& node : nodes_) {
      effective += static_cast<double>((node.direction.array() != 0.0).count());
    }
    const double loss = data_.weights.dot((data_.outputs - predicted_).cwiseAbs2() * data_.output_weights);
    return aicc(data_.weights.sum() * outputs, std::max(loss, 1e-24 * outputs), effective);
  }

  // Splits the worst local model that can be split; false if there is none.
  bool split_worst() {
    while (true) {
      OpenLeaf* worst = nullptr;
      double largest = 0.0;
      for (OpenLeaf& leaf : leaves_) {
        const double loss = leaf.splittable ? leaf.validity.dot(squared_errors(leaf.rows)) : 0.0;
        if (leaf.splittable && (worst == nullptr || loss > largest)) {
          worst = &leaf;
          largest = loss;
        }
      }
      if (worst == nullptr) return false;
      if (const std::optional<Cut> cut = best_cut(*worst)) {
        split(*worst, *cut);
        return true;
      }
      worst->splittable = false;
    }
  }

  std::optional<Cut> best_cut(const OpenLeaf& leaf) {
    GateProblem problem;
    problem.weights = leaf.validity.cwiseProduct(data_.weights(leaf.rows));
    problem.least_weight = std::max(static_cast<double>(data_.problem.options.min_leaf_samples),
                                    static_cast<double>(deviations_.cols() + 1));
    if (problem.weights.sum() < 2.0 * problem.least_weight) return std::nullopt;
    problem.output_weights = data_.output_weights;
    problem.models = options_.models;
    // In orthonormal columns, and without what one model explains.
    const NodeFit whole =
        fit_node(deviations_(leaf.rows, Eigen::all), data_.outputs(leaf.rows, Eigen::all), problem.weights);
    problem.a.resize(std::ssize(leaf.rows), whole.features.coefficients());
    for (Eigen::Index i = 0; i < problem.a.rows(); ++i) {
      const double* row = whole.features.row(i);
      problem.a.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row, problem.a.cols()) / row[0];
    }
    problem.y = whole.residuals();
    Cut best = best_plane(leaf, problem);
    for (const int input : categorical_) {
      const Table& table = *data_.training.table;
      Eigen::VectorXd values(std::ssize(leaf.rows));
      for (Eigen::Index i = 0; i < values.size(); ++i) {
        const int row = leaf.rows[i];
        values(i) = table.inputs(data_.training.rows[row], input);
      }
      LevelCut cut = best_level_cut(problem, values, table.num_levels[input]);
      evaluations_ += cut.evaluations;
      if (cut.loss < best.loss) {
        best = {.loss = cut.loss,
                .normal = {},
                .threshold = cut.left_share,
                .input = input,
                .level_side = std::move(cut.side),
                .share = std::move(cut.share)};
      }
    }
    const double before = data_.output_weights.dot(whole.rss);
    return best.loss < before ? std::optional<Cut>(std::move(best)) : std::nullopt;
  }

  // `problem.z` is set here.
  Cut best_plane(const OpenLeaf& leaf, GateProblem& problem) {
    Cut cut;
    const Eigen::Index inputs = std::ssize(numeric_);
    if (inputs == 0) return cut;
    const double total = problem.weights.sum();
    Eigen::MatrixXd x = standardised_(leaf.rows, Eigen::all);
    const Eigen::RowVectorXd mean = problem.weights.transpose() * x / total;
    x.rowwise() -= mean;
    const Eigen::MatrixXd covariance = x.transpose() * (problem.weights.asDiagonal() * x) / total;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const Eigen::Index kept =
        (eigen.eigenvalues().array() > collinear * std::max(1e-12, eigen.eigenvalues().maxCoeff())).count();
    if (kept == 0) return cut;
    const Eigen::VectorXd root = eigen.eigenvalues().tail(kept).cwiseSqrt();
    const Eigen::MatrixXd whiten = eigen.eigenvectors().rightCols(kept) * root.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd colour = eigen.eigenvectors().rightCols(kept) * root.asDiagonal();  // its transpose undoes it
    problem.z.resize(x.rows(), kept + 1);
    problem.z << x * whiten, Eigen::VectorXd::Ones(x.rows());
    Eigen::MatrixXd directions(kept, inputs + 2);  // the axes, the most curved one, that of the split above
    directions << colour.transpose(), most_curved(problem),
        leaf.normal.size() > 0 ? Eigen::VectorXd(colour.transpose() * leaf.normal) : Eigen::VectorXd::Zero(kept);
    const GateFit best = best_gate(problem, directions, inputs, data_.problem.max_threads);
    evaluations_ += best.evaluations;
    if (!std::isfinite(best.loss)) return cut;
    cut.loss = best.loss;
    // u = steepness . z + offset = normal . (standardised - mean) / half width + offset.
    const Eigen::VectorXd normal = whiten * best.gate.head(kept);
    cut.half_width = 1.0 / normal.norm();
    cut.normal = normal * cut.half_width;
    cut.threshold = mean * cut.normal - best.gate(kept) * cut.half_width;
    cut.share = gate_shares(problem, best.gate);
    return cut;
  }

  void split(OpenLeaf& leaf, const Cut& cut) {
    Node& parent = nodes_[leaf.node];
    parent.left = static_cast<int>(nodes_.size());
    parent.right = parent.left + 1;
    set_split(parent, cut);
    Eigen::Index on_left = 0;
    for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
      int& of_row = leaf_of_row_[leaf.rows[i]];
      if (of_row == leaf.node) {
        const bool left = cut.share(i) >= 0.5;
        of_row = left ? parent.left : parent.right;
        on_left += left ? 1 : 0;
      }
    }
    const Eigen::MatrixXd before = predictions(leaf, parent);
    Eigen::MatrixXd change = -(leaf.validity.asDiagonal() * before);
    std::array<OpenLeaf, 2> children;
    std::array<Node, 2> models;
    for (const std::size_t side : {std::size_t{0}, std::size_t{1}}) {
      OpenLeaf& child = children[side];
      child.node = parent.left + static_cast<int>(side);
      child.normal = cut.normal;
      const Eigen::VectorXd share = side == 0 ? cut.share : Eigen::VectorXd(1.0 - cut.share.array());
      const Eigen::VectorXd validity = leaf.validity.cwiseProduct(share);
      std::vector<double> kept;
      for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
        if (const double here = validity(i); here > negligible) {
          child.rows.push_back(leaf.rows[i]);
          kept.push_back(here);
        }
      }
      child.validity = Eigen::Map<const Eigen::VectorXd>(kept.data(), std::ssize(kept));
      models[side] = local_model(child, parent);
      models[side].samples = side == 0 ? on_left : parent.samples - on_left;
      change += validity.asDiagonal() * predictions(leaf, models[side]);
      describe(child);
    }
    predicted_(leaf.rows, Eigen::all) += change;
    nodes_.push_back(std::move(models[0]));
    nodes_.push_back(std::move(models[1]));
    leaf = std::move(children[0]);
    leaves_.push_back(std::move(children[1]));
  }

  void set_split(Node& node, const Cut& cut) const {
    if (cut.normal.size() == 0) {
      node.split_input = cut.input;
      node.level_side = cut.level_side;
      node.missing_left = cut.threshold;
      return;
    }
    node.direction = Eigen::VectorXd::Zero(std::ssize(data_.training.columns));
    double largest = 0.0;
    for (std::size_t k = 0; k < numeric_.size(); ++k) {
      const double weight = cut.normal(k);
      node.direction(numeric_[k]) = weight / spreads_[k];
      if (std::abs(weight) > largest) {
        largest = std::abs(weight);
        node.split_input = numeric_[k];
      }
    }
    node.threshold = cut.threshold;
    node.half_width = cut.half_width;
  }

  void in_units_of_outputs() {
    for (Node& node : nodes_) {
      node.value = data_.output_mean + data_.output_scale.cwiseProduct(node.value);
      node.slope = data_.output_scale.asDiagonal() * node.slope;
      node.rss = data_.output_scale.cwiseAbs2().cwiseProduct(node.rss);
    }
  }

  GrowthData data_;
  HilomotOptions options_;
  Eigen::MatrixXd deviations_;    // rows x regressors; a missing value is 0
  Eigen::MatrixXd standardised_;  // rows x numeric_
  std::vector<int> numeric_;      // split inputs that directions are made of
  std::vector<double> spreads_;   // their standard deviations
  std::vector<int> categorical_;  // split inputs
  Eigen::MatrixXd predicted_;     // rows x outputs
  std::vector<Node> nodes_;       // in scaled outputs
  std::vector<OpenLeaf> leaves_;
  std::vector<int> leaf_of_row_;  // whose side of all planes a row is on
  Eigen::Index evaluations_ = 0;
};

}  // namespace

GrownPartition grow_hilomot(const GrowthProblem& problem, const HilomotOptions& hilomot) {
  return Hilomot(problem, hilomot).run();
}

}  // namespace llmt
