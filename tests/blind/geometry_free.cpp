#include <Eigen/QR>
#include <Eigen/SVD>
#include <memory>

#include "blind/case.hpp"

namespace blind {

Eigen::MatrixXd positions_mm(const Arm& arm, const Elasticity& base, const std::vector<const Hidden*>& hidden,
                             const Session& session) {
  const Pieces pieces(arm);
  std::vector<Change> changes(session.count(), Change(arm.size()));
  Elasticity elasticity = base;
  for (const Hidden* effect : hidden) {
    if (effect->elastic) effect->elastic(elasticity);
    if (effect->change) effect->change(session, changes);
  }
  std::unique_ptr<StaticArm> at_rest;
  if (!elasticity.rigid()) at_rest = std::make_unique<StaticArm>(arm, elasticity);
  const Eigen::Isometry3d to_base = pieces.base.inverse();
  Eigen::MatrixXd points(session.count(), 3);
  for (Eigen::Index i = 0; i < session.count(); ++i) {
    const Change& change = changes[i];
    const Eigen::VectorXd q = session.q.row(i).transpose();
    Eigen::Vector3d point = tool_point(pieces, q, &change);
    if (at_rest) {  // the deflection, at the angles where the drives really are
      const Eigen::VectorXd turned = q + change.angle;
      const Eigen::Vector3d bent = at_rest->tool_point(turned, session.payload(i), session.approach.row(i).transpose());
      point += change.world.linear() * pieces.base.linear() * (bent - to_base * tool_point(pieces, turned));
    }
    points.row(i) = 1e3 * point.transpose();
  }
  return points;
}

GeometryFree::GeometryFree(const Arm& arm, const Elasticity& base, const Session& session) : planar_(arm.planar) {
  const Pieces pieces(arm);
  const int joints = arm.size();
  const bool elastic = !base.rigid();
  std::vector<int> soft;
  if (elastic) {
    for (int j = 0; j < joints; ++j) {
      if (base.joint_compliance[j] > 0.0) soft.push_back(j);
    }
  }
  const Eigen::Index axes = planar_ ? 2 : 3, twists = 6 * (joints + 1);
  Eigen::MatrixXd all(session.count() * axes, twists + 3 + soft.size());
  for (Eigen::Index i = 0; i < session.count(); ++i) {
    const std::vector<Eigen::Isometry3d> frame = frames(pieces, session.q.row(i).transpose());
    const Eigen::Vector3d tool = frame.back().translation();
    Eigen::Index column = 0;
    for (int j = -1; j < joints; ++j) {
      const Eigen::Isometry3d& at = j < 0 ? pieces.base : frame[j];
      for (int k = 0; k < 3; ++k) {
        const Eigen::Vector3d axis = at.linear().col(k), moved = axis.cross(tool - at.translation());
        all.col(column++).segment(i * axes, axes) = axis.head(axes);
        all.col(column++).segment(i * axes, axes) = moved.head(axes);
      }
    }
    for (int k = 0; k < 3; ++k) all.col(column++).segment(i * axes, axes) = frame.back().linear().col(k).head(axes);
  }
  const Eigen::MatrixXd before = elastic ? positions_mm(arm, base, {}, session) : Eigen::MatrixXd();
  for (std::size_t k = 0; k < soft.size(); ++k) {
    Elasticity softer = base;
    softer.joint_compliance[soft[k]] *= 1.5;
    all.col(twists + 3 + k) = stacked(positions_mm(arm, softer, {}, session) - before);
  }
  for (Eigen::Index c = 0; c < all.cols(); ++c) {
    const double norm = all.col(c).norm();
    if (norm > 1e-12) all.col(c) /= norm;
  }
  const Eigen::Index thin = std::min(all.rows(), all.cols());
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(all);
  const Eigen::MatrixXd upper = qr.matrixQR().topRows(thin).triangularView<Eigen::Upper>();
  const Eigen::JacobiSVD<Eigen::MatrixXd> svd(upper, Eigen::ComputeThinU);
  const Eigen::VectorXd& s = svd.singularValues();
  const Eigen::Index rank = (s.array() > 1e-9 * s(0)).count();
  basis_ = Eigen::MatrixXd::Zero(all.rows(), rank);
  basis_.topRows(thin) = svd.matrixU().leftCols(rank);
  basis_.applyOnTheLeft(qr.householderQ());
}

Eigen::VectorXd GeometryFree::stacked(const Eigen::MatrixXd& points) const {
  const Eigen::Index axes = planar_ ? 2 : 3;
  Eigen::VectorXd v(points.rows() * axes);
  for (Eigen::Index i = 0; i < points.rows(); ++i) v.segment(i * axes, axes) = points.row(i).head(axes).transpose();
  return v;
}

Eigen::VectorXd GeometryFree::operator()(const Eigen::MatrixXd& displacement_mm) const {
  Eigen::VectorXd v = stacked(displacement_mm);
  v -= basis_ * (basis_.transpose() * v);
  return v;
}

}  // namespace blind
