// Sums as values: bytes, and sums of sums.
#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <iterator>
#include <stdexcept>

#include "distributed/block_sums.hpp"

namespace llmt::distributed {
namespace {

void require_of_sums(bool holds, const char* what) {
  if (!holds) throw std::runtime_error(std::string(what) + " does not go with the rest");
}

void check_block_sum(const SumsData& data, const BlockSum& sum) {
  const Eigen::Index columns = data.inputs + 1;  // inputs and output
  const bool describes = data.step == Step::describe;
  const Description& description = sum.description;
  const auto has = [](const auto& list, Eigen::Index size) { return std::ssize(list) == size; };
  require_of_sums(has(description.range, describes ? columns : 0) && has(description.total, describes ? columns : 0) &&
                      has(description.missing, describes ? data.inputs : 0) && description.rows >= 0 &&
                      has(description.sample.values, std::ssize(description.sample.hashes) * data.columns) &&
                      std::ssize(description.sample.hashes) <= description.sample.most &&
                      std::ranges::is_sorted(description.sample.hashes),
                  "the description of the columns");
  require_of_sums(sum.nodes.empty() || data.step == Step::grow, "a node");
  require_of_sums(sum.branches.empty() || data.step == Step::gather, "a branch");
  const JointSums& joint = sum.joint;
  const bool joins = data.step == Step::blend;
  const Eigen::Index side = joins ? data.unknowns + 1 : 0;
  require_of_sums(joint.gram.rows() == side && joint.gram.cols() == side &&
                      std::ssize(joint.leaf_rows) == std::ssize(joint.leaf_squares) &&
                      std::ssize(joint.leaf_rows) <= data.unknowns,
                  "the equations of a tree");
  const Eigen::Index size = GramShape(data.regressors + 1, 1).size();
  for (const auto& [at, node] : sum.nodes) {
    require_of_sums(has(node.grams, data.bins * size) && has(node.counts, data.bins) && has(node.held_out, size) &&
                        has(node.range, data.regressors) &&
                        std::ranges::all_of(node.counts, [](Eigen::Index count) { return count >= 0; }),
                    "the sums of a node");
  }
  for (const auto& [at, branch] : sum.branches) {
    for (const std::vector<double>& piece : branch.pieces) {
      require_of_sums(std::ssize(piece) % data.columns == 0, "the rows of a branch");
    }
  }
}

}  // namespace

void check_sums(const SumsData& data) {
  if (data.runs.empty()) return;  // of no rows; what they would go with does not matter
  constexpr Eigen::Index most_inputs = 1 << 20;
  require_of_sums(data.step >= Step::describe && data.step < Step::finished && data.inputs >= 0 &&
                      data.inputs < most_inputs && data.regressors >= 0 && data.regressors <= data.inputs &&
                      data.columns > data.inputs && data.columns <= data.inputs + 2 && data.bins >= 0 &&
                      data.bins <= 256 * data.inputs && data.unknowns >= 0 && data.unknowns <= most_unknowns,
                  "the number of inputs or bins");
  Eigen::Index behind = -1;
  for (const Run& run : data.runs) {
    require_of_sums(run.first > behind && run.last > run.first, "a block");
    behind = run.last;
    Eigen::Index next = run.first;
    for (const auto& part : std::get<0>(BlockSums<BlockSum>::fields(run.sums))) {
      require_of_sums(part.first == next && part.blocks > 0 && part.blocks <= run.last - next &&
                          std::has_single_bit(static_cast<std::uint64_t>(part.blocks)) && part.first % part.blocks == 0,
                      "a block");
      next += part.blocks;
      check_block_sum(data, part.sum);
    }
    require_of_sums(next == run.last, "a block");
  }
}

Sums::Sums() = default;
Sums::Sums(Sums&&) noexcept = default;
Sums& Sums::operator=(Sums&&) noexcept = default;
Sums::~Sums() = default;
Sums::Sums(std::unique_ptr<SumsData> data) : data_(std::move(data)) {}

std::string Sums::to_bytes() const { return sealed('+', llmt::to_bytes(data_ ? *data_ : SumsData{})); }

Sums Sums::from_bytes(std::string_view bytes, const std::string& name) {
  const std::string_view content = unsealed('+', bytes, name);
  try {
    auto data = std::make_unique<SumsData>(llmt::from_bytes<SumsData>(content));
    check_sums(*data);
    return Sums(std::move(data));
  } catch (const std::runtime_error& error) {
    throw std::runtime_error(fmt::format("{}: {}", name, error.what()));
  }
}

Sums merge(Sums a, Sums b) {
  if (b.data() == nullptr || b.data()->runs.empty()) return a.data() == nullptr ? std::move(b) : std::move(a);
  if (a.data() == nullptr || a.data()->runs.empty()) return b;
  const SumsData& other = *b.data();
  if (a.data()->mark != other.mark || a.data()->inputs != other.inputs || a.data()->regressors != other.regressors ||
      a.data()->columns != other.columns || a.data()->bins != other.bins || a.data()->unknowns != other.unknowns ||
      a.data()->step != other.step) {
    throw std::invalid_argument("llmt::distributed::merge: the sums belong to different states");
  }
  std::vector<Run> all = std::move(a.data()->runs);
  std::ranges::move(b.data()->runs, std::back_inserter(all));
  std::ranges::sort(all, {}, &Run::first);
  std::vector<Run> joined;
  for (Run& run : all) {
    if (!joined.empty() && run.first < joined.back().last) {
      throw std::invalid_argument(fmt::format("llmt::distributed::merge: block {} is in both sums", run.first));
    }
    if (joined.empty() || run.first > joined.back().last) {
      joined.push_back(std::move(run));
    } else {
      joined.back().sums += std::move(run.sums);
      joined.back().last = run.last;
    }
  }
  a.data()->runs = std::move(joined);
  return a;
}

}  // namespace llmt::distributed
