#include "discovery/recording/row_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "discovery/recording/refuse.hpp"
#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

std::vector<Eigen::Index> repeat_numbers(const Inputs& inputs) {
  std::map<std::vector<double>, Eigen::Index> numbers;
  std::vector<Eigen::Index> repeats;
  for (Eigen::Index i = 0; i < inputs.values.rows(); ++i) {
    std::vector<double> setting;
    for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
      if (inputs.names[j] != inputs.order) setting.push_back(inputs.values(i, j));
    }
    // Without inputs beside the order nothing is a repeat.
    if (setting.empty()) setting.push_back(static_cast<double>(i));
    repeats.push_back(numbers.try_emplace(std::move(setting), std::ssize(numbers)).first->second);
  }
  return repeats;
}

// Mean variance within blocks of `length` rows.
double variance_within(const std::vector<Piece>& pieces, const Eigen::VectorXd& values, Eigen::Index length) {
  double sum = 0.0;
  double rows = 0.0;
  for (const Piece& piece : pieces) {
    for (std::size_t begin = 0; begin + length <= piece.size(); begin += length) {
      const Eigen::VectorXd block = values(Piece(piece.begin() + begin, piece.begin() + begin + length));
      sum += (block.array() - block.mean()).square().sum();
      rows += static_cast<double>(length);
    }
  }
  return rows > 0.0 ? sum / rows : std::numeric_limits<double>::infinity();
}

// The longest block that the inputs bear; 1 where most of them are not smooth.
Eigen::Index longest_block(const Recording& recording, Eigen::Index fewest_samples) {
  constexpr double largest_loss = 0.03;
  const Eigen::MatrixXd& values = recording.inputs().values;
  const Eigen::Index n = values.rows();
  std::vector<Signal> signals = recording.signals();
  const auto smooth = std::ranges::count_if(signals, &Signal::is_smooth);
  if (2 * smooth < std::ssize(signals) || signals.empty()) return 1;
  std::erase_if(signals, [](const Signal& signal) { return !signal.is_smooth(); });
  Eigen::Index length = 1;
  const auto bears = [&](Eigen::Index trial) {
    return std::ranges::all_of(signals, [&](const Signal& signal) {
      const double within = variance_within(recording.pieces().rows, values.col(signal.column), trial);
      const double share_of_noise = static_cast<double>(trial - 1) / static_cast<double>(trial);
      return within - share_of_noise * signal.noise <= largest_loss * (signal.variance - signal.noise);
    });
  };
  while (true) {
    const Eigen::Index trial = std::max(length + 1, length + length / 4);
    if (n / trial < fewest_samples || !bears(trial)) break;
    length = trial;
  }
  return length;
}

Eigen::Index block_length(const Recording& recording, const MissingOptions& options, Eigen::Index fewest_samples) {
  const Eigen::Index needed = (recording.inputs().values.rows() + options.largest_sample - 1) / options.largest_sample;
  return std::max(needed, longest_block(recording, fewest_samples));
}

// Consecutive rows of a piece that are searched or set aside together.
struct Segment {
  Piece rows;
  std::size_t piece = 0;
  bool is_held_out = false;
};

std::vector<Segment> segments_of(const Pieces& pieces, Eigen::Index block, const MissingOptions& options) {
  std::vector<Segment> segments;
  std::vector<Eigen::Index> runs = pieces.runs;
  std::ranges::sort(runs);
  runs.erase(std::unique(runs.begin(), runs.end()), runs.end());
  Random random(options.seed);
  constexpr std::size_t fewest_runs = 4;
  if (runs.size() >= fewest_runs) {
    const auto aside = static_cast<std::size_t>(std::lround(options.held_out_share * static_cast<double>(runs.size())));
    std::vector<Eigen::Index> chosen;
    for (const Eigen::Index k : random.permutation(std::ssize(runs))) {
      if (chosen.size() < aside) chosen.push_back(runs[k]);
    }
    for (std::size_t p = 0; p < pieces.rows.size(); ++p) {
      segments.push_back({pieces.rows[p], p, std::ranges::find(chosen, pieces.runs[p]) != chosen.end()});
    }
    return segments;
  }
  Eigen::Index n = 0;
  for (const Piece& piece : pieces.rows) n += std::ssize(piece);
  constexpr Eigen::Index most = 25;
  constexpr Eigen::Index fewest_blocks = 4;  // in a segment
  const Eigen::Index length = std::max({Eigen::Index{1}, (n + most - 1) / most, fewest_blocks * block});
  for (std::size_t p = 0; p < pieces.rows.size(); ++p) {
    const Piece& piece = pieces.rows[p];
    const Eigen::Index parts = std::max<Eigen::Index>(1, std::ssize(piece) / length);
    for (Eigen::Index k = 0; k < parts; ++k) {
      const auto begin = piece.begin() + k * std::ssize(piece) / parts;
      segments.push_back({Piece(begin, piece.begin() + (k + 1) * std::ssize(piece) / parts), p, false});
    }
  }
  const auto aside =
      static_cast<Eigen::Index>(std::lround(options.held_out_share * static_cast<double>(segments.size())));
  const std::vector<Eigen::Index> order = random.permutation(std::ssize(segments));
  for (Eigen::Index k = 0; k < std::min(aside, std::ssize(segments) - 1); ++k) segments[order[k]].is_held_out = true;
  return segments;
}

}  // namespace

