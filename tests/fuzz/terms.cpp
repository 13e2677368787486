// Files of terms: what is read has values at the rows.
#include <cmath>
#include <set>
#include <stdexcept>

#include "fuzz/fuzz.hpp"
#include "trees/term_file.hpp"

namespace fuzz_terms {
namespace {

struct Table {
  llmt::discovery::Inputs inputs;
  llmt::discovery::Rows rows;
};

Table table() {
  Table result;
  result.inputs.names = {"t", "a", "load", "no word", "pi2"};
  result.inputs.values.resize(4, 5);
  result.inputs.values << 0, 1, 2, 3, 4, 1, -1, 0.5, 3, 4, 2, 7, 1e-3, 3, 4, 3, 0, -2, 5, 6;
  result.rows = llmt::discovery::rows_of(result.inputs, Eigen::Vector4d(1.0, -2.0, 0.25, 0.0));
  return result;
}

}  // namespace

FUZZ_TARGET(terms) {
  static const Table rows = table();
  try {
    std::set<std::string> names;
    for (const llmt::discovery::ModelTerm& term :
         llmt::apps::parse_terms(fuzz::text_of(data, size), "t", rows.inputs, "y", rows.rows, {"square"})) {
      fuzz::require(names.insert(term.family).second && term.family != "square", "names are unique");
      const Eigen::MatrixXd first = term.columns(rows.rows, {});
      fuzz::require(first.allFinite(), "values are finite");
      fuzz::require(term.columns(rows.rows, {}) == first, "a term has the same values each time");
    }
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("t:"), fmt::format("'{}' names the file", error.what()));
  }
  return 0;
}

}  // namespace fuzz_terms
