#include "explain/straight_line.hpp"

#include <cmath>

namespace llmt {

StraightLine::StraightLine(const Model& model, const Eigen::Ref<const Eigen::VectorXd>& from,
                           const Eigen::Ref<const Eigen::VectorXd>& to)
    : reference(from), point(to), way(Eigen::VectorXd::Zero(to.size())) {
  for (Eigen::Index j = 0; j < point.size(); ++j) {
    const bool missing = std::isnan(point(j));
    if (model.inputs()[j].is_categorical() || missing || std::isnan(reference(j))) {
      if (!(point(j) == reference(j) || (missing && std::isnan(reference(j))))) {
        switched.push_back(j);
      }
    } else if (point(j) != reference(j)) {
      way(j) = point(j) - reference(j);
      moving.push_back(j);
    }
  }
}

Eigen::VectorXd StraightLine::at(double position, const Eigen::VectorXd& row) const {
  Eigen::VectorXd x = row;
  for (const Eigen::Index j : moving) {
    x(j) = position == 1.0 ? point(j) : reference(j) + position * way(j);
  }
  return x;
}

}  // namespace llmt
