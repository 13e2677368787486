#include <array>

#include "llmt/model.hpp"

namespace llmt {
namespace {

// These names are in model files.
constexpr std::array<Choice<ValidityKind>, 4> kinds = {{{ValidityKind::crisp, "crisp"},
                                                        {ValidityKind::blend, "blend"},
                                                        {ValidityKind::gaussian, "gaussian"},
                                                        {ValidityKind::logistic, "logistic"}}};

}  // namespace

template <>
std::span<const Choice<ValidityKind>> choices() {
  return kinds;
}

}  // namespace llmt
