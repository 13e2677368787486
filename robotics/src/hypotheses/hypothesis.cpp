#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

void set_limits(const EffectType& type, Eigen::Index values, discovery::EffectCandidate& candidate) {
  // A list holds moments of single bodies, of which poses determine combinations only: limits of each would refuse them
  // all for one that is not determined.
  if (type.parameters[0].list) return;
  candidate.lower.resize(values);
  candidate.upper.resize(values);
  for (Eigen::Index k = 0; k < values; ++k) {
    const EffectParameter& parameter = type.parameters[k];
    candidate.lower(k) = parameter.lower;
    candidate.upper(k) = parameter.upper;
  }
}

}  // namespace llmt::robotics
