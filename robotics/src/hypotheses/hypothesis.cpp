#include "hypotheses/hypothesis.hpp"

namespace llmt::robotics {

void set_limits(const EffectType& type, Eigen::Index values, discovery::EffectCandidate& candidate) {
  candidate.lower.resize(values);
  candidate.upper.resize(values);
  for (Eigen::Index k = 0; k < values; ++k) {
    const EffectParameter& parameter = type.parameters[type.parameters[0].list ? 0 : k];
    candidate.lower(k) = parameter.lower;
    candidate.upper(k) = parameter.upper;
  }
}

}  // namespace llmt::robotics
