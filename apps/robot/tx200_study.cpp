#include "robot/tx200_study.hpp"

#include "llmt/robotics/calibration_report.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"
#include "robot/shipped_robots.hpp"

namespace llmt::apps {

Tx200Run tx200_run(bool compliance, std::uint64_t seed) {
  const robotics::Robot nominal = robotics::parse_robot(tx200_like_yaml, "tx200_like.yaml");
  robotics::Robot truth = nominal;
  if (compliance) {
    truth.effects = {{"joint_compliance", "joint2", {3e-8}}, {"joint_compliance", "joint3", {5e-8}}};
  }
  robotics::ReportOptions options;
  options.correct = true;
  options.folds = 45;
  // 45 poses do not fill five leaves of twice seven: eight a leaf leave each one more pose than coefficients.
  options.correction = {.max_leaves = 5, .min_leaf_samples = 8, .significance = every_split};
  options.correction_folds = 0;
  Tx200Run run{robotics::simulate(truth, {.poses = 45, .noise_um = 10.0, .seed = seed}), {}};
  run.report = robotics::report_calibration(nominal, run.measurements, options);
  return run;
}

std::vector<Tx200Trial> tx200_study(bool compliance, std::uint64_t first_seed, int seeds,
                                    const std::function<void(int done)>& progress) {
  std::vector<Tx200Trial> trials;
  for (int done = 0; done < seeds; ++done) {
    const robotics::CalibrationReport report =
        tx200_run(compliance, first_seed + static_cast<std::uint64_t>(done)).report;
    trials.push_back({report.geometric.in_sample_mm.mean(), report.corrected->in_sample_mm.mean(),
                      report.geometric.held_out_mm.mean(), report.corrected->held_out_mm.mean()});
    progress(done + 1);
  }
  return trials;
}

}  // namespace llmt::apps
