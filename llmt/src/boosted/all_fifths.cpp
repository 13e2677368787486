#include "boosted/all_fifths.hpp"

#include <algorithm>

#include "boosted/one_tree.hpp"

namespace llmt {
namespace {

// Residuals of the held-out rows after the chosen number of rounds; their own error stops nothing.
Eigen::VectorXd residuals_of_sum(const Eigen::VectorXd& output, const ChosenSum& chosen, const HoldOut& rows,
                                 std::uint64_t seed, Work& work) {
  RoundOptions rounds = chosen.plan.rounds;
  rounds.most_rounds = static_cast<int>(chosen.rounds);
  rounds.patience = rounds.most_rounds + 1;
  rounds.keep_path = true;
  Random random(seed);
  return boost(chosen.plan.rows, output, rows.train, rows.held_out, {}, rounds, random, work).path.back();
}

}  // namespace

std::optional<Eigen::VectorXd> residuals_of_other_parts(const BoostingData& data, const Eigen::VectorXd& output,
                                                        const ChosenSum& chosen, std::uint64_t seed, Work& work) {
  const int parts = std::ranges::max(data.parts) + 1;
  Eigen::VectorXd result = Eigen::VectorXd::Zero(output.size());
  for (int part = 1; part < parts; ++part) {
    Work of_part(work, work.left() / static_cast<double>(parts - part));
    const HoldOut rows = part_apart(data.parts, part);
    if (chosen.shares(0) > 0.0) {
      result(rows.held_out) += chosen.shares(0) * residuals_of_sum(output, chosen, rows, seed, of_part);
    }
    if (chosen.tree) {
      const std::optional<Eigen::VectorXd> of_tree = residuals_without(data, output, rows, *chosen.tree, of_part);
      if (!of_tree) return std::nullopt;
      result(rows.held_out) += chosen.shares(1) * *of_tree;
    }
  }
  return result;
}

}  // namespace llmt
