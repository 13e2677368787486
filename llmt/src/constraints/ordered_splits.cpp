#include "constraints/ordered_splits.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include "constraints/ordered_splits_geometry.hpp"
#include "model/hold.hpp"
#include "model/tree.hpp"

namespace llmt {
namespace {

// Parts of a transition whose Bernstein coefficients are taken one by one: the more, the closer to the polynomial.
constexpr int parts = 4;

// Pieces bent less than this, relative to their values, are straight.
constexpr double straight = 1e-12;

// Bernstein coefficients of a polynomial on 0 ... 1, by de Casteljau's rule those on from ... to.
std::vector<double> on_part(std::vector<double> b, double from, double to) {
  const std::size_t degree = b.size() - 1;
  for (std::size_t step = 0; step < degree; ++step) {  // on 0 ... to
    for (std::size_t i = degree; i > step; --i) {
      b[i] = (1.0 - to) * b[i - 1] + to * b[i];
    }
  }
  const double share = from / to;
  for (std::size_t step = 0; step < degree; ++step) {  // its upper part
    for (std::size_t i = 0; i + step < degree; ++i) {
      b[i] = (1.0 - share) * b[i] + share * b[i + 1];
    }
  }
  return b;
}

}  // namespace

OrderedSplits::OrderedSplits(const Partition& partition, const TrainingRows& training, Eigen::Index output) {
  const Geometry geometry(partition, training, output);
  below_.resize(partition.nodes.size());
  children_.resize(partition.nodes.size(), {-1, -1});
  for (std::size_t i = partition.nodes.size(); i-- > 0;) {
    const Node& node = partition.nodes[i];
    if (node.is_leaf()) {
      below_[i] = {static_cast<int>(i)};
      continue;
    }
    children_[i] = {node.left, node.right};
    const std::vector<int>& left = below_[node.left];
    const std::vector<int>& right = below_[node.right];
    below_[i] = left;
    below_[i].insert(below_[i].end(), right.begin(), right.end());
    if (geometry.sign(static_cast<int>(i)) != 0) {
      for (const int l : left) {
        for (const int r : right) {
          add_pair(geometry, static_cast<int>(i), l, r);
        }
      }
    }
  }
}

void OrderedSplits::add_pair(const Geometry& geometry, int split, int left, int right) {
  const Node& node = geometry.node(split);
  const int input = node.split_input;
  if (!geometry.meet(left, right, input)) return;
  const double h = geometry.half_width(split);
  const double from = std::max({node.threshold - h, geometry.low(input, left), geometry.low(input, right)});
  const double to = std::min({node.threshold + h, geometry.high(input, left), geometry.high(input, right)});
  if (h > 0.0 ? !(from < to) : !(from <= to)) return;
  Pair pair{.split = split,
            .left = left,
            .right = right,
            .sign = static_cast<double>(geometry.sign(split)),
            .regressor = geometry.regressor_of(input),
            .inputs = {std::ssize(groups_), 0},
            .coefficients = {std::ssize(coefficients_), 0}};
  std::vector<Coefficient> found = {{0.0, 0.0}};
  if (h > 0.0 && pair.regressor >= 0) {
    // The derivative times h / |g'| is f_r - f_l at the threshold + of_left f_l' + of_right f_r'.
    const double share_left = geometry.share(left, input, from, to);
    const double share_right = geometry.share(right, input, from, to);
    using Bernstein = std::vector<double>;
    const Bernstein slope = {0, 1, 1, 0};    // |g'|
    const Bernstein moment = {0, -1, 1, 0};  // u |g'|
    const Bernstein gate = {1, 1, 0, 0};
    Bernstein of_left;
    Bernstein of_right;
    for (std::size_t i = 0; i < gate.size(); ++i) {
      of_left.push_back(share_left * gate[i] - moment[i]);
      of_right.push_back(share_right * (1.0 - gate[i]) + moment[i]);
    }
    const double first = 0.5 * ((from - node.threshold) / h + 1.0);
    const double last = 0.5 * ((to - node.threshold) / h + 1.0);
    found.clear();
    for (int part = 0; part < parts; ++part) {
      const double begin = std::clamp(first + (last - first) * part / parts, 0.0, 1.0);
      const double end = std::clamp(first + (last - first) * (part + 1) / parts, 0.0, 1.0);
      const Bernstein a = on_part(of_left, begin, end);
      const Bernstein b = on_part(of_right, begin, end);
      const Bernstein c = on_part(slope, begin, end);
      for (std::size_t i = 0; i < c.size(); ++i) {
        if (c[i] > 1e-9) {  // else a and b are shares of slopes alone
          found.push_back({h * a[i] / c[i], h * b[i] / c[i]});
        }
      }
    }
  }
  // Slopes have the sign: of two with no smaller coefficient one is enough.
  for (std::size_t i = 0; i < found.size(); ++i) {
    const bool implied = std::ranges::any_of(found, [&](const Coefficient& other) {
      const std::size_t at = &other - found.data();
      return at != i && other.of_left <= found[i].of_left && other.of_right <= found[i].of_right &&
             (at < i || other.of_left < found[i].of_left || other.of_right < found[i].of_right);
    });
    if (!implied) {
      coefficients_.push_back(found[i]);
    }
  }
  pair.coefficients.count = std::ssize(coefficients_) - pair.coefficients.first;
  for (int other = 0; other < geometry.inputs(); ++other) {
    if (other != input) {
      add_options(geometry, other, left, right);
    }
  }
  if (pair.regressor >= 0) {
    const double deviation = node.threshold - geometry.centre(pair.regressor);
    groups_.push_back({std::ssize(options_), 1});
    if (h > 0.0) {  // both are straight across the transition
      options_.push_back({0.0, std::ssize(terms_), 1});
      terms_.push_back({pair.regressor, deviation, deviation});
    } else {
      add_option(geometry, {pair.regressor}, {deviation}, left, right);
    }
  }
  pair.inputs.count = std::ssize(groups_) - pair.inputs.first;
  pairs_.push_back(pair);
}

void OrderedSplits::add_options(const Geometry& geometry, int input, int left, int right) {
  const std::vector<Eigen::Index>& regressors = geometry.regressors_of(input);
  if (regressors.empty()) return;
  Range group{std::ssize(options_), 0};
  if (geometry.is_categorical(input)) {
    for (int level = 0; level < geometry.levels(input); ++level) {
      if (geometry.reaches(left, input, level) && geometry.reaches(right, input, level)) {
        std::vector<double> deviations;
        for (const Eigen::Index k : regressors) {
          deviations.push_back((geometry.level_of(k) == level ? 1.0 : 0.0) - geometry.centre(k));
        }
        add_option(geometry, regressors, deviations, left, right);
      }
    }
  } else {
    const double centre = geometry.centre(regressors.front());
    const double low = std::max(geometry.low(input, left), geometry.low(input, right)) - centre;
    const double high = std::min(geometry.high(input, left), geometry.high(input, right)) - centre;
    if (low < high) {
      add_pieces(geometry, regressors.front(), low, high, left, right);
    }
  }
  if (geometry.reaches_missing(left, input) && geometry.reaches_missing(right, input)) {
    Option option{0.0, std::ssize(terms_), 0};
    for (const Eigen::Index k : regressors) {
      terms_.push_back({k, geometry.node(left).mean(k), geometry.node(right).mean(k)});
    }
    option.count = std::ssize(terms_) - option.first;
    options_.push_back(option);
  }
  group.count = std::ssize(options_) - group.first;
  groups_.push_back(group);
}

void OrderedSplits::add_option(const Geometry& geometry, const std::vector<Eigen::Index>& regressors,
                               const std::vector<double>& deviations, int left, int right) {
  Option option{0.0, std::ssize(terms_), std::ssize(regressors)};
  for (std::size_t i = 0; i < regressors.size(); ++i) {
    const auto [of_left, rest_left] = geometry.held(left, regressors[i], deviations[i]);
    const auto [of_right, rest_right] = geometry.held(right, regressors[i], deviations[i]);
    option.constant += rest_right - rest_left;
    terms_.push_back({regressors[i], of_left, of_right});
  }
  options_.push_back(option);
}

// f_r - f_l as a function of one regressor is made of parabolas between the ends of ranges and of their roundings: no
// smaller than their Bernstein coefficients, the values at both ends and one between.
void OrderedSplits::add_pieces(const Geometry& geometry, Eigen::Index regressor, double low, double high, int left,
                               int right) {
  std::vector<double> at;
  for (const int leaf : {left, right}) {
    geometry.add_kinks(leaf, regressor, low, high, at);
  }
  for (const double end : {low, high}) {
    if (std::isfinite(end)) {
      at.push_back(end);
    }
  }
  std::ranges::sort(at);
  at.erase(std::unique(at.begin(), at.end()), at.end());
  const auto values = [&](double d) {
    const auto [of_left, rest_left] = geometry.held(left, regressor, d);
    const auto [of_right, rest_right] = geometry.held(right, regressor, d);
    return std::array<double, 3>{rest_right - rest_left, of_left, of_right};
  };
  const auto add = [&](const std::array<double, 3>& value) {
    options_.push_back({value[0], std::ssize(terms_), 1});
    terms_.push_back({regressor, value[1], value[2]});
  };
  std::array<double, 3> before{};
  for (std::size_t i = 0; i < at.size(); ++i) {
    const std::array<double, 3> now = values(at[i]);
    if (i > 0) {
      const std::array<double, 3> middle = values(at[i - 1] + 0.5 * (at[i] - at[i - 1]));
      std::array<double, 3> between{};
      bool bent = false;
      for (std::size_t c = 0; c < 3; ++c) {
        between[c] = 2.0 * middle[c] - 0.5 * (before[c] + now[c]);
        bent = bent ||
               std::abs(middle[c] - 0.5 * (before[c] + now[c])) > straight * (std::abs(before[c]) + std::abs(now[c]));
      }
      if (bent) {
        add(between);
      }
    }
    add(now);
    before = now;
  }
}

OrderedSplits::Worst OrderedSplits::worst(const Pair& pair, const Eigen::MatrixXd& models) const {
  Worst result{.room = pair.sign * (models(0, pair.right) - models(0, pair.left)), .coefficient = {}, .options = {}};
  for (Eigen::Index g = pair.inputs.first; g < pair.inputs.first + pair.inputs.count; ++g) {
    const Range& group = groups_[g];
    double smallest = std::numeric_limits<double>::infinity();
    Eigen::Index chosen = group.first;
    for (Eigen::Index i = group.first; i < group.first + group.count; ++i) {
      const Option& option = options_[i];
      double value = option.constant;
      for (Eigen::Index t = option.first; t < option.first + option.count; ++t) {
        const Term& term = terms_[t];
        value +=
            models(1 + term.regressor, pair.right) * term.right - models(1 + term.regressor, pair.left) * term.left;
      }
      if (pair.sign * value < smallest) {
        smallest = pair.sign * value;
        chosen = i;
      }
    }
    result.room += smallest;
    result.options.push_back(options_[chosen]);
  }
  const double left = pair.regressor < 0 ? 0.0 : pair.sign * models(1 + pair.regressor, pair.left);
  const double right = pair.regressor < 0 ? 0.0 : pair.sign * models(1 + pair.regressor, pair.right);
  double least = std::numeric_limits<double>::infinity();
  for (Eigen::Index i = pair.coefficients.first; i < pair.coefficients.first + pair.coefficients.count; ++i) {
    const Coefficient& each = coefficients_[i];
    const double value = each.of_left * left + each.of_right * right;
    if (value < least) {
      least = value;
      result.coefficient = each;
    }
  }
  result.room += least;
  return result;
}

LeafInequality OrderedSplits::inequality(const Pair& pair, const Worst& worst, Eigen::Index size, double room) const {
  LeafInequality result{pair.left, pair.right, Eigen::VectorXd::Zero(size), Eigen::VectorXd::Zero(size), room};
  result.of_left(0) = -pair.sign;
  result.of_right(0) = pair.sign;
  for (const Option& option : worst.options) {
    result.bound -= pair.sign * option.constant;
    for (Eigen::Index t = option.first; t < option.first + option.count; ++t) {
      const Term& term = terms_[t];
      result.of_left(1 + term.regressor) -= pair.sign * term.left;
      result.of_right(1 + term.regressor) += pair.sign * term.right;
    }
  }
  if (pair.regressor >= 0) {
    result.of_left(1 + pair.regressor) += pair.sign * worst.coefficient.of_left;
    result.of_right(1 + pair.regressor) += pair.sign * worst.coefficient.of_right;
  }
  return result;
}

std::vector<LeafInequality> OrderedSplits::violated(const Eigen::MatrixXd& models, double least, double room) const {
  std::map<std::array<int, 3>, std::pair<double, std::size_t>> worst_of;  // of split, side and leaf
  for (std::size_t p = 0; p < pairs_.size(); ++p) {
    const Pair& pair = pairs_[p];
    const double here = worst(pair, models).room;
    if (!(here < least)) continue;
    for (const auto& key : {std::array<int, 3>{pair.split, 0, pair.left}, {pair.split, 1, pair.right}}) {
      const auto [entry, is_new] = worst_of.try_emplace(key, here, p);
      if (here < entry->second.first) {
        entry->second = {here, p};
      }
    }
  }
  std::set<std::size_t> chosen;
  for (const auto& [key, entry] : worst_of) {
    chosen.insert(entry.second);
  }
  std::vector<LeafInequality> result;
  for (const std::size_t p : chosen) {
    result.push_back(inequality(pairs_[p], worst(pairs_[p], models), models.rows(), room));
  }
  return result;
}

double OrderedSplits::room(const Eigen::MatrixXd& models) const {
  double least = std::numeric_limits<double>::infinity();
  for (const Pair& pair : pairs_) {
    least = std::min(least, worst(pair, models).room);
  }
  return least;
}

void OrderedSplits::separate(Eigen::MatrixXd& models, double room) const {
  for (std::size_t first = 0; first < pairs_.size();) {
    const Pair& pair = pairs_[first];
    double least = std::numeric_limits<double>::infinity();
    std::size_t next = first;
    for (; next < pairs_.size() && pairs_[next].split == pair.split; ++next) {
      least = std::min(least, worst(pairs_[next], models).room);
    }
    if (least < 0.5 * room) {
      const double move = 0.5 * pair.sign * (room - least);
      const auto [left, right] = children_[pair.split];
      for (const int leaf : below_[left]) {
        models(0, leaf) -= move;
      }
      for (const int leaf : below_[right]) {
        models(0, leaf) += move;
      }
    }
    first = next;
  }
}

}  // namespace llmt
