// Ordinary differential equations of which a term is hidden: what the search for missing terms says about it.
#include <fmt/format.h>

#include <Eigen/QR>
#include <algorithm>
#include <array>
#include <cmath>
#include <filesystem>
#include <memory>
#include <optional>

#include "llmt/discovery/simulation.hpp"
#include "llmt/random.hpp"
#include "study/ode_system.hpp"
#include "study/study.hpp"

namespace bench {
namespace {

using namespace llmt::discovery;

struct Arguments {
  std::string folder;
  std::vector<int> ids;  // of systems; empty: all
  Eigen::Index rows = 400;
  bool along = false;
  bool quiet = false;
};

constexpr std::array<double, 2> noise_shares = {0.01, 0.05};

// Energy of the hidden term on the rows searched, in noise units, as in the blind test of robots.
constexpr double visible_energy = 150.0;

// A function that differs by less energy is the same one on these states.
constexpr double indistinct_energy = 25.0;
constexpr double rounding = 1e-6;

// Right: the same function of the states by one name. In class: a sum of terms that equals it on these states within
// the noise, as a wave of a fitted period, or a rival that does. Wrong: other names, one of them confirmed.
enum Outcome { right, in_class, wrong, unknown, nothing, outcomes };
constexpr std::array<const char*, outcomes> outcome_names = {"right", "in class", "wrong", "unknown", "nothing"};

struct Counts {
  std::array<int, outcomes> visible = {};
  std::array<int, outcomes> invisible = {};
  int clean = 0;
  int alarms = 0;
};

// Sampled states and the terms of one component at them, one a column.
struct Component {
  int id = 0;
  int number = 0;
  std::vector<std::string> texts;
  Inputs inputs;
  Eigen::MatrixXd terms;
};

Eigen::MatrixXd sampled_states(OdeSystem& system, const Arguments& arguments) {
  const Eigen::MatrixXd visited = trajectories(system);
  const Eigen::VectorXd low = visited.colwise().minCoeff();
  const Eigen::VectorXd high = visited.colwise().maxCoeff();
  llmt::Random random(system.id);
  Eigen::MatrixXd states(arguments.rows, visited.cols());
  for (Eigen::Index i = 0; i < states.rows();) {
    if (arguments.along) {
      states.row(i) = visited.row(random.below(visited.rows()));
    } else {
      for (Eigen::Index j = 0; j < states.cols(); ++j) states(i, j) = random.uniform(low(j), high(j));
    }
    // Some right-hand sides have poles and logarithms.
    if (system.derivative(states.row(i).transpose()).allFinite()) ++i;
  }
  return states;
}

std::vector<Component> components_of(OdeSystem& system, const Arguments& arguments) {
  const Eigen::MatrixXd states = sampled_states(system, arguments);
  std::vector<Component> components;
  for (std::size_t c = 0; c < system.components.size(); ++c) {
    Component component{system.id, static_cast<int>(c), {}, {}, {}};
    component.inputs.values = states;
    for (Eigen::Index j = 0; j < states.cols(); ++j) component.inputs.names.push_back(fmt::format("x_{}", j));
    component.terms.resize(states.rows(), std::ssize(system.components[c]));
    for (std::size_t t = 0; t < system.components[c].size(); ++t) {
      OdeTerm& term = system.components[c][t];
      component.texts.push_back(term.text);
      for (Eigen::Index i = 0; i < states.rows(); ++i) {
        component.terms(i, t) = term.function.at(states.row(i).transpose());
      }
    }
    components.push_back(std::move(component));
  }
  return components;
}

// Share of `hidden` that the best sum of `columns` leaves over.
double left_over(const Eigen::MatrixXd& columns, const Eigen::VectorXd& hidden) {
  return (hidden - columns * columns.colPivHouseholderQr().solve(hidden)).norm() / hidden.norm();
}

// `sigma`: of the noise.
Outcome judged(const Missing& missing, const std::vector<ModelTerm>& terms, const Rows& rows,
               const Eigen::VectorXd& hidden, double sigma) {
  if (missing.answer == Answer::nothing_missing) return nothing;
  if (!std::ranges::any_of(missing.found, &FoundTerm::confirmed)) return unknown;
  Eigen::MatrixXd all(hidden.size(), 0);
  for (const FoundTerm& found : missing.found) {
    const Eigen::MatrixXd columns = terms[found.term].columns(rows, found.constants);
    all.conservativeResize(Eigen::NoChange, all.cols() + columns.cols());
    all.rightCols(columns.cols()) = columns;
  }
  const double deviation = left_over(all, hidden);
  const bool within_noise = deviation * hidden.norm() <= std::sqrt(indistinct_energy) * sigma;
  const bool own_name = missing.found.size() == 1 && !missing.found.front().family.starts_with("gain");
  if (own_name && deviation < rounding) return right;
  if (deviation < rounding || within_noise) return in_class;
  // The answer may name the hidden term beside another one that these rows cannot distinguish from it.
  const auto names_it = [&](const RivalTerms& rival) {
    return std::ranges::any_of(terms, [&](const ModelTerm& term) {
      return term.constants.empty() && !term.generic && rival.what == term.family + " " + term.location &&
             left_over(term.columns(rows, {}), hidden) < rounding;
    });
  };
  const bool named = missing.found.size() == 1 && std::ranges::any_of(missing.found.front().rivals, names_it);
  return named ? in_class : wrong;
}

std::string names_in(const Missing& missing) {
  std::string text;
  for (const FoundTerm& found : missing.found) {
    text +=
        fmt::format("{}{} {}{}", text.empty() ? "" : " + ", found.family, found.location, found.confirmed ? "" : "?");
  }
  return text;
}

// `hidden`: the number of the term that the simulation lacks, or none.
void study_one(const Component& component, std::optional<Eigen::Index> hidden, std::size_t level, bool quiet,
               Counts& counts) {
  const Eigen::VectorXd full = component.terms.rowwise().sum();
  const Eigen::Index n = full.size();
  const double spread = std::sqrt((full.array() - full.mean()).square().mean());
  const double sigma = noise_shares[level] * spread;
  const Eigen::VectorXd lacking = hidden ? Eigen::VectorXd(component.terms.col(*hidden)) : Eigen::VectorXd::Zero(n);
  llmt::Random random(1000 * component.id + 100 * component.number + 10 * (hidden ? *hidden + 1 : 0) + level);
  MeasuredOutputs measured{{"y"}, full};
  for (double& value : measured.values.col(0)) value += sigma * random.normal();
  const Eigen::MatrixXd simulated = full - lacking;
  const std::vector<ModelTerm> terms = standard_terms(component.inputs);
  const Missing missing = find_missing(tabulated(simulated, {"y"}, false, false), component.inputs, measured, terms);
  const std::string head = fmt::format("{:3}.{} {:4.0f} %", component.id, component.number, 100 * noise_shares[level]);
  if (!hidden) {
    ++counts.clean;
    if (missing.answer == Answer::nothing_missing) return;
    ++counts.alarms;
    if (!quiet) fmt::print("{} {:48} {:8} {:9} {}\n", head, "nothing hidden", "", "ALARM", names_in(missing));
    return;
  }
  const double energy = lacking(missing.searched).squaredNorm() / (sigma * sigma);
  const Outcome outcome = judged(missing, terms, rows_of(component.inputs, simulated.col(0)), lacking, sigma);
  ++(energy >= visible_energy ? counts.visible : counts.invisible)[outcome];
  if (quiet) return;
  fmt::print("{} {:48} {:8.2g} {:9} {}\n", head, component.texts[*hidden], energy, outcome_names[outcome],
             names_in(missing));
  std::fflush(stdout);
}

void print_counts(const std::array<Counts, noise_shares.size()>& counts) {
  fmt::print("\n{:6} {:10} {:>6}", "noise", "terms", "count");
  for (const char* name : outcome_names) fmt::print(" {:>9}", name);
  fmt::print("\n");
  for (std::size_t level = 0; level < counts.size(); ++level) {
    const std::string noise = fmt::format("{:.0f} %", 100 * noise_shares[level]);
    const auto line = [&](const char* which, const std::array<int, outcomes>& row) {
      fmt::print("{:6} {:10} {:6}", noise, which, row[0] + row[1] + row[2] + row[3] + row[4]);
      for (const int count : row) fmt::print(" {:9}", count);
      fmt::print("\n");
    };
    line("visible", counts[level].visible);
    line("invisible", counts[level].invisible);
    fmt::print("{:6} nothing hidden: {} runs, {} false alarms\n", noise, counts[level].clean, counts[level].alarms);
  }
}

void study_odes(const Arguments& arguments) {
  const std::string file = arguments.folder + "/odes.json";
  if (!std::filesystem::exists(file)) {
    fmt::print("{} is not there: nothing to study\n", file);
    return;
  }
  std::array<Counts, noise_shares.size()> counts;
  for (OdeSystem& system : read_odes(file)) {
    if (!arguments.ids.empty() && std::ranges::find(arguments.ids, system.id) == arguments.ids.end()) continue;
    for (const Component& component : components_of(system, arguments)) {
      for (std::size_t level = 0; level < noise_shares.size(); ++level) {
        study_one(component, {}, level, arguments.quiet, counts[level]);
        for (Eigen::Index t = 0; t < component.terms.cols(); ++t) {
          study_one(component, t, level, arguments.quiet, counts[level]);
        }
      }
    }
  }
  print_counts(counts);
}

}  // namespace

void add_odes(CLI::App& study) {
  const auto arguments = std::make_shared<Arguments>();
  CLI::App* command = study.add_subcommand("odes", "Differential equations with a term hidden: is it named");
  command->add_option("systems", arguments->ids, "numbers of systems; default: all");
  command->add_option("--data", arguments->folder, "folder with odes.json")->required()->check(CLI::ExistingDirectory);
  command->add_option("--rows", arguments->rows, "sampled states")->check(CLI::Range(50, 4000))->capture_default_str();
  command->add_flag("--along", arguments->along,
                    "states on the trajectories; default: anywhere in the box that holds them");
  command->add_flag("--quiet", arguments->quiet, "only the counts");
  command->callback([arguments] { study_odes(*arguments); });
}

}  // namespace bench