AlongRows along_rows(const Inputs& inputs, const MissingOptions& options) {
  Piece all(inputs.values.rows());
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  const std::vector<Signal> signals = signals_of({all}, inputs.values);
  const auto smooth = std::ranges::count_if(signals, &Signal::is_smooth);
  if (signals.empty() || 2 * smooth < std::ssize(signals)) return AlongRows::independent;
  // Settings that somebody chose have no noise; third differences of a signal of 30 rows a period are 1e-5 of it.
  constexpr double visible = 1e-5;
  const auto is_noisy = [](const Signal& signal) {
    return signal.is_smooth() && signal.noise > visible * signal.variance;
  };
  const bool is_log = std::ranges::any_of(signals, is_noisy) || std::ssize(all) > options.largest_sample;
  return is_log ? AlongRows::measured_signal : AlongRows::smooth;
}

RowSplit split_independent(const Inputs& inputs, const MissingOptions& options) {
  const std::vector<Eigen::Index> numbers = repeat_numbers(inputs);
  const Eigen::Index groups = numbers.empty() ? 0 : *std::ranges::max_element(numbers) + 1;
  Random random(options.seed);
  const std::vector<Eigen::Index> order = random.permutation(groups);
  std::vector<Eigen::Index> place(order.size());
  for (std::size_t k = 0; k < order.size(); ++k) place[order[k]] = k;
  const auto aside = static_cast<Eigen::Index>(std::lround(options.held_out_share * static_cast<double>(groups)));
  // At most about `largest_sample` rows are searched, in whole groups of repeats.
  const double rows_of_a_group =
      static_cast<double>(numbers.size()) / static_cast<double>(std::max<Eigen::Index>(1, groups));
  const auto last = aside + static_cast<Eigen::Index>(static_cast<double>(options.largest_sample) / rows_of_a_group);
  RowSplit split;
  for (Eigen::Index i = 0; i < std::ssize(numbers); ++i) {
    const Eigen::Index p = place[numbers[i]];
    if (p < aside) {
      split.held_out.add(std::span(&i, 1));
    } else if (p < last) {
      split.searched.add(std::span(&i, 1));
      split.repeats.push_back(numbers[i]);
    }
  }
  return split;
}

Eigen::Index bearable_block(const Recording& recording, const MissingOptions& options) {
  return longest_block(recording, options.largest_sample);
}

Samples blocks_in_time(const Recording& recording, Eigen::Index length) {
  Samples blocks;
  for (const Piece& piece : recording.pieces().rows) {
    const Eigen::Index n = std::ssize(piece);
    const Eigen::Index count = std::max<Eigen::Index>(1, n / length);
    for (Eigen::Index b = 0; b < count; ++b) {
      const Eigen::Index begin = b * n / count;
      blocks.add(std::span(piece).subspan(begin, (b + 1) * n / count - begin));
    }
  }
  return blocks;
}

