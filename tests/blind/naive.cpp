// blind_naive: two simple ways to name a missing effect, on the cases of the blind test (folders with robot.yaml and
// measured.csv; truth/<case>.json is read to score the answers, after they are given).
//
//   best   the family, with all its places at once, of the largest in-sample R^2 beside a refitted geometry, accepted
//          at p < 0.05 of its F test
//   every  all families with p < 0.05, uncorrected
//
// Outliers are left in and shapes are not searched, because neither design knows of them. A family that is an exact
// alias of the hidden one counts as right.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <Eigen/QR>
#include <boost/math/distributions/fisher_f.hpp>
#include <cstdio>
#include <exception>
#include <filesystem>
#include <fstream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>

#include "blind/catalogue_candidates.hpp"
#include "llmt/robotics/robot_file.hpp"

namespace {

namespace fs = std::filesystem;
using namespace llmt::robotics;

struct Tested {
  std::string family;
  double p_value = 1.0;
  double left = 0.0;
};

Eigen::MatrixXd basis_of(Eigen::MatrixXd columns, double tolerance) {
  for (auto column : columns.colwise()) {
    if (column.norm() > 0.0) column.normalize();
  }
  Eigen::ColPivHouseholderQR<Eigen::MatrixXd> factors(columns);
  factors.setThreshold(tolerance);
  Eigen::MatrixXd basis = Eigen::MatrixXd::Identity(columns.rows(), factors.rank());
  basis.applyOnTheLeft(factors.householderQ());
  return basis;
}

// The F test of every family beside the baseline.
std::vector<Tested> tests(const Robot& nominal, const Measurements& measured) {
  const Robot robot = calibrate(nominal, measured).robot;
  const blind::Evidence evidence = blind::evidence_of(robot, measured);
  const std::vector<blind::Candidate> candidates =
      blind::candidates_of(robot, blind::catalogue(robot, measured.poses), measured);
  const Eigen::MatrixXd baseline = basis_of(evidence.jacobian, 1e-9);
  const auto project = [&](const Eigen::MatrixXd& m) -> Eigen::MatrixXd {
    return m - baseline * (baseline.transpose() * m);
  };
  const Eigen::VectorXd residuals = project(evidence.residuals);
  std::map<std::string, Eigen::MatrixXd> families;
  for (const blind::Candidate& one : candidates) {
    const Eigen::MatrixXd outside = project(one.signature);
    Eigen::MatrixXd& all = families.try_emplace(one.family, residuals.size(), 0).first->second;
    for (Eigen::Index k = 0; k < outside.cols(); ++k) {
      constexpr double absorbed = 1e-3;
      const double given = one.signature.col(k).norm();
      if (!(outside.col(k).norm() > absorbed * given)) continue;
      all.conservativeResize(Eigen::NoChange, all.cols() + 1);
      all.rightCols(1) = outside.col(k).normalized();
    }
  }
  std::vector<Tested> all;
  for (const auto& [family, columns] : families) {
    if (columns.cols() == 0) continue;
    const Eigen::MatrixXd basis = basis_of(columns, 1e-3);
    const double gain = (basis.transpose() * residuals).squaredNorm();
    const auto k = static_cast<double>(basis.cols());
    const double freedom = static_cast<double>(residuals.size() - baseline.cols()) - k;
    if (freedom < 2.0) continue;
    const double left = residuals.squaredNorm() - gain;
    const double ratio = gain / k / (left / freedom);
    all.push_back({family, boost::math::cdf(boost::math::complement(boost::math::fisher_f(k, freedom), ratio)), left});
  }
  return all;
}

struct Tally {
  int none = 0, false_alarms = 0, single = 0, exact = 0, unknown = 0, wrongly_named = 0, names = 0;

  void add(const nlohmann::json& truth, const std::set<std::string>& said) {
    if (truth["hidden"].empty()) {
      ++none;
      false_alarms += !said.empty();
      return;
    }
    if (truth["hidden"].size() > 1 || truth["lambda"].get<double>() < 40.0) return;
    const nlohmann::json& hidden = truth["hidden"][0];
    if (!hidden["in_catalogue"].get<bool>()) {
      ++unknown;
      wrongly_named += !said.empty();
      return;
    }
    ++single;
    names += static_cast<int>(said.size());
    const auto only = [&](const char* family) { return said == std::set<std::string>{family}; };
    const std::string family = hidden["family"];
    const bool spring = family == "counterbalance_spring" || family == "eccentricity";
    const bool base = truth["arm"] == "planar" && (family == "elastic_base" || family == "joint_compliance");
    exact += said == std::set<std::string>{family} ||
             (spring && (only("eccentricity") || only("counterbalance_spring"))) ||
             (base && (only("elastic_base") || only("joint_compliance")));
  }
};

std::string share(int hits, int total) {
  return total == 0 ? "-" : fmt::format("{}/{} {:.0f} %", hits, total, 100.0 * hits / total);
}

void print(const std::string& arm, const char* design, const Tally& t) {
  fmt::print("{:<8} {:<6} {:<16} {:<16} {:<13.2f} {}\n", arm, design, share(t.false_alarms, t.none),
             share(t.exact, t.single), t.single == 0 ? 0.0 : static_cast<double>(t.names) / t.single,
             share(t.wrongly_named, t.unknown));
}

struct Said {
  std::set<std::string> best, every;
};

Said families(const std::vector<Tested>& all) {
  constexpr double level = 0.05;
  Said said;
  const auto first = std::ranges::min_element(all, {}, &Tested::left);
  if (first != all.end() && first->p_value < level) said.best.insert(first->family);
  for (const Tested& one : all) {
    if (one.p_value < level) said.every.insert(one.family);
  }
  return said;
}

void run(const fs::path& folder) {
  std::map<std::string, std::array<Tally, 2>> arms;
  int refused = 0;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder / "truth")) {
    if (entry.path().extension() != ".json") continue;
    const fs::path data = folder / entry.path().stem();
    Said said;
    try {
      const Robot robot = read_robot((data / "robot.yaml").string());
      said = families(tests(robot, read_measurements((data / "measured.csv").string(), robot)));
    } catch (const std::exception& error) {
      fmt::print(stderr, "{}: {}\n", data.filename().string(), error.what());
      ++refused;
      continue;
    }
    std::ifstream file(entry.path());
    const nlohmann::json truth = nlohmann::json::parse(file);
    // Dirty data, as in the blind test's tables, are another question.
    if (truth["dirty"] != "") continue;
    auto& [best, every] = arms[truth["arm"]];
    best.add(truth, said.best);
    every.add(truth, said.every);
  }
  fmt::print("{:<8} {:<6} {:<16} {:<16} {:<13} {}\n", "arm", "design", "false alarm", "exact name", "mean # names",
             "unknown effect named");
  for (const auto& [arm, tallies] : arms) {
    print(arm, "best", tallies[0]);
    print(arm, "every", tallies[1]);
  }
  fmt::print("single and unknown effects with lambda >= 40, clean data, {} cases refused\n", refused);
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Scores two simple ways to name a missing effect");
  std::string folder;
  app.add_option("cases", folder, "folder that blind_generate wrote")->required()->check(CLI::ExistingDirectory);
  CLI11_PARSE(app, argc, argv);
  try {
    run(folder);
  } catch (const std::exception& error) {
    fmt::print(stderr, "blind_naive: {}\n", error.what());
    return 1;
  }
  return 0;
}
