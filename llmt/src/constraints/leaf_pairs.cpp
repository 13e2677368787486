#include "constraints/leaf_pairs.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "base/count.hpp"

namespace llmt {
namespace {

using Pair = LeafPairs::Pair;
using Coefficient = LeafPairs::Coefficient;

// A transition is cut into four parts, each with Bernstein coefficients of its own. With more parts the coefficients
// are closer to the values of the polynomial, and there are more inequalities.
constexpr int parts_of_transition = 4;

// Pieces bent less than this, relative to their values, are straight.
constexpr double straight = 1e-12;

// Bernstein coefficients of |g'| that are not above this count as zero. The condition then is on slopes alone, which
// have the sign anyway.
constexpr double least_gate_slope = 1e-9;

// Bernstein coefficients of a polynomial of degree 3 on 0 ... 1.
using Bernstein = std::array<double, 4>;

// Those of the same polynomial on from ... to, by de Casteljau's algorithm.
Bernstein on_part(Bernstein b, double from, double to) {
  const std::size_t degree = b.size() - 1;
  for (std::size_t step = 0; step < degree; ++step) {  // on 0 ... to
    for (std::size_t i = degree; i > step; --i) {
      b[i] = (1.0 - to) * b[i - 1] + to * b[i];
    }
  }
  const double ratio = from / to;
  for (std::size_t step = 0; step < degree; ++step) {  // its upper part
    for (std::size_t i = 0; i + step < degree; ++i) {
      b[i] = (1.0 - ratio) * b[i] + ratio * b[i + 1];
    }
  }
  return b;
}

// Where the transition of a split is, as far as both leaves reach: positions of the split input.
struct Transition {
  double threshold;
  double half_width;
  double from;
  double to;

  bool is_empty() const { return half_width > 0.0 ? !(from < to) : !(from <= to); }
};

// The coefficients of f_l' and f_r' in the derivative times h / |g'|, for each Bernstein coefficient of each part of
// the transition.
std::vector<Coefficient> transition_coefficients(const Transition& transition, double share_left, double share_right) {
  const Bernstein slope = {0, 1, 1, 0};    // |g'|
  const Bernstein moment = {0, -1, 1, 0};  // u |g'|
  const Bernstein gate = {1, 1, 0, 0};
  Bernstein of_left;
  Bernstein of_right;
  for (std::size_t i = 0; i < gate.size(); ++i) {
    of_left[i] = share_left * gate[i] - moment[i];
    of_right[i] = share_right * (1.0 - gate[i]) + moment[i];
  }
  const double h = transition.half_width;
  const double first = 0.5 * ((transition.from - transition.threshold) / h + 1.0);
  const double last = 0.5 * ((transition.to - transition.threshold) / h + 1.0);
  std::vector<Coefficient> result;
  for (int part = 0; part < parts_of_transition; ++part) {
    const double begin = std::clamp(first + (last - first) * part / parts_of_transition, 0.0, 1.0);
    const double end = std::clamp(first + (last - first) * (part + 1) / parts_of_transition, 0.0, 1.0);
    const Bernstein a = on_part(of_left, begin, end);
    const Bernstein b = on_part(of_right, begin, end);
    const Bernstein c = on_part(slope, begin, end);
    for (std::size_t i = 0; i < c.size(); ++i) {
      if (c[i] > least_gate_slope) result.push_back({h * a[i] / c[i], h * b[i] / c[i]});
    }
  }
  return result;
}

// Slopes have the sign, so a condition follows from another one of which neither coefficient is larger. Of equal ones
// the first is kept.
std::vector<Coefficient> without_implied(const std::vector<Coefficient>& all) {
  std::vector<Coefficient> result;
  for (std::size_t i = 0; i < all.size(); ++i) {
    const bool implied = std::ranges::any_of(all, [&](const Coefficient& other) {
      const std::size_t at = &other - all.data();
      return at != i && other.of_left <= all[i].of_left && other.of_right <= all[i].of_right &&
             (at < i || other.of_left < all[i].of_left || other.of_right < all[i].of_right);
    });
    if (!implied) result.push_back(all[i]);
  }
  return result;
}

class PairBuilder {
 public:
  explicit PairBuilder(const LeafGeometry& geometry) : geometry_(geometry) {}

