// Two measured systems whose usual model lacks something: Silverbox (a cubic spring) and the cascaded tanks (overflow).
#include <fmt/format.h>

#include <Eigen/QR>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <memory>
#include <string>

#include "llmt/csv.hpp"
#include "llmt/discovery/least_squares.hpp"
#include "llmt/discovery/simulation.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using namespace llmt::discovery;

double rms(const Eigen::VectorXd& values) {
  return std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

void print_found(const Missing& missing) {
  fmt::print("answer: {}\n", to_string(missing.answer));
  for (const FoundTerm& found : missing.found) {
    fmt::print("  {:40} {:5.1f} % rests on it alone{}\n", found.formula, 100.0 * found.share,
               found.confirmed ? ", confirmed" : "");
  }
  for (const Gap& gap : missing.gaps) {
    fmt::print("  gap of {} on rows set aside: {:.4g} -> {:.4g}\n", gap.output, gap.before, gap.after);
  }
}

// Lines of the public files end in a comma, as if there were one more column.
llmt::Csv read_table(const std::string& file) {
  std::ifstream stream(file);
  std::string text;
  for (std::string line; std::getline(stream, line);) {
    if (!line.empty() && line.back() == '\r') line.pop_back();
    if (!line.empty() && line.back() == ',') line.pop_back();
    text += line + "\n";
  }
  return llmt::Csv::parse(std::move(text), file);
}

// Silverbox: y(t) from the last two outputs and three inputs is a linear circuit of second order; its coefficients are
// the simulation's own parameters. What it lacks may depend on position, velocity and force.
void study_silverbox(const std::string& file) {
  const llmt::Csv table = read_table(file);
  const Eigen::VectorXd u = table.numbers("V1");
  const Eigen::VectorXd y = table.numbers("V2");
  constexpr Eigen::Index first = 50000;  // behind the "arrow head", which is for judging
  constexpr Eigen::Index step = 40;      // samples apart: about as independent as rows of a table
  constexpr Eigen::Index rows = 1000;
  Inputs inputs{{"position", "velocity", "y2", "force", "u1", "u2"}, Eigen::MatrixXd(rows, 6)};
  MeasuredOutputs measured{{"y"}, Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    const Eigen::Index t = first + step * i;
    inputs.values.row(i) << y(t - 1), y(t - 1) - y(t - 2), y(t - 2), u(t), u(t - 1), u(t - 2);
    measured.values(i, 0) = y(t);
  }
  Simulation circuit;
  for (const char* name : {"of y(t-1)", "of y(t-2)", "of u(t)", "of u(t-1)", "of u(t-2)", "offset"}) {
    circuit.parameters.push_back({.name = name, .unit = "1", .value = 0.1, .scale = 0.1});
  }
  circuit.predict = [](const Eigen::MatrixXd& x, const Eigen::VectorXd& p) -> Eigen::MatrixXd {
    return (p(0) * x.col(0) + p(1) * x.col(2) + x.rightCols(3) * p.segment<3>(2)).array() + p(5);
  };
  Inputs of_terms{{"position", "velocity"}, inputs.values.leftCols(2)};
  const Missing missing = find_missing(circuit, inputs, measured, standard_terms(of_terms));
  fmt::print("Silverbox: {} instants, linear circuit of second order, one sample ahead\n", rows);
  print_found(missing);
}

// The tanks' levels by Torricelli's law, without overflow: k1, k2, k3, k4 of the flows, levels at the start.
Eigen::MatrixXd tank_levels(const Eigen::VectorXd& pump, const Eigen::VectorXd& p) {
  constexpr int steps = 4;
  constexpr double seconds = 4.0 / steps;
  Eigen::MatrixXd levels(pump.size(), 2);
  double upper = p(4);
  double lower = p(5);
  for (Eigen::Index t = 0; t < pump.size(); ++t) {
    levels.row(t) << upper, lower;
    for (int k = 0; k < steps; ++k) {
      const double fast = std::sqrt(std::max(0.0, upper));
      const double slow = std::sqrt(std::max(0.0, lower));
      upper += seconds * (-p(0) * fast + p(3) * pump(t));
      lower += seconds * (p(1) * fast - p(2) * slow);
    }
  }
  return levels;
}

// The flows' constants from the first half; `flows` empty: all six are free, else only the levels at the start.
Eigen::VectorXd fitted_tanks(const Eigen::VectorXd& pump, const Eigen::VectorXd& level, const Eigen::VectorXd& flows) {
  LeastSquaresProblem problem;
  for (const char* name : {"k1", "k2", "k3", "k4", "upper", "lower"}) {
    const auto k = std::ssize(problem.parameters);
    const bool is_flow = k < 4;
    const double start = is_flow ? (flows.size() > 0 ? flows(k) : 0.05) : 5.0;
    problem.parameters.push_back({.name = name,
                                  .unit = is_flow ? "1/s" : "V",
                                  .value = start,
                                  .scale = is_flow ? 0.01 : 1.0,
                                  .free = !is_flow || flows.size() == 0});
  }
  problem.residual = [&](const Eigen::VectorXd& p) -> Eigen::VectorXd { return tank_levels(pump, p).col(1) - level; };
  return solve(problem).values;
}

void study_tanks(const std::string& file) {
  const llmt::Csv table = read_table(file);
  const auto half = [&](const std::string& name) -> Eigen::VectorXd { return table.numbers(name).head(1024); };
  const Eigen::VectorXd learnt = fitted_tanks(half("uEst"), half("yEst"), {});
  const Eigen::VectorXd judged = fitted_tanks(half("uVal"), half("yVal"), learnt.head(4));
  const auto inputs_of = [](const Eigen::VectorXd& pump, const Eigen::MatrixXd& levels) {
    Inputs inputs{{"pump", "upper", "lower"}, Eigen::MatrixXd(pump.size(), 3)};
    inputs.values << pump, levels;
    return inputs;
  };
  const Eigen::MatrixXd levels = tank_levels(half("uEst"), learnt);
  const Inputs inputs = inputs_of(half("uEst"), levels);
  const std::vector<ModelTerm> terms = standard_terms(inputs);
  const Simulation simulated = tabulated(levels.col(1), {"level"});
  MeasuredOutputs measured{{"level"}, half("yEst")};
  fmt::print("\nCascaded tanks: Torricelli's law without overflow, fitted to the first half\n");
  const Missing missing = find_missing(simulated, inputs, measured, terms);
  print_found(missing);
  // The terms see simulated levels only, so they can be judged on the other half with its own simulation.
  const Eigen::MatrixXd other = tank_levels(half("uVal"), judged);
  const Eigen::MatrixXd with_terms =
      corrected(tabulated(other.col(1), {"level"}), missing, terms, inputs_of(half("uVal"), other));
  fmt::print("  root mean square error on the second half: {:.3f} V simulated, {:.3f} V with what was found\n",
             rms(half("yVal") - other.col(1)), rms(half("yVal") - with_terms.col(0)));
}

void study_systems(const std::string& folder) {
  const std::string silverbox = folder + "/silverbox_SNLS80mV.csv";
  const std::string tanks = folder + "/cascaded_tanks.csv";
  if (std::filesystem::exists(silverbox))
    study_silverbox(silverbox);
  else
    fmt::print("{} is not there (unpack it with gunzip)\n", silverbox);
  if (std::filesystem::exists(tanks))
    study_tanks(tanks);
  else
    fmt::print("{} is not there\n", tanks);
}

}  // namespace

void add_systems(CLI::App& study) {
  const auto folder = std::make_shared<std::string>();
  CLI::App* command = study.add_subcommand("systems", "Silverbox and cascaded tanks: what their usual model lacks");
  command->add_option("--data", *folder, "folder with silverbox_SNLS80mV.csv and cascaded_tanks.csv")
      ->required()
      ->check(CLI::ExistingDirectory);
  command->callback([folder] { study_systems(*folder); });
}

}  // namespace bench
