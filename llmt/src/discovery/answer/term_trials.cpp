// Constants of terms, found by trying.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "discovery/answer/term_fit.hpp"
#include "discovery/search/workspace.hpp"
#include "discovery/terms/term_model.hpp"

namespace llmt::discovery {
namespace {

// Fast columns are judged by rows that stand nearer in time.
constexpr double smallest_share_kept = 0.3;
// A term that a handful of samples carry, at the end of a range, says more of these samples than of a cause.
constexpr double fewest_carriers = 3.0;
// Neighbours in time share their errors.
constexpr double fewest_carriers_in_time = 8.0;

// The sum of squares that a term explains at one constant, beyond the nuisance.
class Trials {
 public:
  Trials(const TermModel& model, const TermData& data, const TrialGround& ground, PlacedTerm placed,
         const Eigen::MatrixXd& simulated)
      : model_(&model),
        data_(&data),
        placed_(std::move(placed)),
        simulated_(&simulated),
        fewest_carriers_(data.stretches.empty() ? fewest_carriers : fewest_carriers_in_time) {
    const Eigen::Index d = data.measured.cols();
    const Eigen::Index n = data.measured.rows();
    const auto own = Eigen::seqN(placed_.output, n, d);
    const ModelTerm& term = model.terms()[placed_.term];
    weights_ = weights_of(data, placed_.output);
    const Eigen::MatrixXd nuisance = ground.nuisance(own, Eigen::all);
    const Eigen::Index powers = 1 + term.constants.front().beyond;
    Eigen::MatrixXd all(n, nuisance.cols() + powers);
    all.leftCols(nuisance.cols()) = nuisance;
    for (Eigen::Index p = 0; p < powers; ++p) all.col(nuisance.cols() + p) = weights_.cwiseProduct(power(term, p));
    constexpr double rounding = 1e-9;
    basis_ = range_basis(all, rounding);
    residuals_ = ground.residuals(own);
    residuals_ -= basis_ * (basis_.transpose() * residuals_);
  }

  /// From now on, as if nothing had been filtered.
  void be_coarse() { is_coarse_ = true; }

  double gain(const Eigen::VectorXd& constants) {
    placed_.constants = constants;
    const bool is_coarse =
        is_coarse_ && data_->samples.is_filtered() && model_->terms()[placed_.term].inner_state.empty();
    if (is_coarse) return gain_of(model_->columns_at(placed_, *simulated_, data_->samples.rows()));
    const Eigen::MatrixXd of_rows = model_->columns(placed_, *simulated_);
    const Eigen::MatrixXd columns = means(of_rows, data_->samples);
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      if (share_kept(of_rows.col(k), columns.col(k), data_->samples) < smallest_share_kept) return 0.0;
    }
    return gain_of(columns);
  }

  /// At all values tried, coarsely.
  std::vector<double> coarse_gains(const std::vector<Eigen::VectorXd>& tried) {
    std::vector<double> gains;
    be_coarse();
    if (!data_->samples.is_filtered() || model_->shared() == nullptr ||
        !ColumnCache::holds_grid(model_->terms()[placed_.term])) {
      for (const Eigen::VectorXd& values : tried) gains.push_back(gain(values));
      return gains;
    }
    const bool is_state = ColumnCache::is_state_of_inputs(model_->terms()[placed_.term]);
    const auto columns_of = [&](const Samples& samples) {
      const Eigen::Index width = placed_.coefficients.size();
      Eigen::MatrixXd all(samples.size(), width * std::ssize(tried));
      for (std::size_t k = 0; k < tried.size(); ++k) {
        placed_.constants = tried[k];
        all.middleCols(static_cast<Eigen::Index>(k) * width, width) =
            is_state ? means(model_->columns(placed_, *simulated_), samples)
                     : model_->columns_at(placed_, *simulated_, samples.rows());
      }
      return all;
    };
    const Eigen::MatrixXd grid = model_->shared()->grid_at(data_->samples, placed_.term, tried, columns_of);
    const Eigen::Index width = placed_.coefficients.size();
    for (std::size_t k = 0; k < tried.size(); ++k) {
      gains.push_back(gain_of(grid.middleCols(static_cast<Eigen::Index>(k) * width, width)));
    }
    return gains;
  }

