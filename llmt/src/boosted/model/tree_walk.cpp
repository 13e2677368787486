#include "boosted/model/tree_walk.hpp"

#include <algorithm>
#include <array>

#include "base/simd.hpp"

namespace llmt {
namespace {

constexpr int most_walk_levels = 16;
constexpr std::size_t most_places = 64;

int place_of(TreeWalk& walk, const BoostedSplit& split) {
  const TreeWalk::Place own{split.feature, split.threshold, split.half_width};
  const auto known = std::ranges::find(walk.places, own);
  const auto number = static_cast<int>(known - walk.places.begin());
  if (known == walk.places.end()) walk.places.push_back(own);
  return number;
}

// Adds the steps at and below `at`. False if there are too many levels.
bool add_steps(TreeWalk& walk, const BoostedTree& tree, int at, int level) {
  if (at < 0) {
    const BoostedLeaf& leaf = tree.leaves[-1 - at];
    walk.steps.push_back({TreeWalk::Kind::leaf, level, static_cast<int>(walk.leaves.size())});
    walk.leaves.push_back({leaf.constant, leaf.low, leaf.high, walk.slopes.size(), leaf.features.size()});
    for (std::size_t k = 0; k < leaf.features.size(); ++k) {
      walk.slopes.push_back({leaf.features[k], leaf.slopes[k]});
      if (!leaf.means.empty() && leaf.means[k] != 0.0) walk.needed.push_back(leaf.features[k]);
    }
    return true;
  }
  if (level == most_walk_levels) return false;
  const BoostedSplit& split = tree.splits[at];
  walk.steps.push_back({TreeWalk::Kind::split, level, place_of(walk, split)});
  walk.needed.push_back(split.feature);
  if (!add_steps(walk, tree, split.left, level + 1)) return false;
  walk.steps.push_back({TreeWalk::Kind::to_right, level});
  if (!add_steps(walk, tree, split.right, level + 1)) return false;
  return true;
}

// Numbers of the rows of a block.
using OfRows = std::array<double, rows_at_once>;

// Of the rows at a place, as share_of_right() and goes_both_ways() say of one.
struct Sides {
  OfRows right;    // share of the right side, of rows that go both ways
  OfRows least;    // of the smaller side; -1 of rows that go to one side whatever has come of them
  OfRows is_left;  // 1 or 0, of rows that go to one side
};

// What a walk needs, in the registers of an Eight.
template <class E>
struct Walker {
  // A typedef: as an argument of a template the type would lose its alignment.
  typedef typename E::Register V;  // NOLINT(modernize-use-using)
  static constexpr int width = E::bytes / static_cast<int>(sizeof(double));

  LLMT_INLINE static V load(const double* from) { return *reinterpret_cast<const V*>(from); }
  LLMT_INLINE static void store(double* to, V value) { *reinterpret_cast<V*>(to) = value; }

  LLMT_INLINE static void find_sides(const TreeWalk::Place& place, const double* z, Sides& sides) {
    const V none = {};
    for (int i = 0; i < rows_at_once; i += width) {
      const V value = load(z + i);
      store(&sides.is_left[i], value <= none + place.threshold ? none + 1.0 : none);
    }
    sides.right.fill(0.0);
    sides.least.fill(-1.0);
    if (!(place.half_width > 0.0)) return;
    for (int i = 0; i < rows_at_once; i += width) {
      const V value = load(z + i);
      const V distance = value - place.threshold;
      const V size = distance < none ? -distance : distance;
      const V u = distance / place.half_width;
      const V right = 0.5 + u * (3.0 - u * u) / 4.0;
      const V left = 1.0 - right;
      const V least = left < right ? left : right;
      store(&sides.right[i], right);
      store(&sides.least[i], size < none + place.half_width ? least : none - 1.0);
    }
  }

