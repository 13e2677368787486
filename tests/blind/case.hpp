/// \file
/// One case of the blind test: an arm that was built, a session, what is hidden in it, and its files.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "blind/hidden.hpp"

namespace blind {

/// What is asked for.
struct Order {
  std::string arm;    ///< planar, tx200 or small6
  std::string kind;   ///< "none", a kind of hidden.hpp, or "pair"
  std::string dirty;  ///< "", "outliers", "heavy_tails" or "dwelled"
  std::uint64_t seed = 0;
  std::string name() const;
};

struct HiddenShare {
  Hidden effect;
  double lambda = 0.0;               ///< energy that geometry cannot absorb, in units of the noise
  double lambda_beyond_other = 0.0;  ///< of a pair: that the other one's displacement cannot absorb either
  double rms_mm = 0.0;               ///< displacement
};

struct Case {
  Order order;
  Arm described, arm;
  Elasticity base;  ///< what the description knows to give way
  std::vector<int> elastic_joints;
  std::vector<double> elastic_values;
  SessionOptions options;
  Sessions sessions;
  double noise_mm = 0.0;
  std::vector<HiddenShare> hidden;
  double lambda = 0.0;
  double deflection_mm = 0.0;              ///< rms, of the softness that the description knows
  double lambda_beyond_first_order = 0.0;  ///< what is left of it for a tool that takes torques of the rigid arm
  Eigen::MatrixXd measured_mm, held_out_mm, fresh_mm;  ///< n x 3; fresh: without noise
  std::vector<int> outliers;                           ///< rows
};

/// Tool points of the arm as built, in the instrument's frame, n x 3, mm, free of noise.
Eigen::MatrixXd positions_mm(const Arm& arm, const Elasticity& base, const std::vector<const Hidden*>& hidden,
                             const Session& session);

/// What no geometry explains: (I - QQ')e, with Q a basis of the displacements by small twists of every frame of the arm
/// (6 each, 3 at the tool; and by the compliances that the description has).
class GeometryFree {
 public:
  GeometryFree(const Arm& arm, const Elasticity& base, const Session& session);
  Eigen::VectorXd operator()(const Eigen::MatrixXd& displacement_mm) const;
  Eigen::Index rank() const { return basis_.cols(); }

 private:
  bool planar_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd stacked(const Eigen::MatrixXd& points) const;
};

/// Everything of a case follows from its order.
Case make_case(const Order& order);

/// Writes DIR/<name>/{robot.yaml, measured.csv, heldout.csv} and DIR/truth/<name>.{json, fresh.csv}.
void write(const Case& c, const std::string& folder);

/// A table as docs/file-formats.md says; planar arms have no z.
std::string to_csv(const Session& session, const Eigen::MatrixXd& points_mm, bool planar, bool repeats);

}  // namespace blind
