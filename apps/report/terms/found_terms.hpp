/// \file
/// What was found missing, as `llmt discover --json` writes it, read back: applied to other rows, and written as code.
#pragma once

#include <cmath>
#include <limits>
#include <map>
#include <string>
#include <vector>

#include "llmt/discovery/model_term.hpp"
#include "report/terms/expression_code.hpp"
#include "report/text/json.hpp"

namespace llmt::report {

/// The terms and changes of parameters in such an object.
struct FoundTerms {
  struct Input {
    std::string name;
    std::string word;  ///< what expressions call it
    double low = 0.0;  ///< of the rows that were searched
    double high = 0.0;
    double zero_band = 0.0;  ///< the input counts as 0 where its absolute value is smaller
  };
  struct Output {
    std::string name;
    std::string word;     ///< what expressions call its simulated value
    double offset = 0.0;  ///< what the simulation was allowed to adjust: offset + scale * simulated
    double scale = 1.0;
    /// What all terms add together is held between these: one of them is not certain. Infinite: it is not.
    double terms_low = -std::numeric_limits<double>::infinity();
    double terms_high = std::numeric_limits<double>::infinity();
    bool is_held() const { return std::isfinite(terms_low) || std::isfinite(terms_high); }
  };
  struct Term {
    std::string title;
    std::string family;
    std::string location;
    std::size_t output = 0;
    std::string expression;       ///< of the whole term; empty: there is none, as for terms of the row before
    std::vector<double> values;   ///< coefficients, then constants
    bool is_inner_state = false;  ///< it depends on the past of signals
  };
  struct Change {
    std::string parameter;
    std::string unit;
    double change = 0.0;
    Json value;  ///< where the nominal value is known, else null
  };
  std::string file;
  std::vector<Input> inputs;
  std::vector<Output> outputs;
  std::string order;  ///< as discovery::Inputs::order
  std::string time;   ///< column with the times of rows in time; may be empty
  std::string group;  ///< column with their runs; may be empty
  double step = 0.0;  ///< of the times of the search; 0: not known
  std::vector<Term> terms;
  std::vector<Change> changes;  ///< of parameters of the simulation
  /// The verdict of a search that has found nothing to be added, discovery::may_be_applied(); then there are no terms
  /// and no changes. Empty: there is something.
  std::string refused;
  /// The verdict is that an effect is unknown: the terms are fitted functions of what was seen, no laws. Beyond the
  /// rows that were searched their inputs count as low or high.
  bool is_held = false;

  std::vector<std::string> input_names() const;
  std::vector<std::string> output_names() const;
  /// Whether a term depends on when rows were taken.
  bool needs_time() const;
};

/// When each row was taken, and in which run; empty: row by row, one run.
struct RowTimes {
  Eigen::VectorXd instants;
  std::vector<Eigen::Index> runs;
};

/// Throws std::runtime_error that names `file` and what is wrong in it.
FoundTerms found_terms(const std::string& json, const std::string& file);
FoundTerms found_terms(const Json& json, const std::string& file);

/// The simulated outputs (n x d) with what was found, at the rows of inputs (columns as in FoundTerms::inputs).
/// `derivatives`: n x d by each parameter, as far as its change is to be added. `times`: for terms of the past. Throws
/// std::runtime_error that names a term without an expression, one that is not finite at a row, or one of the past that
/// times do not allow: none, equal ones within a run, or a step more than 50 times that of the search or less than a
/// fiftieth, as of another unit.
Eigen::MatrixXd apply(const FoundTerms& found, const Eigen::MatrixXd& inputs, const Eigen::MatrixXd& simulated,
                      const std::map<std::string, Eigen::MatrixXd>& derivatives = {}, const RowTimes& times = {});

/// The numbers of values of each input that lie outside of what was searched, in a sentence each.
std::vector<std::string> outside_sentences(const FoundTerms& found, const Eigen::MatrixXd& inputs);

/// A function `correction` of the inputs in the language, whose value is what is to be added to the simulated output;
/// `correction_OUTPUT` for each of several. Changes of parameters stand in a comment. Throws std::runtime_error that
/// names a term that no function of one row can be.
std::string correction_code(const FoundTerms& found, CodeLanguage language);

}  // namespace llmt::report
