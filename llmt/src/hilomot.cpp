#include "hilomot.hpp"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>

#include "aicc.hpp"
#include "growth_data.hpp"
#include "node_fit.hpp"
#include "parallel.hpp"

namespace llmt {
namespace {

/// AICc has to improve within this many further leaves.
constexpr std::ptrdiff_t patience = 10;

/// Half widths in standard deviations of the node's rows along the direction. Of local models that of the source, a
/// twentieth of the distance of the two centres, which are sqrt(3) standard deviations apart where evenly spread rows
/// are halved; of joint models bounds, and where the optimisation starts.
constexpr double local_width = 0.087;
constexpr double joint_width = 0.4;
constexpr double least_joint_width = 0.05;
constexpr double most_joint_width = 1.0;

/// Rows with less validity than this take no part in growth below.
constexpr double negligible = 1e-5;

/// Directions of this part of the largest variance, in standardised inputs, are collinear with others.
constexpr double collinear = 1e-8;

/// Directions shorter than this, of a unit vector's parts that vary in a node, are no start.
constexpr double least_direction = 1e-6;

/// Of the axis-orthogonal splits so many are starts of the optimisation.
constexpr std::ptrdiff_t axes_to_start_from = 2;

/// The levels of a categorical input are put in so many orders, and each is cut in at most so many places.
constexpr std::size_t orders_of_levels = 3;
constexpr std::size_t most_level_cuts = 32;

/// A local model that no other stands below.
struct OpenLeaf {
  int node = 0;
  std::vector<int> rows;     // that it reaches
  Eigen::VectorXd validity;  // there
  Eigen::VectorXd normal;    // of the split above it, in standardised inputs; empty: there is none
  double effective = 0.0;    // parameters
  bool splittable = true;
};

/// How a leaf may be split.
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
      : data_(problem), options_(options), leaf_of_row_(static_cast<std::size_t>(data_.training.count()), 0) {
    const TrainingRows& training = data_.training;
    deviations_.resize(training.count(), std::ssize(training.regressors));
    for (std::ptrdiff_t index = 0; index < num_chunks(training); ++index) {
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
    std::ptrdiff_t best_leaves = 1;
    while (true) {
      if (data_.problem.options.max_leaves > 0 && std::ssize(leaves_) >= data_.problem.options.max_leaves) {
        stop = StopReason::max_leaves;
        break;
      }
      if (is_exact()) {
        stop = StopReason::exact_fit;
        break;
      }
      if (!split_worst()) {
        break;
      }
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
  /// Numeric split inputs that vary, about their centres and by their standard deviations; missing values are 0.
  void standardise_inputs() {
    const TrainingRows& training = data_.training;
    const double total = data_.weights.sum();
    for (std::ptrdiff_t j = 0; j < data_.split_inputs(); ++j) {
      const int input = data_.problem.options.split_inputs[static_cast<std::size_t>(j)];
      if (data_.num_levels[static_cast<std::size_t>(j)] > 0) {
        categorical_.push_back(input);
        continue;
      }
      const double centre = training.columns[static_cast<std::size_t>(input)].centre;
      Eigen::VectorXd values(training.count());
      for (std::ptrdiff_t i = 0; i < values.size(); ++i) {
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

  /// Least squares weighted with the validity, as a correction of the parent's model.
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

  /// Weighted squared errors of the whole model at some rows, of all outputs.
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
    if (!options_.stop_by_aicc) {
      return 0.0;
    }
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

  /// Splits the worst local model that can be split; false if there is none.
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
      if (worst == nullptr) {
        return false;
      }
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
    if (problem.weights.sum() < 2.0 * problem.least_weight) {
      return std::nullopt;
    }
    problem.output_weights = data_.output_weights;
    problem.models = options_.models;
    // In orthonormal columns, and without what one model explains.
    const NodeFit whole =
        fit_node(deviations_(leaf.rows, Eigen::all), data_.outputs(leaf.rows, Eigen::all), problem.weights);
    problem.a.resize(std::ssize(leaf.rows), whole.features.coefficients());
    for (std::ptrdiff_t i = 0; i < problem.a.rows(); ++i) {
      const double* row = whole.features.row(i);
      problem.a.row(i) = Eigen::Map<const Eigen::RowVectorXd>(row, problem.a.cols()) / row[0];
    }
    problem.y = whole.residuals();
    Cut best = best_plane(leaf, problem);
    for (const int input : categorical_) {
      if (Cut cut = best_levels(leaf, problem, input); cut.loss < best.loss) {
        best = std::move(cut);
      }
    }
    const double before = data_.output_weights.dot(whole.rss);
    return best.loss < before ? std::optional<Cut>(std::move(best)) : std::nullopt;
  }

  /// `problem.z` is set here.
  Cut best_plane(const OpenLeaf& leaf, GateProblem& problem) {
    Cut cut;
    const std::ptrdiff_t inputs = std::ssize(numeric_);
    if (inputs == 0) {
      return cut;
    }
    const double total = problem.weights.sum();
    Eigen::MatrixXd x = standardised_(leaf.rows, Eigen::all);
    const Eigen::RowVectorXd mean = problem.weights.transpose() * x / total;
    x.rowwise() -= mean;
    const Eigen::MatrixXd covariance = x.transpose() * (problem.weights.asDiagonal() * x) / total;
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(covariance);
    const std::ptrdiff_t kept =
        (eigen.eigenvalues().array() > collinear * std::max(1e-12, eigen.eigenvalues().maxCoeff())).count();
    if (kept == 0) {
      return cut;
    }
    const Eigen::VectorXd root = eigen.eigenvalues().tail(kept).cwiseSqrt();
    const Eigen::MatrixXd whiten = eigen.eigenvectors().rightCols(kept) * root.cwiseInverse().asDiagonal();
    const Eigen::MatrixXd colour = eigen.eigenvectors().rightCols(kept) * root.asDiagonal();  // its transpose undoes it
    problem.z.resize(x.rows(), kept + 1);
    problem.z << x * whiten, Eigen::VectorXd::Ones(x.rows());
    Eigen::MatrixXd directions(kept, inputs + 2);  // the axes, the most curved one, that of the split above
    directions << colour.transpose(), most_curved(problem),
        leaf.normal.size() > 0 ? Eigen::VectorXd(colour.transpose() * leaf.normal) : Eigen::VectorXd::Zero(kept);
    const GateFit best = best_gate(problem, directions, inputs);
    if (!std::isfinite(best.loss)) {
      return cut;
    }
    cut.loss = best.loss;
    // u = steepness . z + offset = normal . (standardised - mean) / half width + offset.
    const Eigen::VectorXd normal = whiten * best.gate.head(kept);
    cut.half_width = 1.0 / normal.norm();
    cut.normal = normal * cut.half_width;
    cut.threshold = mean * cut.normal - best.gate(kept) * cut.half_width;
    cut.share = gate_shares(problem, best.gate);
    return cut;
  }

  /// From the best of the first `axes` directions and from all others; those that are zero do not count.
  GateFit best_gate(const GateProblem& problem, const Eigen::MatrixXd& directions, std::ptrdiff_t axes) {
    const int threads = data_.problem.max_threads;
    const bool joint = problem.models == GateModels::joint;
    std::vector<GateFit> fits(static_cast<std::size_t>(directions.cols()));
    parallel_for(std::ssize(fits), threads, [&](std::ptrdiff_t k) {
      GateFit& fit = fits[static_cast<std::size_t>(k)];
      fit.loss = std::numeric_limits<double>::infinity();
      if (directions.col(k).norm() > least_direction) {
        fit = best_threshold(problem, directions.col(k), joint ? joint_width : local_width);
      }
    });
    const auto less = [](const GateFit& a, const GateFit& b) { return a.loss < b.loss; };
    std::stable_sort(fits.begin(), fits.begin() + axes, less);
    fits.erase(fits.begin() + std::min(axes, axes_to_start_from), fits.begin() + axes);
    std::erase_if(fits, [](const GateFit& fit) { return !std::isfinite(fit.loss); });
    parallel_for(std::ssize(fits), threads, [&](std::ptrdiff_t k) {
      GateFit& fit = fits[static_cast<std::size_t>(k)];
      fit =
          optimise_gate(problem, fit, joint ? least_joint_width : local_width, joint ? most_joint_width : local_width);
    });
    for (const GateFit& fit : fits) {
      evaluations_ += fit.evaluations;
    }
    const auto best = std::min_element(fits.begin(), fits.end(), less);
    return best == fits.end() ? GateFit{{}, std::numeric_limits<double>::infinity()} : *best;
  }

  /// The direction in which the residuals are most curved: principal Hessian direction (Li 1992).
  static Eigen::VectorXd most_curved(const GateProblem& problem) {
    const Eigen::VectorXd residual = problem.y * problem.output_weights.cwiseSqrt();
    const auto z = problem.z.leftCols(problem.z.cols() - 1);
    const Eigen::MatrixXd hessian = z.transpose() * (problem.weights.cwiseProduct(residual).asDiagonal() * z);
    const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(hessian);
    std::ptrdiff_t largest = 0;
    eigen.eigenvalues().cwiseAbs().maxCoeff(&largest);
    return eigen.eigenvectors().col(largest);
  }

  /// Of a leaf's rows: their level, -1 where there is none, and the weight of every level.
  struct Levels {
    int input = -1;
    std::vector<int> of_row;
    Eigen::VectorXd weight;
  };

  Levels levels_of(const OpenLeaf& leaf, const GateProblem& problem, int input) const {
    const Table& table = *data_.training.table;
    Levels levels{input, std::vector<int>(leaf.rows.size(), -1),
                  Eigen::VectorXd::Zero(table.num_levels[static_cast<std::size_t>(input)])};
    for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
      const double value = table.inputs(data_.training.rows[static_cast<std::size_t>(leaf.rows[i])], input);
      if (!std::isnan(value)) {
        levels.of_row[i] = static_cast<int>(value);
        levels.weight(levels.of_row[i]) += problem.weights(static_cast<std::ptrdiff_t>(i));
      }
    }
    return levels;
  }

  /// The levels that occur are put in order by the mean, over their rows, of the residual times a regressor: levels of
  /// which the slopes differ. Of these orders those in which levels differ most are cut where that leaves least.
  Cut best_levels(const OpenLeaf& leaf, const GateProblem& problem, int input) {
    const Levels levels = levels_of(leaf, problem, input);
    const std::ptrdiff_t columns = problem.a.cols();
    const Eigen::VectorXd residual = problem.weights.cwiseProduct(problem.y * problem.output_weights.cwiseSqrt());
    Eigen::MatrixXd means = Eigen::MatrixXd::Zero(columns, levels.weight.size());
    for (std::size_t i = 0; i < levels.of_row.size(); ++i) {
      if (levels.of_row[i] >= 0) {
        const std::ptrdiff_t row = static_cast<std::ptrdiff_t>(i);
        means.col(levels.of_row[i]) += residual(row) * problem.a.row(row).transpose();
      }
    }
    std::vector<int> present;
    for (int level = 0; level < levels.weight.size(); ++level) {
      if (levels.weight(level) > 0.0) {
        means.col(level) /= levels.weight(level);
        present.push_back(level);
      }
    }
    const Eigen::VectorXd spread = means.cwiseAbs2() * levels.weight;
    std::vector<std::ptrdiff_t> keys(static_cast<std::size_t>(columns));
    std::iota(keys.begin(), keys.end(), std::ptrdiff_t{0});
    std::stable_sort(keys.begin(), keys.end(), [&](auto a, auto b) { return spread(a) > spread(b); });
    keys.resize(std::min(keys.size(), orders_of_levels));
    Cut best;
    for (const std::ptrdiff_t key : keys) {
      std::stable_sort(present.begin(), present.end(), [&](int a, int b) { return means(key, a) < means(key, b); });
      cut_order(problem, levels, present, best);
    }
    return best;
  }

  /// Rows without a level belong to both sides.
  void cut_order(const GateProblem& problem, const Levels& levels, const std::vector<int>& order, Cut& best) {
    const std::size_t step = std::max<std::size_t>(1, order.size() / most_level_cuts);
    std::vector<int> side(static_cast<std::size_t>(levels.weight.size()), 0);
    for (const int level : order) {
      side[static_cast<std::size_t>(level)] = 1;
    }
    const double known = levels.weight.sum();
    double on_left = 0.0;
    for (std::size_t k = 0; k + 1 < order.size(); ++k) {
      side[static_cast<std::size_t>(order[k])] = -1;
      on_left += levels.weight(order[k]);
      if ((k + 1) % step != 0) {
        continue;
      }
      Eigen::VectorXd share(std::ssize(levels.of_row));
      for (std::size_t i = 0; i < levels.of_row.size(); ++i) {
        const int level = levels.of_row[i];
        share(static_cast<std::ptrdiff_t>(i)) = level < 0                                   ? on_left / known
                                                : side[static_cast<std::size_t>(level)] < 0 ? 1.0
                                                                                            : 0.0;
      }
      const double loss = share_loss(problem, share);
      ++evaluations_;
      if (loss < best.loss) {
        best.loss = loss;
        best.input = levels.input;
        best.level_side = side;
        best.threshold = on_left / known;
        best.share = std::move(share);
      }
    }
  }

  void split(OpenLeaf& leaf, const Cut& cut) {
    Node& parent = nodes_[static_cast<std::size_t>(leaf.node)];
    parent.left = static_cast<int>(nodes_.size());
    parent.right = parent.left + 1;
    set_split(parent, cut);
    std::ptrdiff_t on_left = 0;
    for (std::size_t i = 0; i < leaf.rows.size(); ++i) {
      int& of_row = leaf_of_row_[static_cast<std::size_t>(leaf.rows[i])];
      if (of_row == leaf.node) {
        const bool left = cut.share(static_cast<std::ptrdiff_t>(i)) >= 0.5;
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
        if (const double here = validity(static_cast<std::ptrdiff_t>(i)); here > negligible) {
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
      const double weight = cut.normal(static_cast<std::ptrdiff_t>(k));
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
  std::ptrdiff_t evaluations_ = 0;
};

}  // namespace

GrownPartition grow_hilomot(const GrowthProblem& problem, const HilomotOptions& hilomot) {
  return Hilomot(problem, hilomot).run();
}

}  // namespace llmt