  double gain_of(Eigen::MatrixXd columns) const {
    if (!columns.allFinite()) return 0.0;
    columns = weights_.asDiagonal() * columns;
    for (Eigen::Index k = 0; k < columns.cols(); ++k) {
      if (carriers(columns.col(k)) < fewest_carriers_) return 0.0;
    }
    if (model_->terms()[placed_.term].whole) {
      const Eigen::VectorXd whole = columns.rowwise().sum() / data_->sigma(placed_.output);
      const Eigen::VectorXd own = whole - basis_ * (basis_.transpose() * whole);
      return std::max(0.0, 2.0 * own.dot(residuals_) - own.squaredNorm());
    }
    const Eigen::VectorXd norms = columns.colwise().norm();
    if (!(norms.minCoeff() > 0.0)) return 0.0;
    columns *= norms.cwiseInverse().asDiagonal();
    columns -= basis_ * (basis_.transpose() * columns);
    // A column that hardly differs from the nuisance explains only by chance.
    constexpr double outside = 0.02;
    const Eigen::LLT<Eigen::MatrixXd> factor(columns.transpose() * columns);
    const Eigen::MatrixXd lower = factor.matrixL();
    if (factor.info() != Eigen::Success || lower.diagonal().minCoeff() < outside) return 0.0;
    return factor.matrixL().solve(columns.transpose() * residuals_).squaredNorm();
  }

  double sum_of_squares() const { return residuals_.squaredNorm(); }

  const PlacedTerm& at(const Eigen::VectorXd& constants) {
    placed_.constants = constants;
    return placed_;
  }

 private:
  const TermModel* model_;
  const TermData* data_;
  PlacedTerm placed_;
  const Eigen::MatrixXd* simulated_;
  double fewest_carriers_;
  bool is_coarse_ = false;
  Eigen::VectorXd weights_;
  Eigen::MatrixXd basis_;
  Eigen::VectorXd residuals_;

  // x^p of the first input, x within -1 ... 1; ones if the term has no input.
  Eigen::VectorXd power(const ModelTerm& term, Eigen::Index p) const {
    const Eigen::Index n = data_->measured.rows();
    if (p == 0 || term.inputs.empty()) return Eigen::VectorXd::Ones(n);
    const Eigen::VectorXd x = means(model_->input(term.inputs.front()), data_->samples);
    const double middle = 0.5 * (x.minCoeff() + x.maxCoeff());
    const double half = std::max(smallest_divisor, 0.5 * (x.maxCoeff() - x.minCoeff()));
    return ((x.array() - middle) / half).pow(static_cast<double>(p)).matrix();
  }
};

// Every value of each constant with every value of the others, or of the last with the one at which that is held.
std::vector<Eigen::VectorXd> combinations(const std::vector<TermConstant>& constants, std::optional<double> held) {
  std::vector<Eigen::VectorXd> all = {Eigen::VectorXd(std::ssize(constants))};
  for (std::size_t c = 0; c < constants.size(); ++c) {
    const bool is_held = held && c > 0 && c + 1 == constants.size();
    const std::vector<double> tried = is_held ? std::vector<double>{*held} : constants[c].tried;
    std::vector<Eigen::VectorXd> longer;
    for (const Eigen::VectorXd& values : all) {
      for (const double value : tried) {
        longer.push_back(values);
        longer.back()(static_cast<Eigen::Index>(c)) = value;
      }
    }
    all = std::move(longer);
  }
  return all;
}

// Halving steps between the neighbours of the values tried; of several constants in turn.
Eigen::VectorXd refined(Trials& trials, const std::vector<TermConstant>& constants, Eigen::VectorXd values,
                        double gain) {
  const int sweeps = constants.size() > 1 ? 3 : 1;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    for (Eigen::Index c = 0; c < values.size(); ++c) {
      const std::vector<double>& tried = constants[c].tried;
      if (!constants[c].smooth) continue;
      const double step = spacing(tried, values(c));
      for (double width = 0.5 * step; width > 0.01 * step; width *= 0.5) {
        const double centre = values(c);
        for (const double trial : {centre - width, centre + width}) {
          if (trial < tried.front() || trial > tried.back()) continue;
          Eigen::VectorXd moved = values;
          moved(c) = trial;
          const double own = trials.gain(moved);
          if (own > gain) {
            gain = own;
            values = moved;
          }
        }
      }
    }
  }
  return values;
}

// The best of the places between the neighbours of a threshold, the last of the constants, which few were tried of. 0
// costs no number: it stands where another place gains less than a number of n rows costs, ln n of the mean square that
// is left.
void refine_threshold(Trials& trials, const std::vector<double>& tried, Eigen::VectorXd& values, double gain,
                      double n) {
  constexpr int places = 40;
  double& threshold = values(values.size() - 1);
  const auto above = std::ranges::upper_bound(tried, threshold);
  const auto below = std::ranges::lower_bound(tried, threshold);
  const double low = below == tried.begin() ? threshold : *(below - 1);
  const double high = above == tried.end() ? threshold : *above;
  double best = threshold;
  for (int k = 1; k < places; ++k) {
    threshold = low + (high - low) * k / places;
    const double own = trials.gain(values);
    if (!(own > gain)) continue;
    gain = own;
    best = threshold;
  }
  threshold = 0.0;
  const bool has_zero = tried.front() < 0.0 && 0.0 < tried.back();
  const double left = std::max(0.0, trials.sum_of_squares() - gain);
  if (!has_zero || !(gain - trials.gain(values) < left * std::log(n) / n)) threshold = best;
}

}  // namespace

