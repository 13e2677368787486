// Finding a missing effect of a six-axis arm, one thread. Joint compliance at joint 2 is hidden. Counters: hypotheses =
// number of candidates; right = 1 if the verdict names that effect and nothing else.
//
// search: arguments poses / candidates; signatures and search with all null draws. discover_all: argument poses; with
// calibrations, scans, shapes and all rounds.
#include <benchmark/benchmark.h>

#include <algorithm>

#include "blind/catalogue_candidates.hpp"
#include "llmt/random.hpp"
#include "llmt/robotics/discovery/discovery.hpp"
#include "llmt/robotics/robot_file.hpp"
#include "llmt/robotics/simulation.hpp"

namespace {

using namespace llmt::robotics;
namespace discovery = llmt::discovery;

constexpr const char* hidden_place = "joint2";

Robot nominal() {
  Robot robot = read_robot(std::string(LLMT_ROBOTS_DIR) + "/tx200_like.yaml");
  for (Joint& joint : robot.chain.joints) joint.gear_ratio = 101.0;
  return robot;
}

// Measurements with every column that an effect may need, and 20 um of noise.
Measurements session(const Robot& robot, Eigen::Index count) {
  Robot truth = robot;
  truth.effects.push_back({.type = "joint_compliance", .at = hidden_place, .values = {2e-7}});
  Poses poses = simulate(robot, {.poses = count, .seed = 1}).poses;
  llmt::Random random(2);
  const auto column = [&](const std::string& name, auto value) {
    Eigen::VectorXd values(count);
    for (double& one : values) one = value();
    poses.covariates[name] = values;
  };
  const Eigen::VectorXd rows = Eigen::VectorXd::LinSpaced(count, 0.0, static_cast<double>(count - 1));
  poses.covariates["order"] = rows;
  poses.covariates["time_s"] = 20.0 * rows;
  column("temp_C", [&] { return random.uniform(18.0, 26.0); });
  column("payload_kg", [&] { return random.uniform() < 0.5 ? 0.0 : 60.0; });
  for (Eigen::Index j = 0; j < std::ssize(robot.chain.joints); ++j) {
    const std::string read_back = fmt::format("qmeas{}_rad", j + 1);
    column(fmt::format("dir{}", j + 1), [&] { return random.uniform() < 0.5 ? -1.0 : 1.0; });
    column(read_back, [&] { return 1e-4 * random.normal(); });
    poses.covariates[read_back] += poses.joints.col(j);
  }
  add_moves(poses, robot.chain);
  return simulate(truth, poses, {.noise_um = 20.0, .seed = 3});
}

// The first `count` effects of the catalogue, filled up with transmission errors of further orders.
std::vector<Effect> hypotheses(const Robot& robot, const Poses& poses, Eigen::Index count) {
  std::vector<Effect> effects = blind::catalogue(robot, poses);
  const EffectType& type = effect_type("transmission_error");
  for (int k = 0; std::ssize(effects) < count; ++k) {
    effects.push_back(make_effect(type, robot.chain, k % 6, {3.3 + 0.7 * (k / 6)}));
  }
  effects.resize(count);
  return effects;
}

void search(benchmark::State& state) {
  const Robot robot = nominal();
  const Measurements measured = session(robot, state.range(0));
  const Robot calibrated = calibrate(robot, measured).robot;
  const std::vector<Effect> effects = hypotheses(calibrated, measured.poses, state.range(1));
  const discovery::Evidence evidence = blind::evidence_of(calibrated, measured);
  discovery::Verdict verdict;
  std::vector<discovery::EffectCandidate> candidates;
  for (auto _ : state) {
    candidates = blind::candidates_of(calibrated, effects, measured);
    verdict = discovery::search(evidence, candidates);
  }
  bool right = verdict.findings.size() == 1 && verdict.findings[0].family == "joint_compliance";
  for (const discovery::Finding& finding : verdict.findings) {
    for (const discovery::FindingTerm& term : finding.terms) {
      right = right && candidates[term.candidate].location == hidden_place;
    }
  }
  state.counters["hypotheses"] = static_cast<double>(candidates.size());
  state.counters["right"] = right ? 1.0 : 0.0;
}

void signatures(benchmark::State& state) {
  const Robot robot = nominal();
  const Measurements measured = session(robot, state.range(0));
  const std::vector<Effect> effects = hypotheses(robot, measured.poses, state.range(1));
  for (auto _ : state) benchmark::DoNotOptimize(blind::candidates_of(robot, effects, measured));
}

void discover_all(benchmark::State& state) {
  const Robot robot = nominal();
  const Measurements measured = session(robot, state.range(0));
  Discovery found;
  for (auto _ : state) found = discover(robot, measured);
  state.counters["hypotheses"] = found.hypotheses;
  state.counters["rounds"] = found.rounds;
  const bool right = found.effects.size() == 1 && effect_label(found.effects[0].effect) == "joint_compliance@joint2";
  state.counters["right"] = right ? 1.0 : 0.0;
}

BENCHMARK(signatures)->Args({200, 140})->Unit(benchmark::kMillisecond);
BENCHMARK(search)
    ->Args({200, 140})
    ->Args({1000, 140})
    ->Args({2000, 140})
    ->Args({5000, 140})
    ->Args({10000, 140})
    ->Args({200, 70})
    ->Args({200, 280})
    ->Args({200, 560})
    ->Unit(benchmark::kMillisecond);
BENCHMARK(discover_all)->Arg(60)->Arg(200)->Arg(1000)->Arg(2000)->Unit(benchmark::kMillisecond);

}  // namespace
