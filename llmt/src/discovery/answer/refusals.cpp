#include "discovery/answer/refusals.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <Eigen/QR>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <string>
#include <vector>

#include "discovery/recording/noise.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

// Rows beyond the unknowns, of which none fits by chance.
constexpr Eigen::Index fewest_rows_judged = 10;

using Chosen = std::vector<Eigen::Index>;

struct Affine {
  Eigen::VectorXd coefficients;  // the constant first
  bool is_exact = false;
};

Affine affine(const Eigen::MatrixXd& inputs, const Chosen& chosen, const Eigen::VectorXd& output) {
  const Eigen::Index k = std::ssize(chosen);
  Eigen::MatrixXd columns(inputs.rows(), k + 1);
  columns.col(0).setOnes();
  Eigen::VectorXd scales = Eigen::VectorXd::Ones(k + 1);
  for (Eigen::Index j = 0; j < k; ++j) {
    columns.col(j + 1) = inputs.col(chosen[j]);
    scales(j + 1) = columns.col(j + 1).cwiseAbs().maxCoeff();
    if (scales(j + 1) > 0.0) columns.col(j + 1) /= scales(j + 1);
  }
  Affine result;
  result.coefficients = columns.colPivHouseholderQr().solve(output);
  const double range = output.maxCoeff() - output.minCoeff();
  result.is_exact = (output - columns * result.coefficients).cwiseAbs().maxCoeff() <= digits_of_a_file * range;
  for (Eigen::Index j = 1; j <= k; ++j) {
    if (scales(j) > 0.0) result.coefficients(j) /= scales(j);
  }
  return result;
}

// "2 u1 - u2 + 0.5", without parts that are rounding.
std::string formula(const Affine& found, const Inputs& inputs, const Chosen& chosen) {
  std::string text;
  const auto add = [&](double coefficient, const std::string& name) {
    const double size = std::abs(coefficient);
    text += text.empty() ? (coefficient < 0.0 ? "-" : "") : (coefficient < 0.0 ? " - " : " + ");
    if (name.empty()) {
      text += fmt::format("{:.4g}", size);
    } else {
      text += std::abs(size - 1.0) < digits_of_a_file ? name : fmt::format("{:.4g} {}", size, name);
    }
  };
  double largest = 0.0;
  for (std::size_t j = 0; j < chosen.size(); ++j) {
    const double coefficient = found.coefficients(static_cast<Eigen::Index>(j) + 1);
    add(coefficient, inputs.names[chosen[j]]);
    largest = std::max(largest, std::abs(coefficient) * inputs.values.col(chosen[j]).cwiseAbs().maxCoeff());
  }
  if (std::abs(found.coefficients(0)) > digits_of_a_file * largest) add(found.coefficients(0), "");
  return text;
}

}  // namespace

void refuse_wrong(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured,
                  const MissingOptions& options) {
  const Eigen::Index n = inputs.values.rows();
  if (!simulation.predict) refuse("find_missing", "the simulation has no function predict");
  if (measured.values.rows() != n) {
    refuse("find_missing", fmt::format("{} rows of measured outputs for {} rows of inputs", measured.values.rows(), n));
  }
  if (measured.names.empty() || std::ssize(measured.names) != measured.values.cols()) {
    refuse("find_missing",
           fmt::format("{} names for {} measured outputs", measured.names.size(), measured.values.cols()));
  }
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    if (!measured.values.col(o).allFinite()) {
      refuse("find_missing", fmt::format("a measured value of \"{}\" is not finite", measured.names[o]));
    }
  }
  if (!(options.held_out_share >= 0.0 && options.held_out_share <= 0.9)) {
    refuse("find_missing", fmt::format("held_out_share is {}, must be within 0 ... 0.9", options.held_out_share));
  }
  if (options.rounds < 1) refuse("find_missing", fmt::format("rounds is {}, must be at least 1", options.rounds));
  constexpr Eigen::Index fewest = 50;
  if (options.largest_sample < fewest) {
    refuse("find_missing", fmt::format("largest_sample is {}, must be at least {}", options.largest_sample, fewest));
  }
}

void refuse_random(const Eigen::MatrixXd& first, const Eigen::MatrixXd& second,
                   const std::vector<std::string>& outputs) {
  constexpr double rounding = 1e-9;
  for (Eigen::Index o = 0; o < first.cols(); ++o) {
    const double most = rounding * first.col(o).cwiseAbs().maxCoeff();
    for (Eigen::Index i = 0; i < first.rows(); ++i) {
      if (!(std::abs(first(i, o) - second(i, o)) > most)) continue;
      throw RandomSimulation(
          fmt::format("llmt::discovery::find_missing: the simulation was run twice at the same values, and \"{}\" is "
                      "{:.6g} and then {:.6g} in data row {}; it must not be random: give its random numbers a seed",
                      outputs[static_cast<std::size_t>(o)], first(i, o), second(i, o), i + 1));
    }
  }
}

void refuse_determined(const Simulation& simulation, const Inputs& inputs, const MeasuredOutputs& measured) {
  const Eigen::Index p = inputs.values.cols();
  if (inputs.values.rows() < p + 1 + fewest_rows_judged) return;
  Chosen all(p);
  std::iota(all.begin(), all.end(), Eigen::Index{0});
  for (Eigen::Index o = 0; o < measured.values.cols(); ++o) {
    const Eigen::VectorXd output = measured.values.col(o);
    if (output.maxCoeff() == output.minCoeff() || !affine(inputs.values, all, output).is_exact) continue;
    Chosen chosen = all;
    for (const Eigen::Index j : all) {
      Chosen fewer = chosen;
      std::erase(fewer, j);
      if (affine(inputs.values, fewer, output).is_exact) chosen = fewer;
    }
    const Eigen::MatrixXd simulated = simulation.predict(inputs.values, values_of(simulation.parameters));
    // What has the wrong shape is refused by the search.
    if (simulated.rows() != output.size() || simulated.cols() != measured.values.cols()) return;
    if (!simulated.col(o).allFinite() || affine(inputs.values, chosen, simulated.col(o)).is_exact) continue;
    std::vector<std::string> names;
    for (const Eigen::Index j : chosen) names.push_back(fmt::format("\"{}\"", inputs.names[j]));
    refuse("find_missing",
           fmt::format("the measured \"{0}\" is {1} at every row, whatever the simulation says; {2} {3} no {4} of the "
                       "simulation: leave {5} out",
                       measured.names[o], formula(affine(inputs.values, chosen, output), inputs, chosen),
                       fmt::join(names, " and "), names.size() == 1 ? "is" : "are",
                       names.size() == 1 ? "input" : "inputs", names.size() == 1 ? "it" : "one of them"));
  }
}

}  // namespace llmt::discovery
