#include <algorithm>
#include <iterator>

#include "report/terms/terms_summary.hpp"

namespace llmt::report {

std::vector<discovery::ModelTerm> library_terms(const discovery::Inputs& inputs, const Eigen::MatrixXd& simulated,
                                                const std::vector<std::string>& outputs,
                                                std::vector<discovery::UntestableCause>& untestable) {
  std::vector<discovery::ModelTerm> library = discovery::standard_terms(inputs, &untestable);
  std::ranges::move(discovery::regime_terms(inputs, library), std::back_inserter(library));
  std::ranges::move(discovery::inner_state_terms(inputs, simulated, outputs), std::back_inserter(library));
  return library;
}

std::vector<discovery::ModelTerm> with_own_terms(std::vector<discovery::ModelTerm> library,
                                                 std::vector<discovery::ModelTerm> own, bool own_only,
                                                 const discovery::Rows& rows) {
  for (discovery::ModelTerm& term : discovery::without_duplicates(std::move(library), own, rows)) {
    if (!own_only || term.generic) own.push_back(std::move(term));
  }
  return own;
}

}  // namespace llmt::report
