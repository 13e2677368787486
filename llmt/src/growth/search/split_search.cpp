#include "growth/search/split_search.hpp"

#include <algorithm>
#include <cstdlib>

#include "growth/search/rank_without.hpp"

namespace llmt {
namespace {

constexpr double no_split = std::numeric_limits<double>::infinity();

// A block has at least this many rows, and more where there would be more than `most_blocks` blocks.
constexpr Eigen::Index smallest_block = 64;
constexpr Eigen::Index most_blocks = 400;

// Rows of the parts that a block is cut into. The bound of a part does not count the part's own rows. On pure noise a
// part is passed over if it holds fewer rows than the best split gains beyond a random one, in units of the noise
// variance; that is about twenty.
constexpr Eigen::Index part_rows = 12;
constexpr Eigen::Index most_parts = 33;

// Up to this many rows all splits of a block are compared.
constexpr Eigen::Index few_rows = 16;

// The sums of all blocks and parts take at most this many doubles (64 MiB). If Gram matrices are large there are fewer
// blocks and parts, but never fewer than the second number.
constexpr Eigen::Index most_sums = Eigen::Index{1} << 23;
constexpr Eigen::Index fewest_pieces = 4;

// Every piece has a sum of its own, one of all rows to its left, and one of all to its right.
constexpr Eigen::Index sums_of_piece = 3;

Eigen::Index most_pieces(const GramShape& shape, Eigen::Index most) {
  return std::min(most, std::max(fewest_pieces, most_sums / (sums_of_piece * shape.size())));
}

Eigen::Index rows_of_block(const GramShape& shape, Eigen::Index rows) {
  const Eigen::Index most = most_pieces(shape, most_blocks);
  return std::max(smallest_block, (rows + most - 1) / most);
}

}  // namespace

InputSearch::InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
                         Eigen::Index min_leaf_samples)
    : node_(node),
      values_(std::move(values)),
      order_(order),
      min_leaf_samples_(min_leaf_samples),
      rows_at_the_ends_(std::min(std::max(min_leaf_samples, node.scale().enough_rows()), std::ssize(order))),
      shape_(node.features),
      sums_(shape_, node.weights),
      scale_(node.scale()),
      limit_(no_split),
      smallest_(no_split),
      none_(shape_.size(), 0.0),
      all_{0, std::ssize(order), none_.data(), none_.data(), 0.0, 0.0, 0, 0} {
  for (Eigen::Index left = 1; left < std::ssize(order); ++left) {
    tested_ += admissible(left) ? 1 : 0;
  }
}

InputSearch::InputSearch(const SearchNode& node, std::vector<double> values, std::span<const int> order,
                         Eigen::Index min_leaf_samples, const Beyond& front, const Beyond& behind)
    : InputSearch(node, std::move(values), order, min_leaf_samples) {
  rows_in_front_ = front.rows;
  rows_behind_ = behind.rows;
  all_ = {0, std::ssize(order), front.gram, behind.gram, front.rss, behind.rss, front.rank, behind.rank};
}

// A split is given by the number of rows of the stretch on its left.
bool InputSearch::admissible(Eigen::Index left) const {
  return left > 0 && left < std::ssize(order_) && rows_in_front_ + left >= min_leaf_samples_ &&
         std::ssize(order_) - left + rows_behind_ >= min_leaf_samples_ && values_[left - 1] < values_[left];
}

bool InputSearch::holds_candidates(const Segment& segment) const {
  const Eigen::Index first = std::max(segment.begin + 1, min_leaf_samples_ - rows_in_front_);
  const Eigen::Index last = std::min(segment.end - 1, std::ssize(order_) + rows_behind_ - min_leaf_samples_);
  return first <= last && values_[first - 1] < values_[last];
}

Eigen::Index InputSearch::size_of_sums(const GramShape& shape, Eigen::Index rows) {
  return sums_of_piece * shape.size() * (rows / rows_of_block(shape, rows) + 1);
}

// Gram matrices between the edges, and on either side of the inner edges.
void InputSearch::sum_sides(const std::vector<Eigen::Index>& edges, const double* before, const double* behind,
                            Sides& sides) const {
  const std::size_t size = shape_.size();
  std::vector<const double*> parts(edges.size() - 1);
  sides.parts.assign(parts.size() * size, 0.0);
  for (std::size_t i = 0; i < parts.size(); ++i) {
    const Eigen::Index begin = edges[i];
    add_rows(node_.features, order_.data() + begin, edges[i + 1] - begin, sides.parts.data() + i * size);
    parts[i] = sides.parts.data() + i * size;
  }
  sides.sum(shape_, parts, before, behind);
}

// As above, and the RSS on either side.
void InputSearch::take_sides(const std::vector<Eigen::Index>& edges, const double* before, const double* behind,
                             Sides& sides) {
  sum_sides(edges, before, behind, sides);
  sides.evaluate(sums_);
  for (std::vector<int>* ranks : {&sides.rank_left, &sides.rank_right}) {
    std::ranges::transform(*ranks, ranks->begin(), [&](int rank) { return scale_.of_child(rank); });
  }
  evaluations_ += std::ssize(sides.rss_left);
}