namespace {

// Samples as far apart as their noise is independent, each with what is computed around it.
RowSplit split_filtered(const Recording& recording, const MissingOptions& options) {
  const RowFilter& filter = recording.filter();
  const Inputs& inputs = recording.inputs();
  Pieces pieces{.rows = filter.pieces(), .runs = {}, .step = recording.pieces().step};
  std::vector<std::pair<std::size_t, Eigen::Index>> places(inputs.values.rows());  // piece, place in it
  for (std::size_t p = 0; p < filter.pieces().size(); ++p) {
    const Piece& piece = filter.pieces()[p];
    pieces.runs.push_back(inputs.runs.empty() ? Eigen::Index{0} : inputs.runs[piece.front()]);
    for (Eigen::Index k = 0; k < std::ssize(piece); ++k) places[piece[k]] = {p, k};
  }
  RowSplit split;
  split.reach = filter.weights();
  Eigen::VectorXd weights = filter.weights();
  if (recording.is_filtered()) {
    split.searched.set_crossings(filter.crossings());
    split.held_out.set_crossings(filter.crossings());
  } else {
    weights = Eigen::VectorXd::Unit(weights.size(), weights.size() / 2);
  }
  split.step = filter.step() * static_cast<double>(filter.stride());
  const Eigen::Index half = filter.weights().size() / 2;
  Eigen::Index stretch = -1;
  const Segment* before = nullptr;
  const std::vector<Segment> segments = segments_of(pieces, filter.stride(), options);
  for (const Segment& segment : segments) {
    const bool goes_on = before != nullptr && before->piece == segment.piece && !before->is_held_out;
    if (!segment.is_held_out && !goes_on) ++stretch;
    for (const Eigen::Index row : segment.rows) {
      const auto [p, k] = places[row];
      const Piece& piece = filter.pieces()[p];
      if (k % filter.stride() != 0 || k < half || k + half >= std::ssize(piece)) continue;
      const auto around = std::span(piece).subspan(k - half, filter.weights().size());
      (segment.is_held_out ? split.held_out : split.searched).add(row, around, weights);
      if (!segment.is_held_out) split.stretches.push_back(stretch);
    }
    before = &segment;
  }
  if (split.searched.size() + split.held_out.size() == 0) {
    refuse(
        "find_missing",
        fmt::format("no stretch of rows at even steps of {:.4g} is longer than the filter, which reaches over {:.4g}: "
                    "rows between were left out, or the record is too short",
                    filter.step(), filter.step() * static_cast<double>(filter.weights().size())));
  }
  return split;
}

}  // namespace

RowSplit split_in_time(const Recording& recording, const MissingOptions& options, Eigen::Index fewest_samples) {
  if (recording.is_filtered()) return split_filtered(recording, options);
  RowSplit split;
  split.step = recording.pieces().step;
  split.rows_per_sample = block_length(recording, options, fewest_samples);
  Eigen::Index stretch = -1;
  const Segment* before = nullptr;
  const std::vector<Segment> segments = segments_of(recording.pieces(), split.rows_per_sample, options);
  for (const Segment& segment : segments) {
    const bool goes_on = before != nullptr && before->piece == segment.piece && !before->is_held_out;
    if (!segment.is_held_out && !goes_on) ++stretch;
    const Eigen::Index n = std::ssize(segment.rows);
    const Eigen::Index blocks = std::max<Eigen::Index>(1, n / split.rows_per_sample);
    for (Eigen::Index b = 0; b < blocks; ++b) {
      const Eigen::Index begin = b * n / blocks;
      const auto rows = std::span(segment.rows).subspan(begin, (b + 1) * n / blocks - begin);
      (segment.is_held_out ? split.held_out : split.searched).add(rows);
      if (!segment.is_held_out) split.stretches.push_back(stretch);
    }
    before = &segment;
  }
  return split;
}

namespace {

void keep(const Samples& from, const Eigen::VectorXd& reach, const std::vector<bool>& apart, Samples& to,
          std::vector<bool>& kept) {
  for (Eigen::Index i = 0; i < from.size(); ++i) {
    if (from.is_filtered()) {
      // Next to nothing of what is set apart may be in what is computed.
      constexpr double negligible = 0.02;
      double share = 0.0;
      for (Eigen::Index k = 0; k < reach.size(); ++k) {
        if (apart[from.around(i)[k]]) share += std::abs(reach(k));
      }
      kept.push_back(!apart[from.rows_of(i).front()] && share <= negligible);
      if (kept.back()) to.add(from, i);
      continue;
    }
    const std::span<const Eigen::Index> all = from.rows_of(i);
    std::vector<Eigen::Index> left;
    std::ranges::copy_if(all, std::back_inserter(left), [&](Eigen::Index row) { return !apart[row]; });
    kept.push_back(2 * left.size() >= all.size() && !left.empty());
    if (kept.back()) to.add(left);
  }
}

}  // namespace

RowSplit without_rows(const RowSplit& split, const std::vector<bool>& apart) {
  RowSplit result = split;
  result.searched = {};
  result.held_out = {};
  result.repeats.clear();
  result.stretches.clear();
  std::vector<bool> kept;
  keep(split.searched, split.reach, apart, result.searched, kept);
  for (std::size_t i = 0; i < kept.size(); ++i) {
    if (!kept[i]) continue;
    if (!split.repeats.empty()) result.repeats.push_back(split.repeats[i]);
    if (!split.stretches.empty()) result.stretches.push_back(split.stretches[i]);
  }
  keep(split.held_out, split.reach, apart, result.held_out, kept);
  return result;
}

}  // namespace llmt::discovery