double trial_error(const TermModel& model, const TermData& data, const TrialGround& ground, const PlacedTerm& placed,
                   Eigen::Index constant, const Eigen::MatrixXd& simulated) {
  const std::vector<double>& tried = model.terms()[placed.term].constants[static_cast<std::size_t>(constant)].tried;
  Trials trials(model, data, ground, placed, simulated);
  const double value = placed.constants(constant);
  const auto gain = [&](double other) {
    Eigen::VectorXd moved = placed.constants;
    moved(constant) = other;
    return trials.gain(moved);
  };
  const double best = gain(value);
  const double variance = std::max(0.0, trials.sum_of_squares() - best) / static_cast<double>(data.samples.size());
  const auto place = static_cast<Eigen::Index>(std::ranges::lower_bound(tried, value) - tried.begin());
  double error = spacing(tried, value);
  for (const Eigen::Index direction : {-1, 1}) {
    for (Eigen::Index k = place; k >= 0 && k < std::ssize(tried); k += direction) {
      const double other = tried[k];
      error = std::max(error, std::abs(other - value));
      if (best - gain(other) > variance) break;
    }
  }
  return error;
}

std::vector<PlacedTerm> best_constants(const TermModel& model, const TermData& data, const TrialGround& ground,
                                       std::size_t term, Eigen::Index output, const Eigen::MatrixXd& simulated,
                                       const std::vector<PlacedTerm>& taken, std::optional<double> threshold) {
  const ModelTerm& own = model.terms()[term];
  const TermConstant& constant = own.constants.front();
  const std::vector<Eigen::VectorXd> tried = combinations(own.constants, threshold);
  PlacedTerm placed{.term = term,
                    .output = output,
                    .constants = {},
                    .coefficients = Eigen::VectorXd::Zero(std::ssize(own.coefficients)),
                    .prior_cost = own.prior_cost + 2.0 * std::log(static_cast<double>(tried.size()))};
  Trials trials(model, data, ground, placed, simulated);
  const std::vector<double> gains = trials.coarse_gains(tried);
  std::vector<std::size_t> order(gains.size());
  for (std::size_t k = 0; k < order.size(); ++k) order[k] = k;
  std::ranges::stable_sort(order, std::greater<>{}, [&](std::size_t k) { return gains[k]; });
  std::vector<PlacedTerm> best;
  std::vector<double> places;
  for (const PlacedTerm& other : taken) {
    if (other.term == term && other.output == output) places.push_back(other.constants(0));
  }
  const auto near = [&](double value, double place) {
    constexpr double apart = 2.5;  // steps
    return std::abs(value - place) < apart * std::max(spacing(constant.tried, value), spacing(constant.tried, place));
  };
  for (const std::size_t k : order) {
    if (std::ssize(best) >= constant.kept || !(gains[k] > 0.0)) break;
    const double value = tried[k](0);
    if (std::ranges::any_of(places, [&](double place) { return near(value, place); })) continue;
    places.push_back(value);
    Eigen::VectorXd constants = tried[k];
    // A state of the inputs takes all rows to compute, and its constants are fitted with everything else.
    if (constant.smooth && !ColumnCache::is_state_of_inputs(own)) {
      constants = refined(trials, own.constants, constants, gains[k]);
    } else if (!constant.smooth && own.constants.size() == 1 && constant.tried.size() > 1) {
      refine_threshold(trials, constant.tried, constants, gains[k], static_cast<double>(data.samples.size()));
    }
    best.push_back(trials.at(constants));
    best.back().explained = gains[k];
  }
  return best;
}

void refine_regime(const TermModel& model, const TermData& data, const TrialGround& ground,
                   const Eigen::MatrixXd& simulated, PlacedTerm& placed) {
  const ModelTerm& own = model.terms()[placed.term];
  if (own.regime.empty() || own.constants.size() < 2) return;
  Trials trials(model, data, ground, placed, simulated);
  trials.be_coarse();
  constexpr int sweeps = 2;
  for (int sweep = 0; sweep < sweeps; ++sweep) {
    refine_threshold(trials, own.constants.back().tried, placed.constants, trials.gain(placed.constants),
                     static_cast<double>(data.samples.size()));
    placed.constants = refined(trials, own.constants, placed.constants, trials.gain(placed.constants));
  }
}

}  // namespace llmt::discovery