// Whether the two rows next to a split at the inner edge `at` decide a direction of a child's model: without them the
// child would have a smaller rank, although it has rows enough.
bool InputSearch::rests_on_two_rows(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides,
                                    Eigen::Index at) {
  constexpr Eigen::Index two = 2;
  const Eigen::Index left = edges[at + 1];
  const Eigen::Index right = std::ssize(order_) - left;
  // The rank of a part of the side without the two rows, if it is known from another edge. If it is that of the side,
  // nothing has to be computed.
  const auto known = [&](Eigen::Index step, const std::vector<int>& ranks, Eigen::Index outer, int of_outer) {
    const auto is_inner = [&](Eigen::Index edge) { return edge >= 0 && edge < std::ssize(ranks); };
    Eigen::Index edge = at + step;
    while (is_inner(edge) && std::abs(edges[edge + 1] - left) < two) edge += step;
    if (is_inner(edge)) return ranks[edge];
    return std::abs(outer - left) < two ? 0 : of_outer;
  };
  const auto rests = [&](int rank_of_part, int rank, Eigen::Index rows, const double* gram,
                         std::span<const int> next_to) {
    return rank_of_part < rank && rows >= scale_.enough_rows() &&
           rank_without(node_.features, gram, next_to, sums_) < rank;
  };
  const Eigen::Index first = std::max(segment.begin, rows_in_front_ > 0 ? 0 : rows_at_the_ends_);
  const Eigen::Index last = std::min(segment.end, std::ssize(order_) - (rows_behind_ > 0 ? 0 : rows_at_the_ends_));
  const Eigen::Index from_left = std::min(two, left);
  return rests(known(-1, sides.rank_left, first, segment.rank_left), sides.rank_left[at], rows_in_front_ + left,
               sides.left.data() + at * shape_.size(), order_.subspan(left - from_left, from_left)) ||
         rests(known(1, sides.rank_right, last, segment.rank_right), sides.rank_right[at], right + rows_behind_,
               sides.right.data() + at * shape_.size(), order_.subspan(left, std::min(two, right)));
}

void InputSearch::offer(const Segment& segment, const std::vector<Eigen::Index>& edges, const Sides& sides) {
  const double tolerance = tie_tolerance * node_.rss;
  for (std::size_t i = 0; i + 2 < edges.size(); ++i) {
    const Eigen::Index left = rows_in_front_ + edges[i + 1];
    const Eigen::Index right = std::ssize(order_) + rows_behind_ - edges[i + 1];
    const int ranks = scale_.counted(sides.rank_left[i], left) + scale_.counted(sides.rank_right[i], right);
    const double rss = sides.rss_left[i] + sides.rss_right[i];
    const double adjusted = scale_.of(rss, ranks);
    if (!(adjusted <= smallest_ + tolerance && admissible(edges[i + 1]))) continue;
    if (rests_on_two_rows(segment, edges, sides, static_cast<Eigen::Index>(i))) continue;
    smallest_ = std::min(smallest_, adjusted);
    found_.push_back({edges[i + 1], rss, adjusted, sides.rank_left[i], sides.rank_right[i]});
  }
}

std::vector<InputSearch::Segment> InputSearch::cut(const Segment& segment, const std::vector<Eigen::Index>& edges,
                                                   const Sides& sides) const {
  const std::size_t inner = edges.size() - 2;
  const auto at = [&](const std::vector<double>& sums, std::size_t i) {
    return sums.empty() ? nullptr : sums.data() + i * shape_.size();
  };
  std::vector<Segment> result;
  for (std::size_t i = 0; i <= inner; ++i) {
    result.push_back(
        {edges[i], edges[i + 1], i == 0 ? segment.left : at(sides.left, i - 1),
         i == inner ? segment.right : at(sides.right, i), i == 0 ? segment.rss_left : sides.rss_left[i - 1],
         i == inner ? segment.rss_right : sides.rss_right[i], i == 0 ? segment.rank_left : sides.rank_left[i - 1],
         i == inner ? segment.rank_right : sides.rank_right[i]});
  }
  std::ranges::stable_sort(result, [](const Segment& a, const Segment& b) { return a.bound() < b.bound(); });
  return result;
}

void InputSearch::search_edges() {
  const Eigen::Index rows = std::ssize(order_);
  if (tested_ == 0) return;
  const Eigen::Index block = rows_of_block(shape_, rows);
  for (Eigen::Index begin = 0; begin < rows; begin += block) {
    edges_.push_back(begin);
  }
  edges_.push_back(rows);
  take_ranks_at_the_ends();
  take_sides(edges_, none_.data(), none_.data(), sides_);
  if (rows < node_.features.rows()) {
    // The rows without a value add the same RSS to every split: the node's RSS minus the RSS of one model of the
    // others.
    std::vector<double> all = none_;
    for (Eigen::Index i = 0; i + 1 < std::ssize(edges_); ++i) {
      add(shape_, sides_.parts.data() + i * shape_.size(), all.data());
    }
    const double* gram = all.data();
    double rss = 0.0;
    int rank = 0;
    sums_.evaluate(&gram, 1, &rss, &rank);
    without_value_ = node_.rss - rss;
    for (double& left : sides_.rss_left) {
      left += without_value_;
    }
  }
  offer(all_, edges_, sides_);
}

