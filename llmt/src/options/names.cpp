#include "llmt/summary.hpp"

namespace llmt {

std::string describe(StopReason reason) {
  switch (reason) {
    case StopReason::max_leaves:
      return "the leaf limit";
    case StopReason::significance:
      return "the significance test";
    case StopReason::variance_gain:
      return "the variance gain";
    case StopReason::leaf_samples:
      return "the smallest leaf size";
    case StopReason::exact_fit:
      return "an exact fit";
    case StopReason::improvement:
      return "too little improvement";
    case StopReason::aicc:
      return "AICc";
    case StopReason::pruning:
      return "pruning";
    case StopReason::cross_validation:
      return "cross-validation";
  }
  return "";
}

}  // namespace llmt
