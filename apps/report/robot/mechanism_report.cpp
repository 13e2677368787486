#include "report/robot/mechanism_report.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>

#include "report/text/text.hpp"

namespace llmt::report {
namespace {

using robotics::Coordinate;
using robotics::MechanismErrors;
using robotics::MechanismParameter;

struct MechanismFigures {
  std::string of;  // "x", or "contradiction"
  std::string unit;
  double before_rms = 0.0;
  double after_rms = 0.0;  // held out
  double after_max = 0.0;
};

Eigen::VectorXd finite(const Eigen::VectorXd& values) {
  std::vector<double> kept;
  std::ranges::copy_if(values, std::back_inserter(kept), [](double value) { return std::isfinite(value); });
  return Eigen::Map<const Eigen::VectorXd>(kept.data(), std::ssize(kept));
}

double rms(const Eigen::VectorXd& values) {
  return values.size() == 0 ? NAN : std::sqrt(values.squaredNorm() / static_cast<double>(values.size()));
}

// The unit that all readings with noise share, or nothing: then noise is a multiple of sigma.
std::string unit_of_noise(const MechanismFacts& facts) {
  const Eigen::VectorXd sigma = robotics::noise_of(facts.described, facts.measured);
  std::string unit;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    const Coordinate& coordinate = facts.described.coordinates[i];
    if (sigma(i) == 0.0) continue;
    if (coordinate.sigma) return "sigma";
    unit = coordinate.unit;
  }
  return unit;
}

std::vector<MechanismFigures> figures_of(const MechanismFacts& facts) {
  const MechanismErrors after =
      facts.held_out ? *facts.held_out : robotics::errors_of(facts.calibration.mechanism, facts.measured);
  std::vector<MechanismFigures> all;
  for (Eigen::Index i = 0; i < after.values.cols(); ++i) {
    const Eigen::VectorXd before = finite(facts.before.values.col(i));
    const Eigen::VectorXd now = finite(after.values.col(i));
    if (now.size() == 0) continue;
    MechanismFigures figures;
    figures.of = after.of_outputs ? facts.described.coordinates[i].name : "contradiction";
    figures.unit = after.of_outputs ? facts.described.coordinates[i].unit : unit_of_noise(facts);
    figures.before_rms = rms(before);
    figures.after_rms = rms(now);
    figures.after_max = now.cwiseAbs().maxCoeff();
    all.push_back(figures);
  }
  return all;
}

std::string verdict(const MechanismFacts& facts, const std::vector<MechanismFigures>& figures) {
  const discovery::SolverResult& result = facts.calibration.result;
  if (!facts.is_determined()) {
    return fmt::format("TOO FEW READINGS: {} of them check others, and {} combinations of parameters are free.",
                       result.residuals.size(), result.rank);
  }
  if (!facts.contradicting.empty() && !facts.robust) {
    const bool one = facts.contradicting.size() == 1;
    return fmt::format(
        "CONTRADICTED: {} of {} poses {} the others, and the parameters are made to fit {}, too. --robust leaves {} "
        "out.",
        facts.contradicting.size(), facts.measured.rows(), one ? "contradicts" : "contradict", one ? "it" : "them",
        one ? "it" : "them");
  }
  if (!result.converged()) {
    return fmt::format(
        "NOT CONVERGED: {}. Check units, signs and order of the columns, and the start values of the description.",
        result.reason);
  }
  const bool is_better =
      std::ranges::all_of(figures, [](const MechanismFigures& one) { return one.after_rms < one.before_rms; });
  if (!is_better)
    return "NO GAIN on poses held out: the description is as good as the calibration, or the poses are too few.";
  const bool is_partial = std::ranges::any_of(
      result.unidentifiable, [](const discovery::Combination& combination) { return combination.terms.size() > 1; });
  if (is_partial) {
    return fmt::format("CALIBRATED IN PART: the readings determine {} of {} combinations of the free parameters.",
                       result.rank, result.singular_values.size());
  }
  return "CALIBRATED.";
}

std::string measured_words(const MechanismFacts& facts) {
  const Eigen::VectorXd sigma = robotics::noise_of(facts.described, facts.measured);
  std::vector<std::string> words;
  for (Eigen::Index i = 0; i < sigma.size(); ++i) {
    if (!facts.measured.col(i).array().isFinite().any()) continue;
    words.push_back(facts.described.coordinates[i].name + (sigma(i) > 0.0 ? "" : " (exact)"));
  }
  return fmt::format("{}", fmt::join(words, ", "));
}

std::string error_rows(const MechanismFacts& facts, const std::vector<MechanismFigures>& figures, std::size_t width) {
  Table table({facts.before.of_outputs ? "output error" : "error", "unit", "as described, rms",
               facts.held_out ? "held out, rms" : "calibrated, rms", "max"});
  for (const MechanismFigures& one : figures) {
    table.add({one.of, one.unit, number(one.before_rms), number(one.after_rms), number(one.after_max)});
  }
  std::string text = table.text(width);
  if (!facts.before.of_outputs) {
    text += "contradiction: the noise of the readings that would explain why they contradict each other\n";
  }
  return text;
}

std::string parameter_rows(const MechanismFacts& facts, std::size_t width) {
  Table table({"parameter", "unit", "described", "identified", "standard error"});
  for (std::size_t k = 0; k < facts.described.parameters.size(); ++k) {
    const MechanismParameter& before = facts.described.parameters[k];
    const MechanismParameter& after = facts.calibration.mechanism.parameters[k];
    const std::string error = after.fixed            ? "fixed"
                              : after.standard_error ? number(*after.standard_error, 2)
                                                     : "not shown";
    table.add(
        {after.name, after.unit == "1" ? "" : after.unit, number(before.value, 8), number(after.value, 8), error});
  }
  return table.text(width);
}

std::string hidden_words(const discovery::SolverResult& result) {
  std::string alone;
  std::string text;
  for (const discovery::Combination& combination : result.unidentifiable) {
    if (combination.terms.size() == 1) {
      alone += (alone.empty() ? "" : ", ") + combination.names();
    } else {
      text +=
          fmt::format("Not shown by these readings: {}, which can change together. Fix one of them (fixed: true).\n",
                      combination.names());
    }
  }
  if (!alone.empty()) text += fmt::format("Not shown by these readings, kept as described: {}.\n", alone);
  return text;
}

}  // namespace

