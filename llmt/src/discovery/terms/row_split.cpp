#include "discovery/terms/row_split.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <numeric>

#include "discovery/terms/refuse.hpp"
#include "discovery/terms/row_filter.hpp"
#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

// A signal whose noise is a larger share of its variance is not smooth: its neighbours say nothing of it.
constexpr double largest_noise_share = 0.4;

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

// Rows in the order of time.
using Piece = std::vector<Eigen::Index>;

// Runs, cut where the recording was interrupted.
struct Recording {
  std::vector<Piece> pieces;
  std::vector<Eigen::Index> runs;  // of every piece
  double step = 0.0;
};

Recording recording_of(const Inputs& inputs) {
  const Eigen::Index n = inputs.values.rows();
  const Eigen::VectorXd& instants = inputs.instants;
  const auto run = [&](Eigen::Index i) { return inputs.runs.empty() ? Eigen::Index{0} : inputs.runs[i]; };
  Piece order(n);
  std::iota(order.begin(), order.end(), Eigen::Index{0});
  std::ranges::stable_sort(order, {}, [&](Eigen::Index i) { return std::pair(run(i), instants(i)); });
  std::vector<double> steps;
  for (Eigen::Index k = 1; k < n; ++k) {
    if (run(order[k]) != run(order[k - 1])) continue;
    const double step = instants(order[k]) - instants(order[k - 1]);
    if (!(step > 0.0)) {
      refuse("find_missing", fmt::format("rows {} and {} were taken at the same time, {}", order[k - 1] + 1,
                                         order[k] + 1, instants(order[k])));
    }
    steps.push_back(step);
  }
  Recording recording;
  if (steps.empty()) refuse("find_missing", "no run has two rows");
  std::ranges::nth_element(steps, steps.begin() + std::ssize(steps) / 2);
  recording.step = steps[steps.size() / 2];
  constexpr double interruption = 3.0;  // steps
  for (Eigen::Index k = 0; k < n; ++k) {
    const bool goes_on = k > 0 && run(order[k]) == run(order[k - 1]) &&
                         instants(order[k]) - instants(order[k - 1]) <= interruption * recording.step;
    if (!goes_on) {
      recording.pieces.emplace_back();
      recording.runs.push_back(run(order[k]));
    }
    recording.pieces.back().push_back(order[k]);
  }
  return recording;
}

double variance_of(const Eigen::VectorXd& values) {
  return values.size() < 2 ? 0.0 : (values.array() - values.mean()).square().mean();
}

// Mean over the pieces, weighted by rows; NaN where no piece is long enough.
double noise_variance_in(const std::vector<Piece>& pieces, const Eigen::VectorXd& values) {
  double sum = 0.0;
  double weight = 0.0;
  for (const Piece& piece : pieces) {
    const double own = noise_variance(values(piece));
    if (std::isnan(own)) continue;
    sum += own * static_cast<double>(piece.size());
    weight += static_cast<double>(piece.size());
  }
  return weight > 0.0 ? sum / weight : std::numeric_limits<double>::quiet_NaN();
}

// The variance of a signal and of its noise.
struct Smoothness {
  Eigen::Index column = 0;
  double variance = 0.0;
  double noise = 0.0;

  bool is_smooth() const { return noise <= largest_noise_share * variance; }
};

