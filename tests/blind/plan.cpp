#include "blind/plan.hpp"

#include <algorithm>
#include <array>
#include <stdexcept>

namespace blind {
namespace {

struct Counts {
  std::uint64_t seeds;  // of the plan
  int none, effect, unknown, pairs, dirty, dirty_effect;
};

constexpr std::array<const char*, 3> dirts = {"outliers", "heavy_tails", "dwelled"};

struct Builder {
  std::string arm;
  std::uint64_t seed;
  std::vector<Order> orders;

  // Every kind of every arm has room for a thousand seeds, so counts may grow without changing other cases.
  void add(int count, const std::string& kind, const std::string& dirty = "") {
    for (int i = 0; i < count; ++i) orders.push_back({arm, kind, dirty, seed + static_cast<std::uint64_t>(i)});
    seed += 1000;
  }
};

}  // namespace

std::vector<Order> plan(const std::string& name, const std::string& arm) {
  const Arm nominal = nominal_arm(arm);
  const std::uint64_t block = arm == "planar" ? 0 : arm == "tx200" ? 100000 : 200000;
  Builder b{arm, 0, {}};
  if (name == "gate") {
    b.seed = 5000000 + block;
    for (const char* kind : {"none", "joint_compliance", "transmission_error_gear", "worn_tooth"}) b.add(1, kind);
    return b.orders;
  }
  Counts n{};
  if (name == "dev") {
    n = {1000000, 40, 10, 8, 30, 20, 4};
  } else if (name == "frozen") {
    n = {9000000, 150, 40, 30, 150, 100, 10};
  } else {
    throw std::invalid_argument("no plan '" + name + "': dev, frozen or gate");
  }
  b.seed = n.seeds + block;
  b.add(n.none, "none");
  for (const char* dirt : dirts) b.add(n.dirty, "none", dirt);
  b.add(n.pairs, "pair");
  for (const std::string& kind : unknown_kinds()) b.add(n.unknown, kind);
  for (const std::string& kind : catalogue_kinds(nominal)) b.add(n.effect, kind);
  for (const char* kind : {"joint_compliance", "eccentricity", "backlash_approach"}) {
    for (const char* dirt : dirts) b.add(n.dirty_effect, kind, dirt);
  }
  return b.orders;
}

}  // namespace blind