void InputSearch::forget_sums() {
  for (std::vector<double>* sums : {&sides_.parts, &sides_.left, &sides_.right, &none_}) {
    std::vector<double>().swap(*sums);
  }
  sums_.forget();
  forgotten_ = true;
}

// At either end of the input, where there are no rows beyond: the rank of the fewest rows of a child whose rank counts.
void InputSearch::take_ranks_at_the_ends() {
  const auto rank_of = [&](Eigen::Index begin) {
    std::vector<double> gram(shape_.size(), 0.0);
    add_rows(node_.features, order_.data() + begin, rows_at_the_ends_, gram.data());
    return scale_.of_child(rank_without(node_.features, gram.data(), {}, sums_));
  };
  if (rows_in_front_ == 0) all_.rank_left = rank_of(0);
  if (rows_behind_ == 0) all_.rank_right = rank_of(std::ssize(order_) - rows_at_the_ends_);
}

// Twice the tolerance: a split within the tolerance of the best one counts as equal to it.
bool InputSearch::may_hold_the_best(const Segment& segment) const {
  const double bound = scale_.of(segment.bound(), segment.rank_left + segment.rank_right);
  return bound <= std::min(limit_, smallest_) + 2.0 * tie_tolerance * node_.rss && holds_candidates(segment);
}

void InputSearch::refine(double limit) {
  limit_ = limit;
  if (edges_.empty()) {
    if (!forgotten_) {
      take_ranks_at_the_ends();
      look_into(all_, 0);
    }
    return;
  }
  all_.rss_left = without_value_;
  if (forgotten_) {
    const auto is_promising = [&](const Segment& segment) { return may_hold_the_best(segment); };
    if (std::ranges::none_of(cut(all_, edges_, sides_), is_promising)) return;
    none_.assign(shape_.size(), 0.0);
    all_.left = all_.right = none_.data();
    sum_sides(edges_, none_.data(), none_.data(), sides_);
  }
  for (const Segment& segment : cut(all_, edges_, sides_)) {
    look_into(segment, 0);
  }
}

void InputSearch::look_into(const Segment& segment, std::size_t depth) {
  if (!may_hold_the_best(segment)) return;
  if (deeper_.size() <= depth) {
    deeper_.resize(depth + 1);
  }
  const Eigen::Index length = segment.end - segment.begin;
  std::vector<Eigen::Index> edges{segment.begin};
  const bool all = length <= few_rows;
  const Eigen::Index parts = std::min(most_pieces(shape_, most_parts), length / part_rows + 1);
  for (Eigen::Index i = 1; i < (all ? length : parts); ++i) {
    const Eigen::Index edge = segment.begin + (all ? i : i * length / parts);
    if (!all || admissible(edge)) {
      edges.push_back(edge);
    }
  }
  edges.push_back(segment.end);
  Sides sides = std::move(deeper_[depth]);
  take_sides(edges, segment.left, segment.right, sides);
  for (double& left : sides.rss_left) {
    left += without_value_;
  }
  offer(segment, edges, sides);
  if (!all) {
    for (const Segment& part : cut(segment, edges, sides)) {
      look_into(part, depth + 1);
    }
  }
  deeper_[depth] = std::move(sides);
}

SplitCandidate InputSearch::best() const {
  SplitCandidate best;
  best.tested = tested_;
  best.evaluations = evaluations_;
  const double largest = smallest_ + tie_tolerance * node_.rss;
  for (const Found& found : found_) {
    if (found.adjusted <= largest && (best.input < 0 || found.left < best.left)) {
      best.input = 0;
      best.left = found.left;
      best.rss = std::max(0.0, found.rss);
      best.adjusted = std::max(0.0, found.adjusted);
      best.rank_left = found.rank_left;
      best.rank_right = found.rank_right;
    }
  }
  best.left += best.input >= 0 ? rows_in_front_ : 0;
  return best;
}

SplitCandidate first_of_best(std::span<const SplitCandidate> found, double rss) {
  SplitCandidate best;
  double smallest = std::numeric_limits<double>::infinity();
  Eigen::Index tested = 0;
  Eigen::Index evaluations = 0;
  for (const SplitCandidate& candidate : found) {
    tested += candidate.tested;
    evaluations += candidate.evaluations;
    smallest = candidate.input >= 0 ? std::min(smallest, candidate.adjusted) : smallest;
  }
  for (int j = 0; j < std::ssize(found) && best.input < 0; ++j) {
    if (found[j].input >= 0 && found[j].adjusted <= smallest + tie_tolerance * rss) {
      best = found[j];
      best.input = j;
    }
  }
  best.tested = tested;
  best.evaluations = evaluations;
  return best;
}

}  // namespace llmt
