#include "discovery/answer/question.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

// Terms of the library that need not be tried because they stand among the found ones.
bool placed_already(const std::vector<PlacedTerm>& placed, std::size_t term, Eigen::Index output) {
  return std::ranges::any_of(placed, [&](const PlacedTerm& p) { return p.term == term && p.output == output; });
}

// `slot`: of equal terms with different constants, those in the same slot exclude each other.
EffectCandidate candidate_of(const TermModel& model, const TermData& data, const PlacedTerm& option,
                             const Eigen::MatrixXd& simulated, std::size_t slot, const InputNoise* noise) {
  const ModelTerm& term = model.terms()[option.term];
  EffectCandidate candidate;
  candidate.family = term.family;
  candidate.location = term.location;
  if (slot > 0) candidate.location += fmt::format("#{}", slot + 1);
  if (model.outputs().size() > 1) candidate.location += " on " + model.outputs()[option.output];
  candidate.signature = stacked_signature(model, data, option, simulated);
  candidate.lower = term.lower;
  candidate.upper = term.upper;
  if (term.whole) {
    // A search fits a coefficient: where it is far from 1, the constants are those of another function.
    constexpr double far = 2.0;
    candidate.lower = Eigen::VectorXd::Constant(candidate.signature.cols(), 1.0 / far);
    candidate.upper = Eigen::VectorXd::Constant(candidate.signature.cols(), far);
    candidate.family = "delay";  // a lag is another form of it: an output has one of them
  }
  candidate.generic = term.generic;
  candidate.prior_cost = option.prior_cost;
  candidate.complexity = term.complexity;
  if (noise != nullptr) candidate.moment_correction = noise->moment_correction(data, option, simulated);
  return candidate;
}

// Samples in time whose noise may be alike keep their signs together.
std::vector<Eigen::Index> clusters_of(const TermData& data) {
  std::vector<Eigen::Index> clusters;
  const auto length = static_cast<Eigen::Index>(std::ceil(2.0 / data.independent_share));
  if (data.stretches.empty() || data.independent_share >= 1.0) return clusters;
  Eigen::Index members = 0;
  for (std::size_t i = 0; i < data.stretches.size(); ++i) {
    const bool begins = i == 0 || data.stretches[i] != data.stretches[i - 1] || members == length;
    clusters.push_back(i == 0 ? 0 : clusters.back() + (begins ? 1 : 0));
    members = begins ? 1 : members + 1;
  }
  return clusters;
}

class Slots {
 public:
  std::size_t next(const TermModel& model, const PlacedTerm& option) {
    const std::vector<TermConstant>& constants = model.terms()[option.term].constants;
    if (constants.empty()) return 0;
    return used_[{option.term, option.output}]++ % static_cast<std::size_t>(std::max(1, constants.front().most));
  }

 private:
  std::map<std::pair<std::size_t, Eigen::Index>, std::size_t> used_;
};

Eigen::MatrixXd beside(const Eigen::MatrixXd& left, const Eigen::MatrixXd& right) {
  Eigen::MatrixXd both(left.rows(), left.cols() + right.cols());
  both << left, right;
  return both;
}

// In time, the constants of a simpler rival are those with which it stands best in the place of a term of the same
// inputs: beside that term it would only follow the noise. Independent rows find rivals in the first round.
class Rivals {
 public:
  Rivals(const TermModel& model, const TermData& data, const TermFit& fit, const std::vector<std::size_t>& outliers)
      : model_(&model), fit_(&fit), kept_(without_samples(data, outliers)) {
    if (data.stretches.empty()) return;
    for (std::size_t k = 0; k < fit.placed.size(); ++k) grounds_.push_back(ground_without(model, kept_, fit, k));
  }

