// The parts that the library's terms are made of.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// One input as terms see it.
struct InputView {
  Eigen::Index column = 0;
  std::string name;
  double low = 0.0;
  double high = 0.0;
  std::vector<double> distinct;  // ascending

  double range() const { return high - low; }
};

/// Coefficient times function(value of one input). `code` is its ModelTerm::code.
ModelTerm function_term(const InputView& input, std::string family, std::string formula, std::string per,
                        double (*function)(double), std::string code);

/// Coefficients times columns that depend on one input and a constant that is searched; `code` is their
/// ModelTerm::code.
ModelTerm searched_term(const InputView& input, std::string family, std::string formula,
                        std::vector<std::string> coefficients, std::string per, TermConstant constant,
                        std::function<Eigen::MatrixXd(const Eigen::ArrayXd& x, double constant)> columns,
                        std::vector<std::string> code);

/// Shapes that carry "unknown".
std::vector<ModelTerm> shapes_of(const std::vector<InputView>& inputs);

/// Terms with a constant that is searched, of one input.
std::vector<ModelTerm> searched_terms(const InputView& input);

/// Laws of one input that contain simpler terms: sigmoid, Hill's law, powers, Coulomb's and Stribeck's friction, a
/// limit on both sides, a dead band.
std::vector<ModelTerm> law_terms(const InputView& input);

/// Friction that grows with the simulated output or with another input.
std::vector<ModelTerm> load_frictions(const std::vector<InputView>& inputs);

/// Terms of the row before, of inputs of at least three values.
std::vector<ModelTerm> sequence_terms(const InputView& input, const std::string& order);

/// Midpoints between neighbouring values with at least `beyond` values on both sides, at most `count`.
std::vector<double> thresholds(const std::vector<double>& distinct, std::size_t beyond, std::size_t count);

}  // namespace llmt::discovery