std::string mechanism_text(const MechanismFacts& facts, std::size_t width) {
  const discovery::SolverResult& result = facts.calibration.result;
  const std::vector<MechanismFigures> figures = figures_of(facts);
  const std::size_t contradicting = facts.robust ? facts.contradicting.size() : 0;
  const std::size_t left_out = facts.calibration.left_out.size() + contradicting;
  std::string text =
      fmt::format("{}: {} poses of {}{}; measured: {}\n\n", facts.data,
                  facts.measured.rows() + static_cast<Eigen::Index>(contradicting), facts.described.name,
                  left_out == 0 ? "" : fmt::format(", {} of them left out", left_out), measured_words(facts));
  text += verdict(facts, figures) + "\n\n";
  text += facts.held_out ? fmt::format("Held out: {} random folds.\n", facts.folds) : "";
  text += error_rows(facts, figures, width) + "\n" + parameter_rows(facts, width);
  text += "\n" + hidden_words(result);
  const std::string unit = unit_of_noise(facts);
  text += fmt::format("Noise of the readings, from what the fit leaves: {}{}\n", number(result.sigma),
                      unit == "sigma" ? " times the stated sigma"
                      : unit == "1"   ? ""
                                      : " " + unit);
  text += fmt::format(
      "Calibrability number cond2(J'J): {}; {} of {} combinations of free parameters are determined, {} degrees of "
      "freedom are left.\n",
      number(result.calibrability), result.rank, result.singular_values.size(), result.dof);
  return text;
}

Json mechanism_json(const MechanismFacts& facts) {
  const discovery::SolverResult& result = facts.calibration.result;
  Json json;
  json["mechanism"] = facts.file;
  json["data"] = facts.data;
  json["poses"] = facts.measured.rows();
  json["left_out"] = facts.calibration.left_out.size();
  json["contradicting_lines"] = facts.contradicting;
  json["robust"] = facts.robust;
  json["converged"] = result.converged();
  json["reason"] = result.reason;
  json["folds"] = facts.held_out ? facts.folds : 0;
  json["errors"] = Json::array();
  for (const MechanismFigures& one : figures_of(facts)) {
    json["errors"].push_back({{"of", one.of},
                              {"unit", one.unit},
                              {"described_rms", one.before_rms},
                              {facts.held_out ? "held_out_rms" : "calibrated_rms", one.after_rms},
                              {facts.held_out ? "held_out_max" : "calibrated_max", one.after_max}});
  }
  json["parameters"] = Json::array();
  for (std::size_t k = 0; k < facts.described.parameters.size(); ++k) {
    const MechanismParameter& after = facts.calibration.mechanism.parameters[k];
    json["parameters"].push_back(
        {{"name", after.name},
         {"unit", after.unit},
         {"described", facts.described.parameters[k].value},
         {"identified", after.value},
         {"standard_error", after.standard_error ? Json(*after.standard_error) : Json(nullptr)},
         {"fixed", after.fixed}});
  }
  json["not_shown"] = Json::array();
  for (const discovery::Combination& combination : result.unidentifiable)
    json["not_shown"].push_back(combination.names());
  json["noise"] = {{"value", result.sigma}, {"unit", unit_of_noise(facts)}};
  json["calibrability"] = result.calibrability;
  json["condition"] = result.condition_number;
  json["rank"] = result.rank;
  json["degrees_of_freedom"] = result.dof;
  return json;
}

std::string mechanism_errors_csv(const MechanismFacts& facts) {
  const MechanismErrors errors =
      facts.held_out ? *facts.held_out : robotics::errors_of(facts.calibration.mechanism, facts.measured);
  const auto& coordinates = facts.described.coordinates;
  std::vector<std::string> header;
  Eigen::MatrixXd values(facts.measured.rows(), 0);
  const auto add = [&](const std::string& name, const Eigen::VectorXd& column) {
    if (!column.array().isFinite().any()) return;
    header.push_back(name);
    values.conservativeResize(Eigen::NoChange, values.cols() + 1);
    values.rightCols(1) = column;
  };
  const auto with_unit = [](const std::string& name, const std::string& unit) {
    return unit == "1" ? name : name + "_" + unit;
  };
  for (std::size_t i = 0; i < coordinates.size(); ++i) {
    add(with_unit(coordinates[i].name, coordinates[i].unit), facts.measured.col(static_cast<Eigen::Index>(i)));
  }
  for (Eigen::Index i = 0; i < errors.values.cols(); ++i) {
    const std::string name =
        errors.of_outputs ? with_unit(coordinates[i].name + "_error", coordinates[i].unit) : "contradiction";
    add(name, errors.values.col(i));
  }
  std::string text = fmt::format("{}\n", fmt::join(header, ","));
  for (Eigen::Index row = 0; row < values.rows(); ++row) {
    for (Eigen::Index i = 0; i < values.cols(); ++i) {
      text +=
          fmt::format("{}{}", i > 0 ? "," : "", std::isfinite(values(row, i)) ? fmt::format("{}", values(row, i)) : "");
    }
    text += '\n';
  }
  return text;
}

}  // namespace llmt::report