std::vector<Smoothness> smoothness_of(const std::vector<Piece>& pieces, const Inputs& inputs) {
  std::vector<Smoothness> all;
  for (Eigen::Index j = 0; j < inputs.values.cols(); ++j) {
    const Eigen::VectorXd values = inputs.values.col(j);
    const Smoothness own{j, variance_of(values), noise_variance_in(pieces, values)};
    if (own.variance > 0.0 && !std::isnan(own.noise)) all.push_back(own);
  }
  return all;
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
Eigen::Index longest_block(const std::vector<Piece>& pieces, const Inputs& inputs, Eigen::Index fewest_samples) {
  constexpr double largest_loss = 0.03;
  const auto n = static_cast<Eigen::Index>(inputs.values.rows());
  std::vector<Smoothness> signals = smoothness_of(pieces, inputs);
  const auto smooth = std::ranges::count_if(signals, &Smoothness::is_smooth);
  if (2 * smooth < std::ssize(signals) || signals.empty()) return 1;
  std::erase_if(signals, [](const Smoothness& signal) { return !signal.is_smooth(); });
  Eigen::Index length = 1;
  const auto bears = [&](Eigen::Index trial) {
    return std::ranges::all_of(signals, [&](const Smoothness& signal) {
      const double within = variance_within(pieces, inputs.values.col(signal.column), trial);
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

Eigen::Index block_length(const std::vector<Piece>& pieces, const Inputs& inputs, const MissingOptions& options,
                          Eigen::Index fewest_samples) {
  const Eigen::Index needed = (inputs.values.rows() + options.largest_sample - 1) / options.largest_sample;
  return std::max(needed, longest_block(pieces, inputs, fewest_samples));
}

// Consecutive rows of a piece that are searched or set aside together.
struct Segment {
  Piece rows;
  std::size_t piece = 0;
  bool is_held_out = false;
};

std::vector<Segment> segments_of(const Recording& recording, Eigen::Index block, const MissingOptions& options) {
  std::vector<Segment> segments;
  std::vector<Eigen::Index> runs = recording.runs;
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
    for (std::size_t p = 0; p < recording.pieces.size(); ++p) {
      segments.push_back({recording.pieces[p], p, std::ranges::find(chosen, recording.runs[p]) != chosen.end()});
    }
    return segments;
  }
  Eigen::Index n = 0;
  for (const Piece& piece : recording.pieces) n += std::ssize(piece);
  constexpr Eigen::Index most = 25;
  constexpr Eigen::Index fewest_blocks = 4;  // in a segment
  const Eigen::Index length = std::max({Eigen::Index{1}, (n + most - 1) / most, fewest_blocks * block});
  for (std::size_t p = 0; p < recording.pieces.size(); ++p) {
    const Piece& piece = recording.pieces[p];
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

double noise_variance(const Eigen::VectorXd& values) {
  const Eigen::Index n = values.size();
  if (n < 4) return std::numeric_limits<double>::quiet_NaN();
  const Eigen::ArrayXd third = values.tail(n - 3).array() - 3.0 * values.segment(2, n - 3).array() +
                               3.0 * values.segment(1, n - 3).array() - values.head(n - 3).array();
  return third.square().mean() / 20.0;
}

bool is_smooth_in_time(const Inputs& inputs, Eigen::Index column) {
  const Eigen::VectorXd values = inputs.values.col(column);
  const Smoothness own{column, variance_of(values), noise_variance_in(recording_of(inputs).pieces, values)};
  return own.variance > 0.0 && own.is_smooth();
}

AlongRows along_rows(const Inputs& inputs, const MissingOptions& options) {
  Piece all(inputs.values.rows());
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  const std::vector<Smoothness> signals = smoothness_of({all}, inputs);
  const auto smooth = std::ranges::count_if(signals, &Smoothness::is_smooth);
  if (signals.empty() || 2 * smooth < std::ssize(signals)) return AlongRows::independent;
  // Settings that somebody chose have no noise; third differences of a signal of 30 rows a period are 1e-5 of it.
  constexpr double visible = 1e-5;
  const auto is_noisy = [](const Smoothness& signal) {
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

Eigen::Index bearable_block(const Inputs& inputs, const MissingOptions& options) {
  return longest_block(recording_of(inputs).pieces, inputs, options.largest_sample);
}

Samples blocks_in_time(const Inputs& inputs, Eigen::Index length) {
  Samples blocks;
  for (const Piece& piece : recording_of(inputs).pieces) {
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
RowSplit split_filtered(const Inputs& inputs, const MissingOptions& options) {
  const RowFilter filter(inputs);
  Recording recording = recording_of(inputs);
  std::vector<std::pair<std::size_t, Eigen::Index>> places(inputs.values.rows());  // piece, place in it
  recording.runs.clear();
  for (std::size_t p = 0; p < filter.pieces().size(); ++p) {
    const Piece& piece = filter.pieces()[p];
    recording.runs.push_back(inputs.runs.empty() ? Eigen::Index{0} : inputs.runs[piece.front()]);
    for (Eigen::Index k = 0; k < std::ssize(piece); ++k) places[piece[k]] = {p, k};
  }
  recording.pieces = filter.pieces();
  RowSplit split;
  split.searched.set_crossings(filter.crossings());
  split.held_out.set_crossings(filter.crossings());
  split.step = filter.step() * static_cast<double>(filter.stride());
  const Eigen::Index half = filter.weights().size() / 2;
  Eigen::Index stretch = -1;
  const Segment* before = nullptr;
  const std::vector<Segment> segments = segments_of(recording, filter.stride(), options);
  for (const Segment& segment : segments) {
    const bool goes_on = before != nullptr && before->piece == segment.piece && !before->is_held_out;
    if (!segment.is_held_out && !goes_on) ++stretch;
    for (const Eigen::Index row : segment.rows) {
      const auto [p, k] = places[row];
      const Piece& piece = filter.pieces()[p];
      if (k % filter.stride() != 0 || k < half || k + half >= std::ssize(piece)) continue;
      const auto around = std::span(piece).subspan(k - half, filter.weights().size());
      (segment.is_held_out ? split.held_out : split.searched).add(row, around, filter.weights());
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

RowSplit split_in_time(const Inputs& inputs, const MissingOptions& options, Eigen::Index fewest_samples) {
  if (inputs.cutoff > 0.0) return split_filtered(inputs, options);
  const Recording recording = recording_of(inputs);
  RowSplit split;
  split.step = recording.step;
  split.rows_per_sample = block_length(recording.pieces, inputs, options, fewest_samples);
  Eigen::Index stretch = -1;
  const Segment* before = nullptr;
  const std::vector<Segment> segments = segments_of(recording, split.rows_per_sample, options);
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

}  // namespace llmt::discovery