  // A side of a row that goes both ways is added up by itself, as value_of() does: `kept` is the sum before it.
  LLMT_INLINE static void split(const Sides& sides, double smallest, OfRows& share, OfRows& to_right, OfRows& kept,
                                OfRows& sum) {
    const V none = {};
    for (int i = 0; i < rows_at_once; i += width) {
      const V own = load(&share[i]);
      const V right = load(&sides.right[i]);
      const V is_left = load(&sides.is_left[i]);
      const V so_far = load(&sum[i]);
      const auto goes_both_ways = own * load(&sides.least[i]) >= none + smallest;
      const V on_left = goes_both_ways ? 1.0 - right : is_left;
      const V on_right = goes_both_ways ? right : 1.0 - is_left;
      const V left_alone = goes_both_ways ? none : is_left;
      store(&to_right[i], own * on_right);
      store(&share[i], own * on_left);
      store(&kept[i], left_alone > none ? none : so_far);
      store(&sum[i], left_alone > none ? so_far : none);
    }
  }

  LLMT_INLINE static void add_leaf(const TreeWalk& walk, const TreeWalk::Leaf& leaf, const double* in_slopes,
                                   const OfRows& share, OfRows& sum) {
    const V none = {};
    const V low = none + leaf.low;
    const V high = none + leaf.high;
    for (int i = 0; i < rows_at_once; i += width) {
      V value = none + leaf.constant;
      for (std::size_t k = leaf.first; k < leaf.first + leaf.count; ++k) {
        const TreeWalk::Slope& of = walk.slopes[k];
        value += of.slope * load(in_slopes + static_cast<std::ptrdiff_t>(of.feature) * rows_at_once + i);
      }
      value = value < low ? low : high < value ? high : value;
      store(&sum[i], load(&sum[i]) + load(&share[i]) * value);
    }
  }

  LLMT_INLINE static void add(const TreeWalk& walk, const double* z, const double* in_slopes, double* values) {
    std::array<Sides, most_places> places;
    std::array<OfRows, most_walk_levels> to_right;
    std::array<OfRows, most_walk_levels> kept;
    for (std::size_t p = 0; p < walk.places.size(); ++p) {
      const TreeWalk::Place& place = walk.places[p];
      find_sides(place, z + static_cast<std::ptrdiff_t>(place.feature) * rows_at_once, places[p]);
    }
    OfRows share;
    OfRows sum = {};
    share.fill(1.0);
    for (const TreeWalk::Step& step : walk.steps) {
      if (step.kind == TreeWalk::Kind::split) {
        split(places[step.number], walk.smallest_share, share, to_right[step.level], kept[step.level], sum);
      } else if (step.kind == TreeWalk::Kind::leaf) {
        add_leaf(walk, walk.leaves[step.number], in_slopes, share, sum);
      } else {
        share = to_right[step.level];
        for (int i = 0; i < rows_at_once; ++i) sum[i] += kept[step.level][i];
      }
    }
    for (int i = 0; i < rows_at_once; ++i) values[i] += sum[i];
  }
};

}  // namespace

std::optional<TreeWalk> walk_of(const BoostedTree& tree) {
  const auto is_soft = [](const BoostedSplit& split) { return split.half_width > 0.0; };
  if (std::ranges::none_of(tree.splits, is_soft)) return std::nullopt;
  TreeWalk walk;
  walk.smallest_share = tree.smallest_share;
  if (!add_steps(walk, tree, tree.splits.empty() ? -1 : 0, 0) || walk.places.size() > most_places) return std::nullopt;
  std::ranges::sort(walk.needed);
  const auto repeated = std::ranges::unique(walk.needed);
  walk.needed.erase(repeated.begin(), repeated.end());
  return walk;
}

void add_values(const TreeWalk& walk, const double* z, const double* in_slopes, double* values) {
  with_widest_registers([&](auto eight)
                            LLMT_INLINE_LAMBDA { Walker<decltype(eight)>::add(walk, z, in_slopes, values); });
}

}  // namespace llmt
