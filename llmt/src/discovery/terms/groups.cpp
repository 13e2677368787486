#include "discovery/terms/groups.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "discovery/search/workspace.hpp"
#include "discovery/terms/cross_validation.hpp"
#include "discovery/terms/decision.hpp"
#include "discovery/terms/term_question.hpp"

namespace llmt::discovery {
namespace {

constexpr double absorbed = 1e-3;  // as in hold()
constexpr double rank_tolerance = 1e-9;

// What a term explains of the residuals beyond the nuisance, and what is left then.
struct InPlace {
  PlacedTerm placed;
  Eigen::VectorXd function;
  double left = 0.0;
  double numbers = 0.0;
};

class Ground {
 public:
  explicit Ground(TrialGround ground)
      : basis_(range_basis(ground.nuisance, rank_tolerance)), ground_(std::move(ground)) {
    residuals_ = ground_.residuals - basis_ * (basis_.transpose() * ground_.residuals);
  }

  const TrialGround& ground() const { return ground_; }

  InPlace with(const TermModel& model, const TermData& data, PlacedTerm placed,
               const Eigen::MatrixXd& simulated) const {
    Eigen::MatrixXd columns = stacked_signature(model, data, placed, simulated);
    const Eigen::RowVectorXd norms = columns.colwise().norm();
    columns -= basis_ * (basis_.transpose() * columns);
    for (Eigen::Index c = 0; c < columns.cols(); ++c) {
      if (columns.col(c).norm() < absorbed * norms(c)) columns.col(c).setZero();
    }
    const Eigen::MatrixXd range = range_basis(columns, rank_tolerance);
    const auto numbers = static_cast<double>(range.cols() + placed.constants.size());
    Eigen::VectorXd function = range * (range.transpose() * residuals_);
    const double left = (residuals_ - function).squaredNorm();
    return {std::move(placed), std::move(function), left, numbers};
  }

 private:
  Eigen::MatrixXd basis_;
  TrialGround ground_;
  Eigen::VectorXd residuals_;
};

bool may_stand_for_another(const ModelTerm& term) {
  return !term.generic && !term.history && !term.whole && term.inner_state.empty() && term.regime.empty();
}

std::string name_of(const ModelTerm& term) {
  return term.location.empty() ? term.family : term.family + " " + term.location;
}

// "x = 0.3, dx = -1.2", of the inputs of both terms.
std::string where(const TermModel& model, const ModelTerm& own, const ModelTerm& other, Eigen::Index row) {
  std::vector<std::string> inputs = own.inputs;
  for (const std::string& name : other.inputs) {
    if (std::ranges::find(inputs, name) == inputs.end()) inputs.push_back(name);
  }
  std::string text;
  for (const std::string& name : inputs) {
    text += fmt::format("{}{} = {:.3g}", text.empty() ? "" : ", ", name, model.input(name)(row));
  }
  return text;
}

// The likeliest of the members that are not named yet; of many the others say no more.
void add_rivals(std::vector<std::pair<double, RivalTerms>> members, FoundTerm& found) {
  constexpr std::size_t most = 8;
  std::ranges::stable_sort(members, {}, &std::pair<double, RivalTerms>::first);
  for (auto& [evidence, member] : members) {
    const auto is_named = [&name = member.what](const RivalTerms& rival) {
      return rival.what == name || rival.what.starts_with(name + " (");  // with its constant
    };
    if (found.rivals.size() >= most) break;
    if (std::ranges::none_of(found.rivals, is_named)) found.rivals.push_back(std::move(member));
  }
}

}  // namespace

void name_groups(const TermModel& model, const TermData& data, const TermFit& fit, Missing& missing) {
  constexpr double hardly = 0.02;
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  const double samples = data.independent_share * static_cast<double>(data.samples.size());
  for (std::size_t k = 0; k < fit.placed.size(); ++k) {
    const ModelTerm& own_term = model.terms()[fit.placed[k].term];
    if (!may_stand_for_another(own_term)) continue;
    const Ground place(ground_without(model, data, fit, k));
    const InPlace own = place.with(model, data, fit.placed[k], simulated);
    FoundTerm& found = missing.found[k];
    const Eigen::Index output = fit.placed[k].output;
    std::vector<std::pair<double, RivalTerms>> members;  // with the evidence against each
    double farthest = same_function;
    std::optional<InPlace> differing;
    for (std::size_t t = 0; t < model.terms().size(); ++t) {
      const ModelTerm& term = model.terms()[t];
      if (t == fit.placed[k].term || !may_stand_for_another(term)) continue;
      if (!term.output.empty() && term.output != model.outputs()[output]) continue;
      std::vector<PlacedTerm> options;
      if (term.constants.empty()) {
        options.push_back({t, output, {}, Eigen::VectorXd::Zero(std::ssize(term.coefficients)), 0.0});
      } else {
        options = best_constants(model, data, place.ground(), t, output, simulated, {});
      }
      for (PlacedTerm& option : options) {
        const InPlace other = place.with(model, data, std::move(option), simulated);
        const double evidence =
            0.5 * samples * std::log(other.left / own.left) + 0.5 * (other.numbers - own.numbers) * std::log(samples);
        const double difference = (other.function - own.function).norm() / own.function.norm();
        const bool contains_it = other.numbers > own.numbers && difference < hardly;
        if (!(evidence <= likelihood_margin) || contains_it) continue;
        members.push_back({evidence, {.what = name_of(term), .inputs = term.inputs, .exact = false}});
        if (difference > farthest) {
          farthest = difference;
          differing = other;
        }
      }
    }
    add_rivals(std::move(members), found);
    if (!differing) continue;
    Eigen::Index place_of_most = 0;
    (differing->function - own.function).cwiseAbs().maxCoeff(&place_of_most);
    const Eigen::Index row = data.samples.rows_of(place_of_most / data.measured.cols()).front();
    const ModelTerm& other = model.terms()[differing->placed.term];
    missing.notes.push_back(fmt::format(
        "{} is tentative: {} explains these rows as well and differs from it by {:.0f} % of what it adds, most at {}; "
        "rows like that one tell them apart",
        name_of(own_term), name_of(other), 100.0 * farthest, where(model, own_term, other, row)));
    object(missing, Reason::rival, {k});
  }
  decide(missing);
}

}  // namespace llmt::discovery
