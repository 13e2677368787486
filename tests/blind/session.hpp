/// \file
/// A measuring session: which poses, in which order, under which conditions.
#pragma once

#include "blind/arm.hpp"
#include "llmt/random.hpp"

namespace blind {

/// One row a measurement, in measuring order. q is what the controller logged as commanded.
struct Session {
  Eigen::MatrixXd q, read_back, approach;  ///< n x J: rad, rad, +-1
  Eigen::VectorXd payload, temperature, time, order;
  std::vector<int> pose;                   ///< equal number: the same pose again
  std::vector<bool> returned;              ///< belongs to a repeated pose
  Eigen::Vector2d time_span = {0.0, 1.0};  ///< first and last moment of the whole session, s

  Eigen::Index count() const { return q.rows(); }
};

struct SessionOptions {
  int poses = 60;
  int held_out = 15;
  bool two_payloads = true;
  bool repeats = false;
  bool dwelled = false;            ///< the repeats follow each other without leaving the pose
  double read_back_jitter = 1e-4;  ///< rad, standard deviation
};

struct Sessions {
  Session measured, held_out, fresh;
};

/// Poses uniform within the limits; temperature a random walk of 6 ... 10 K; each joint ends with a small move of its
/// own from a random side. Held-out poses are one block of the same session, so that nothing is extrapolated; fresh
/// poses (100) are spread over its time.
Sessions make_sessions(const Arm& arm, const std::vector<double>& payloads, const SessionOptions& options,
                       llmt::Random& random);

/// The given rows.
Session select(const Session& session, const std::vector<int>& rows);

}  // namespace blind
