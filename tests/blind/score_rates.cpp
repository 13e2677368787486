#include <fmt/format.h>

#include <boost/math/special_functions/beta.hpp>

#include "blind/score_tables.hpp"

namespace blind {

double Rate::upper() const {
  return hits >= total ? 1.0 : boost::math::ibeta_inv(hits + 1.0, static_cast<double>(total - hits), 0.95);
}

double Rate::lower() const {
  return hits <= 0 ? 0.0 : boost::math::ibeta_inv(static_cast<double>(hits), total - hits + 1.0, 0.05);
}

std::string Rate::text() const {
  if (total == 0) return "-";
  return fmt::format("{}/{} {:.1f}% [{:.1f}..{:.1f}]", hits, total, 100.0 * hits / total, 100.0 * lower(),
                     100.0 * upper());
}

nlohmann::ordered_json Rate::json() const {
  return {{"hits", hits}, {"total", total}, {"lower95", lower()}, {"upper95", upper()}};
}

Group choose(const std::vector<Judged>& all, const std::function<bool(const Judged&)>& wanted) {
  Group group;
  for (const Judged& one : all) {
    if (wanted(one)) group.push_back(&one);
  }
  return group;
}

}  // namespace blind