  void add_pair(int split, int left, int right);
  LeafPairs take() { return std::move(result_); }

 private:
  void add_options(int input, int left, int right);
  void add_threshold(const Pair& pair, const Transition& transition);
  void add_levels(int input, int left, int right);
  void add_option(const std::vector<Eigen::Index>& regressors, const std::vector<double>& deviations, int left,
                  int right);
  void add_pieces(Eigen::Index regressor, double low, double high, int left, int right);
  void add_missing(int input, int left, int right);

  const LeafGeometry& geometry_;
  LeafPairs result_;
};

void PairBuilder::add_pair(int split, int left, int right) {
  const Node& node = geometry_.node(split);
  const int input = node.split_input;
  if (!geometry_.meet(left, right, input)) return;
  const double h = geometry_.half_width(split);
  const Transition transition{
      .threshold = node.threshold,
      .half_width = h,
      .from = std::max({node.threshold - h, geometry_.low(input, left), geometry_.low(input, right)}),
      .to = std::min({node.threshold + h, geometry_.high(input, left), geometry_.high(input, right)})};
  if (transition.is_empty()) return;
  Pair pair{.split = split,
            .left = left,
            .right = right,
            .sign = static_cast<double>(geometry_.sign(split)),
            .regressor = geometry_.regressor_of(input),
            .inputs = {std::ssize(result_.inputs), 0},
            .coefficients = {std::ssize(result_.coefficients), 0}};
  std::vector<Coefficient> coefficients = {{0.0, 0.0}};
  if (h > 0.0 && pair.regressor >= 0) {
    coefficients =
        transition_coefficients(transition, geometry_.slope_share(left, input, transition.from, transition.to),
                                geometry_.slope_share(right, input, transition.from, transition.to));
  }
  for (const Coefficient& coefficient : without_implied(coefficients)) {
    result_.coefficients.push_back(coefficient);
  }
  pair.coefficients.count = std::ssize(result_.coefficients) - pair.coefficients.first;
  for (int other = 0; other < geometry_.inputs(); ++other) {
    if (other != input) add_options(other, left, right);
  }
  if (pair.regressor >= 0) add_threshold(pair, transition);
  pair.inputs.count = std::ssize(result_.inputs) - pair.inputs.first;
  result_.pairs.push_back(pair);
}

// The split input at the threshold.
void PairBuilder::add_threshold(const Pair& pair, const Transition& transition) {
  const double deviation = transition.threshold - geometry_.centre(pair.regressor);
  result_.inputs.push_back({std::ssize(result_.options), 1});
  if (transition.half_width > 0.0) {  // both models are straight across the transition
    result_.options.push_back({0.0, {std::ssize(result_.terms), 1}});
    result_.terms.push_back({pair.regressor, deviation, deviation});
  } else {
    add_option({pair.regressor}, {deviation}, pair.left, pair.right);
  }
}

void PairBuilder::add_options(int input, int left, int right) {
  const std::vector<Eigen::Index>& regressors = geometry_.regressors_of(input);
  if (regressors.empty()) return;
  const Eigen::Index first = std::ssize(result_.options);
  if (geometry_.is_categorical(input)) {
    add_levels(input, left, right);
  } else {
    const double centre = geometry_.centre(regressors.front());
    const double low = std::max(geometry_.low(input, left), geometry_.low(input, right)) - centre;
    const double high = std::min(geometry_.high(input, left), geometry_.high(input, right)) - centre;
    if (low < high) add_pieces(regressors.front(), low, high, left, right);
  }
  if (geometry_.reaches_missing(left, input) && geometry_.reaches_missing(right, input)) {
    add_missing(input, left, right);
  }
  result_.inputs.push_back({first, std::ssize(result_.options) - first});
}

void PairBuilder::add_levels(int input, int left, int right) {
  const std::vector<Eigen::Index>& regressors = geometry_.regressors_of(input);
  for (int level = 0; level < geometry_.levels(input); ++level) {
    if (!geometry_.reaches(left, input, level) || !geometry_.reaches(right, input, level)) continue;
    std::vector<double> deviations;
    for (const Eigen::Index k : regressors) {
      deviations.push_back((geometry_.level_of(k) == level ? 1.0 : 0.0) - geometry_.centre(k));
    }
    add_option(regressors, deviations, left, right);
  }
}

void PairBuilder::add_missing(int input, int left, int right) {
  const std::vector<Eigen::Index>& regressors = geometry_.regressors_of(input);
  result_.options.push_back({0.0, {std::ssize(result_.terms), std::ssize(regressors)}});
  for (const Eigen::Index k : regressors) {
    result_.terms.push_back({k, geometry_.node(left).mean(k), geometry_.node(right).mean(k)});
  }
}

void PairBuilder::add_option(const std::vector<Eigen::Index>& regressors, const std::vector<double>& deviations,
                             int left, int right) {
  LeafPairs::Option option{0.0, {std::ssize(result_.terms), std::ssize(regressors)}};
  for (std::size_t i = 0; i < regressors.size(); ++i) {
    const auto [of_left, rest_left] = geometry_.clamped(left, regressors[i], deviations[i]);
    const auto [of_right, rest_right] = geometry_.clamped(right, regressors[i], deviations[i]);
    option.constant += rest_right - rest_left;
    result_.terms.push_back({regressors[i], of_left, of_right});
  }
  result_.options.push_back(option);
}

// f_r - f_l as a function of one regressor consists of parabolas between the ends of ranges and of their roundings. A
// parabola is not below the smallest of its Bernstein coefficients: the values at both ends and one between.
void PairBuilder::add_pieces(Eigen::Index regressor, double low, double high, int left, int right) {
  std::vector<double> at;
  for (const int leaf : {left, right}) {
    geometry_.add_kinks(leaf, regressor, low, high, at);
  }
  for (const double end : {low, high}) {
    if (std::isfinite(end)) at.push_back(end);
  }
  std::ranges::sort(at);
  at.erase(std::unique(at.begin(), at.end()), at.end());
  // Constant, and the deviations that count on the left and on the right.
  using Value = std::array<double, 3>;
  const auto value_at = [&](double deviation) {
    const auto [of_left, rest_left] = geometry_.clamped(left, regressor, deviation);
    const auto [of_right, rest_right] = geometry_.clamped(right, regressor, deviation);
    return Value{rest_right - rest_left, of_left, of_right};
  };
  const auto add = [&](const Value& value) {
    result_.options.push_back({value[0], {std::ssize(result_.terms), 1}});
    result_.terms.push_back({regressor, value[1], value[2]});
  };
  Value before{};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const Value now = value_at(at[i]);
    if (i > 0) {
      const Value middle = value_at(at[i - 1] + 0.5 * (at[i] - at[i - 1]));
      Value between{};
      bool bent = false;
      for (std::size_t c = 0; c < between.size(); ++c) {
        const double chord = 0.5 * (before[c] + now[c]);
        between[c] = 2.0 * middle[c] - chord;
        bent = bent || std::abs(middle[c] - chord) > straight * (std::abs(before[c]) + std::abs(now[c]));
      }
      if (bent) add(between);
    }
    add(now);
    before = now;
  }
}

}  // namespace

LeafPairs leaf_pairs(const LeafGeometry& geometry, const Partition& partition,
                     const std::vector<std::vector<int>>& below) {
  PairBuilder builder(geometry);
  for (int i = count_of(partition.nodes) - 1; i >= 0; --i) {
    if (partition.nodes[i].is_leaf() || geometry.sign(i) == 0) continue;
    for (const int left : below[partition.nodes[i].left]) {
      for (const int right : below[partition.nodes[i].right]) {
        builder.add_pair(i, left, right);
      }
    }
  }
  return builder.take();
}

}  // namespace llmt