  // Term t in the place of each less simple term of its inputs; of each as simple as well where one could stand for
  // several, as a hinge does for a hinge at the other side and a line.
  std::vector<PlacedTerm> options(std::size_t t, Eigen::Index output, const Eigen::MatrixXd& simulated) const {
    std::vector<PlacedTerm> all;
    for (std::size_t k = 0; k < grounds_.size(); ++k) {
      const PlacedTerm& placed = fit_->placed[k];
      const ModelTerm& term = model_->terms()[placed.term];
      const ModelTerm& other = model_->terms()[t];
      if (placed.output != output || term.inputs != other.inputs || placed.term == t) continue;
      const int limit = is_one_of_several(placed) ? term.complexity : term.complexity - 1;
      if (other.complexity > limit) continue;
      std::ranges::move(best_constants(*model_, kept_, grounds_[k], t, output, simulated, {}), std::back_inserter(all));
    }
    return all;
  }

 private:
  bool is_one_of_several(const PlacedTerm& placed) const {
    return std::ranges::any_of(fit_->placed, [&](const PlacedTerm& other) {
      return other.term != placed.term && other.output == placed.output &&
             model_->terms()[other.term].inputs == model_->terms()[placed.term].inputs;
    });
  }

  const TermModel* model_;
  const TermFit* fit_;
  TermData kept_;
  std::vector<TrialGround> grounds_;
};

}  // namespace

TrialGround ground_without(const TermModel& model, const TermData& data, const TermFit& fit, std::size_t t) {
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  const PlacedTerm& placed = fit.placed[t];
  TrialGround ground{scaled_residuals(model, data, fit.parameters, fit.placed),
                     baseline_jacobian(model, data, fit.parameters, fit.placed)};
  ground.residuals += stacked_signature(model, data, placed, simulated) * placed.coefficients;
  for (std::size_t k = 0; k < fit.placed.size(); ++k) {
    if (k != t) ground.nuisance = beside(ground.nuisance, stacked_signature(model, data, fit.placed[k], simulated));
  }
  return ground;
}

