#include "discovery/rest_correction.hpp"

#include <fmt/format.h>

#include "llmt/folds.hpp"
#include "llmt/statistics.hpp"

namespace llmt::robotics {

void add_correction(const Measurements& searched, std::uint64_t seed, Work& work, CorrectedRobot& improved,
                    std::vector<std::string>& notes) {
  constexpr Eigen::Index fewest_measured = 100;
  constexpr int folds = 5;
  constexpr double share_of_fits = 0.9;
  if (searched.count() < fewest_measured) return;
  FitOptions fitting;
  fitting.validity = ValidityChoice::crisp;
  fitting.intervals = false;
  fitting.folds.seed = seed;
  const Robot& robot = improved.robot;
  const auto tree_of_rest = [&, share = share_of_fits * work.left() / (folds + 1)](const Measurements& trained) {
    Work part(work, share);
    return fit_correction(robot, trained, fitting, {}, part.progress()).model;
  };
  const Eigen::VectorXd without = distances(positions(robot, searched.poses), searched);
  Eigen::VectorXd with = without;
  const std::vector<double> labels = pose_labels(searched.poses);
  FoldOptions dealing;
  dealing.count = folds;
  dealing.seed = seed;
  for (const Fold& fold : make_folds(searched.count(), dealing, labels)) {
    const CorrectedRobot trained{robot, tree_of_rest(select(searched, fold.train))};
    const Measurements held_out = select(searched, fold.held_out);
    with(fold.held_out) = distances(positions(trained, held_out.poses), held_out);
  }
  if (!paired_difference(without, with).is_beyond_chance()) {
    notes.push_back(
        fmt::format("A tree of the rest does not help: {:.4f} mm without, {:.4f} with it on poses left out.",
                    without.mean(), with.mean()));
    return;
  }
  improved.correction = tree_of_rest(searched);
  notes.push_back(fmt::format("A tree of the rest lowers the error on poses left out from {:.4f} to {:.4f} mm.",
                              without.mean(), with.mean()));
}

}  // namespace llmt::robotics
