// M5' written out plainly, node by node.
#pragma once

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <functional>
#include <set>
#include <utility>
#include <vector>

#include "oracles/oracles.hpp"

namespace oracle {

/// M5' as docs/algorithms/m5.md defines it, written out plainly: every split compared, every model refitted.
class PlainM5 {
 public:
  using Rows = std::vector<Eigen::Index>;

  struct Tree {
    Rows rows;
    int input = -1;
    double low = 0.0;  // the gap
    double high = 0.0;
    std::set<int> tested;
    Eigen::VectorXd model;     // before smoothing: constant, then all inputs
    Eigen::VectorXd smoothed;  // of the leaves
    double coefficients = 1.0;
    std::vector<Tree> children;
  };

  PlainM5(const Eigen::MatrixXd& x, const Eigen::VectorXd& y) : x_(x), y_(y) {
    for (Eigen::Index i = 0; i < x.rows(); ++i) {
      root_.rows.push_back(i);
    }
    grow(root_);
    prune(root_);
    smooth(root_, {});
  }

  const Tree& root() const { return root_; }

 private:
  double variance(const Rows& rows) const {
    const Eigen::VectorXd y = y_(rows);
    return (y.array() - y.mean()).square().mean();
  }

  double impurity(const Rows& rows) const {
    return static_cast<double>(rows.size()) * std::pow(variance(rows) / variance(root_.rows), 0.2);
  }

  void grow(Tree& tree) {
    if (tree.rows.size() < 4 || std::sqrt(variance(tree.rows)) < 0.05 * std::sqrt(variance(root_.rows))) {
      return;
    }
    double smallest = impurity(tree.rows);
    std::array<Rows, 2> best;
    for (int j = 0; j < x_.cols(); ++j) {
      std::set<double> values;
      for (const Eigen::Index row : tree.rows) {
        values.insert(x_(row, j));
      }
      for (auto at = values.begin(); std::next(at) != values.end(); ++at) {
        std::array<Rows, 2> sides;
        for (const Eigen::Index row : tree.rows) {
          sides[x_(row, j) <= *at ? 0 : 1].push_back(row);
        }
        const double left_over = impurity(sides[0]) + impurity(sides[1]);
        const std::size_t fewest = std::max<std::size_t>(2, tree.rows.size() / 5);
        if (std::min(sides[0].size(), sides[1].size()) >= fewest && left_over < smallest - 1e-9) {
          smallest = left_over;
          best = sides;
          tree.input = j;
          tree.low = *at;
          tree.high = *std::next(at);
        }
      }
    }
    if (tree.input >= 0) {
      tree.children.resize(2);
      tree.tested.insert(tree.input);
      for (std::size_t side = 0; side < 2; ++side) {
        tree.children[side].rows = best[side];
        grow(tree.children[side]);
        tree.tested.insert(tree.children[side].tested.begin(), tree.children[side].tested.end());
      }
    }
  }

  static double adjusted(double squares, double n, double v) {
    return n > v ? std::sqrt(squares / n) * (n + 2.0 * v) / (n - v) : 10.0 * std::sqrt(squares / n);
  }

  Eigen::VectorXd residuals(const Rows& rows, const Eigen::VectorXd& model) const {
    return y_(rows) - (x_(rows, Eigen::all) * model.tail(x_.cols())).array().matrix() -
           Eigen::VectorXd::Constant(std::ssize(rows), model(0));
  }

  // Of the inputs given.
  Eigen::VectorXd fit(const Rows& rows, const std::vector<int>& inputs) const {
    Eigen::MatrixXd regressors(std::ssize(rows), 1 + std::ssize(inputs));
    regressors.col(0).setOnes();
    regressors.rightCols(std::ssize(inputs)) = x_(rows, inputs);
    const Eigen::VectorXd found = oracle::least_squares(regressors, y_(rows));
    Eigen::VectorXd model = Eigen::VectorXd::Zero(1 + x_.cols());
    model(0) = found(0);
    for (std::size_t k = 0; k < inputs.size(); ++k) {
      model(1 + inputs[k]) = found(1 + k);
    }
    return model;
  }

  void fit(Tree& tree) const {
    std::vector<int> inputs(tree.tested.begin(), tree.tested.end());
    const double n = static_cast<double>(tree.rows.size());
    while (true) {
      tree.model = fit(tree.rows, inputs);
      tree.coefficients = 1.0 + static_cast<double>(inputs.size());
      if (inputs.empty()) return;
      double smallest = std::numeric_limits<double>::infinity();
      std::vector<int> fewer;
      for (std::size_t k = 0; k < inputs.size(); ++k) {
        std::vector<int> without = inputs;
        without.erase(without.begin() + k);
        const double squares = residuals(tree.rows, fit(tree.rows, without)).squaredNorm();
        if (squares < smallest) {
          smallest = squares;
          fewer = without;
        }
      }
      const double with = adjusted(residuals(tree.rows, tree.model).squaredNorm(), n, tree.coefficients);
      if (n > tree.coefficients && adjusted(smallest, n, tree.coefficients - 1.0) > with) return;
      inputs = fewer;
    }
  }

  // Sum of squares of the tree.
  double prune(Tree& tree) {
    fit(tree);
    const double of_model = residuals(tree.rows, tree.model).squaredNorm();
    if (tree.children.empty()) return of_model;
    const double below = prune(tree.children[0]) + prune(tree.children[1]);
    const double coefficients = tree.children[0].coefficients + tree.children[1].coefficients + 1.0;
    const double n = static_cast<double>(tree.rows.size());
    if (adjusted(of_model, n, tree.coefficients) <= adjusted(below, n, coefficients)) {
      tree.children.clear();
      return of_model;
    }
    tree.coefficients = coefficients;
    return below;
  }

  // `above`: the ancestors, from the root down.
  void smooth(Tree& tree, std::vector<const Tree*> above) {
    tree.smoothed = tree.model;
    double n = static_cast<double>(tree.rows.size());
    for (auto at = above.rbegin(); at != above.rend(); ++at) {
      tree.smoothed = (n * tree.smoothed + 15.0 * (*at)->model) / (n + 15.0);
      n = static_cast<double>((*at)->rows.size());
    }
    above.push_back(&tree);
    for (Tree& child : tree.children) {
      smooth(child, above);
    }
  }

  const Eigen::MatrixXd& x_;
  const Eigen::VectorXd& y_;
  Tree root_;
};

}  // namespace oracle