TermQuestion ask(const TermModel& model, const TermData& data, const TermFit& fit,
                 const std::vector<Eigen::Index>& repeats, const std::vector<std::size_t>& outliers, bool with_history,
                 const InputNoise* noise) {
  TermQuestion question;
  const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
  const auto d = data.measured.cols();
  TrialGround ground{scaled_residuals(model, data, fit.parameters, fit.placed),
                     baseline_jacobian(model, data, fit.parameters, fit.placed)};
  question.evidence.jacobian = ground.nuisance;
  question.evidence.residuals = ground.residuals;
  question.evidence.components = d;
  question.evidence.repeats = repeats;
  question.evidence.independent_share = data.independent_share;
  question.evidence.clusters = clusters_of(data);
  Slots slots;
  for (const PlacedTerm& placed : fit.placed) {
    question.options.push_back(placed);
    question.candidates.push_back(candidate_of(model, data, placed, simulated, slots.next(model, placed), noise));
    question.evidence.residuals += question.candidates.back().signature * placed.coefficients;
    ground.nuisance = beside(ground.nuisance, question.candidates.back().signature);
  }
  for (const std::size_t sample : outliers) ground.residuals.segment(sample * d, d).setZero();
  const Rivals rivals(model, data, fit, outliers);
  std::vector<PlacedTerm> of_regimes;
  double trials_of_regimes = 0.0;
  std::vector<PlacedTerm> of_states;
  double trials_of_states = 0.0;
  for (std::size_t t = 0; t < model.terms().size(); ++t) {
    const ModelTerm& term = model.terms()[t];
    if (model.is_refuted(t)) continue;
    if (!term.inner_state.empty() && data.stretches.empty()) continue;  // a state is of the time
    // In time the row before holds the noise of a neighbour, and is otherwise what inputs and their rates say.
    if (term.history && !(with_history && data.stretches.empty())) continue;
    for (Eigen::Index o = 0; o < d; ++o) {
      if (!term.output.empty() && term.output != model.outputs()[o]) continue;
      std::vector<PlacedTerm> options;
      if (!term.constants.empty()) {
        options = best_constants(model, data, ground, t, o, simulated, fit.placed);
        if (!term.regime.empty()) {
          trials_of_regimes += static_cast<double>(term.constants.front().tried.size());
          std::ranges::move(options, std::back_inserter(of_regimes));
          continue;
        }
        if (ColumnCache::is_state_of_inputs(term)) {
          trials_of_states += 1.0;
          std::ranges::move(options, std::back_inserter(of_states));
          continue;
        }
        for (PlacedTerm& option : rivals.options(t, o, simulated)) options.push_back(std::move(option));
      } else if (!placed_already(fit.placed, t, o)) {
        options.push_back({t, o, {}, Eigen::VectorXd::Zero(std::ssize(term.coefficients)), 0.0});
      }
      for (PlacedTerm& option : options) {
        question.candidates.push_back(candidate_of(model, data, option, simulated, slots.next(model, option), noise));
        question.options.push_back(std::move(option));
      }
    }
  }
  // Of many that are alike only those compete that explain most; each is the best of so many.
  const auto add_best = [&](std::vector<PlacedTerm> options, std::size_t most, double trials) {
    std::ranges::stable_sort(options, std::greater<>{}, &PlacedTerm::explained);
    options.resize(std::min(most, options.size()));
    for (PlacedTerm& option : options) {
      option.prior_cost += 2.0 * std::log(trials / static_cast<double>(options.size()));
      refine_regime(model, data, ground, simulated, option);
      question.candidates.push_back(candidate_of(model, data, option, simulated, slots.next(model, option), noise));
      question.options.push_back(std::move(option));
    }
  };
  constexpr std::size_t most_of_regimes = 20;
  constexpr std::size_t most_of_states = 5;
  // The constants are counted among the trials.
  for (PlacedTerm& option : of_regimes) option.prior_cost = model.terms()[option.term].prior_cost;
  add_best(std::move(of_regimes), most_of_regimes, trials_of_regimes);
  add_best(std::move(of_states), most_of_states, trials_of_states);
  return question;
}

bool retry_constants(const TermModel& model, const TermData& kept, const TermData& data, TermFit& fit) {
  bool changed = false;
  for (std::size_t t = 0; t < fit.placed.size(); ++t) {
    PlacedTerm& placed = fit.placed[t];
    if (placed.constants.size() == 0) continue;
    const std::vector<TermConstant>& constants = model.terms()[placed.term].constants;
    const Eigen::MatrixXd simulated = model.simulated(fit.parameters);
    const TermData& own = constants.back().smooth ? kept : data;
    const TrialGround ground = ground_without(model, own, fit, t);
    std::vector<PlacedTerm> best = best_constants(model, own, ground, placed.term, placed.output, simulated, {});
    if (best.empty()) continue;
    refine_regime(model, own, ground, simulated, best.front());
    const Eigen::VectorXd values = placed.constants;
    for (Eigen::Index c = 0; c < values.size(); ++c) {
      const double moved = std::abs(best.front().constants(c) - values(c));
      const double step = constants[c].smooth ? spacing(constants[c].tried, values(c)) : 0.0;
      if (!(moved > 2.0 * step)) continue;
      placed.constants = best.front().constants;
      changed = true;
    }
  }
  return changed;
}

void set_trial_errors(const TermModel& model, const TermData& data, TermFit& fit) {
  for (std::size_t t = 0; t < fit.placed.size(); ++t) {
    const PlacedTerm& placed = fit.placed[t];
    for (Eigen::Index c = 0; c < placed.constants.size(); ++c) {
      if (model.terms()[placed.term].constants[static_cast<std::size_t>(c)].smooth) continue;
      fit.errors[t](placed.coefficients.size() + c) =
          trial_error(model, data, ground_without(model, data, fit, t), placed, c, model.simulated(fit.parameters));
    }
  }
}

}  // namespace llmt::discovery
