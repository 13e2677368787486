// Terms that stand for a state which the inputs do not show.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>
#include <map>
#include <memory>
#include <optional>
#include <stdexcept>

#include "discovery/recording/recording.hpp"
#include "discovery/terms/term_builders.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/terms.hpp"
#include "llmt/random.hpp"

namespace llmt::discovery {
namespace {

// Derivatives at the rows that terms are evaluated on, which are the same in nearly every call. Over windows in which
// no signal changes much, or, where `interpolates`, on the polynomial through five rows.
class OfRows {
 public:
  explicit OfRows(bool interpolates = false) : interpolates_(interpolates) {}

  const Derivatives& at(const Rows& rows, const Eigen::MatrixXd& signals) {
    const bool is_known = derivatives_ && instants_.size() == rows.instants.size() && instants_ == rows.instants &&
                          sequence_ == rows.sequence;
    if (!is_known) {
      derivatives_.emplace(rows, interpolates_ ? 2 : lags_of_a_window * smooth_lag(rows, signals));
      instants_ = rows.instants;
      sequence_ = rows.sequence;
    }
    return *derivatives_;
  }

 private:
  bool interpolates_;
  std::optional<Derivatives> derivatives_;
  Eigen::VectorXd instants_;
  std::vector<Eigen::Index> sequence_;
};

// Derivatives of the simulation at the inputs that terms are evaluated at: those of the log, and with drawn errors.
class SlopesOfSimulation {
 public:
  explicit SlopesOfSimulation(std::shared_ptr<const Surrogate> surrogate) : surrogate_(std::move(surrogate)) {}

  /// n x d.
  const Eigen::MatrixXd& at(const Eigen::MatrixXd& inputs, Eigen::Index column) {
    constexpr std::size_t most = 16;
    auto known = std::ranges::find_if(
        known_, [&](const Known& own) { return own.inputs.rows() == inputs.rows() && own.inputs == inputs; });
    if (known == known_.end()) {
      if (known_.size() == most) known_.erase(known_.begin());
      known_.push_back({inputs, {}});
      known = known_.end() - 1;
    }
    const auto [place, is_new] = known->by_column.try_emplace(column);
    if (is_new) place->second = surrogate_->derivative(inputs, column);
    return place->second;
  }

 private:
  struct Known {
    Eigen::MatrixXd inputs;
    std::map<Eigen::Index, Eigen::MatrixXd> by_column;
  };
  std::shared_ptr<const Surrogate> surrogate_;
  std::vector<Known> known_;
};

// What jumps with the sign of an input has no derivatives. Dry friction is known where the speed is, so it is taken off
// before, and moved with the sign of the input.
struct SimulatedParts {
  Eigen::VectorXd smooth;
  Eigen::VectorXd jumps;
};

SimulatedParts parts_of(const Surrogate& surrogate, const Rows& rows, Eigen::Index output) {
  // A function that does not describe the simulation knows no jumps of it.
  if (surrogate.described()(output) < roughly_described)
    return {rows.simulated, Eigen::VectorXd::Zero(rows.simulated.size())};
  Eigen::VectorXd jumps = surrogate.jumps(rows.inputs).col(output);
  return {rows.simulated - jumps, jumps};
}

// Times on both sides of zero, from a fraction of what the signals change in to many times as much. A time more than
// twice that of the machine explains nothing, so short ones are tried too.
std::vector<double> times_around_zero(const Rows& rows) {
  const double lag = median_step(rows) * static_cast<double>(smooth_lag(rows, rows.inputs));
  std::vector<double> times;
  for (const double factor :
       {10.0, 8.0, 6.0, 5.0, 4.0, 3.0, 2.0, 1.5, 1.0, 0.7, 0.45, 0.3, 0.2, 0.1, 0.05, 0.02, 0.007, 0.002}) {
    times.push_back(-factor * lag);
  }
  for (Eigen::Index k = std::ssize(times); k-- > 0;) times.push_back(-times[k]);
  return times;
}

ModelTerm delay(const std::shared_ptr<OfRows>& of_rows, const std::shared_ptr<const Surrogate>& surrogate,
                const Rows& rows, bool is_dense, const std::string& output, Eigen::Index output_index) {
  ModelTerm term;
  term.family = "delay";
  term.formula = "s(t - delay) - s(t), s the simulated output";
  term.coefficients = {"share"};
  term.whole = true;
  if (is_dense) {
    // Rows are so near in time that jumps are where they are.
    const auto between = std::make_shared<OfRows>(true);
    term.columns = [between](const Rows& own, const Eigen::VectorXd& constants) -> Eigen::MatrixXd {
      return between->at(own, own.inputs).earlier(own.simulated, constants(0)) - own.simulated;
    };
  } else {
    term.columns = [of_rows, surrogate, output_index](const Rows& own, const Eigen::VectorXd& constants) {
      const Derivatives& derivatives = of_rows->at(own, own.inputs);
      const SimulatedParts parts = parts_of(*surrogate, own, output_index);
      // Both are on the polynomials, whose errors would count beside a short delay.
      Eigen::MatrixXd column = derivatives.earlier(parts.smooth, constants(0)) - derivatives.earlier(parts.smooth, 0.0);
      if ((parts.jumps.array() != 0.0).any()) {
        Eigen::MatrixXd earlier = own.inputs;
        for (Eigen::Index j = 0; j < earlier.cols(); ++j) {
          earlier.col(j) = derivatives.earlier(own.inputs.col(j), constants(0));
        }
        column += surrogate->jumps(earlier).col(output_index) - parts.jumps;
      }
      return column;
    };
  }
  term.constants = {{.name = "delay", .unit = "units of time", .tried = times_around_zero(rows)}};
  term.output = output;
  term.inner_state = "a delay or a first-order lag";
  term.shown_by = "a signal measured behind the actuator, or a step of the command on the clock of the inputs";
  return term;
}

ModelTerm resonance(const std::string& output, std::vector<double> frequencies) {
  return {.family = "resonance",
          .location = "",
          .formula =
              "(H - 1) simulated output, H = (2 z w p + w^2)/(p^2 + 2 z w p + w^2), "
              "w = 2 pi frequency, z = damping ratio, p = d/dt",
          .inputs = {},
          .coefficients = {"share"},
          .columns = [](const Rows& rows, const Eigen::VectorXd& constants) -> Eigen::MatrixXd {
            return ringing(rows, rows.simulated, constants);
          },
          .constants = constants_of_ringing(std::move(frequencies)),
          .output = output,
          .inner_state = "a resonance, as of a load behind a spring",
          .shown_by = "an encoder or an accelerometer at the load",
          .unit = "1"};
}

ModelTerm drive_spring(const std::shared_ptr<OfRows>& of_rows, const std::shared_ptr<const Surrogate>& surrogate,
                       const std::shared_ptr<SlopesOfSimulation>& slopes, const Motion& motion, const Inputs& inputs,
                       const std::string& output, Eigen::Index output_index) {
  const std::string& q = inputs.names[motion.position];
  const std::string& v = inputs.names[motion.speed];
  const std::string& a = inputs.names[motion.acceleration];
  ModelTerm term;
  term.family = "drive_spring";
  term.location = q;
  term.formula = fmt::format(
      "-(compliance L({0}) - inertia (L({3}) + d2({0})/dt2) - damping L({2})), L(w) = ds/d{1} w + ds/d{3} d2w/dt2",
      output, q, v, a);
  term.inputs = {q, v, a};
  term.coefficients = {"compliance", "inertia", "damping"};
  term.columns = [of_rows, surrogate, slopes, motion, output_index](const Rows& rows, const Eigen::VectorXd&) {
    const Derivatives& derivatives = of_rows->at(rows, rows.inputs);
    const Eigen::ArrayXd by_position = slopes->at(rows.inputs, motion.position).col(output_index).array();
    const Eigen::ArrayXd by_acceleration = slopes->at(rows.inputs, motion.acceleration).col(output_index).array();
    const auto second = [&](const Eigen::ArrayXd& w) -> Eigen::ArrayXd {
      return derivatives.second(w.matrix()).array() / (motion.second * motion.second);
    };
    const auto of_load = [&](const Eigen::ArrayXd& w) -> Eigen::ArrayXd {
      return by_position * w + by_acceleration * second(w);
    };
    const Eigen::ArrayXd output_here = parts_of(*surrogate, rows, output_index).smooth.array();
    const Eigen::ArrayXd speed = rows.inputs.col(motion.speed).array();
    const Eigen::ArrayXd acceleration = rows.inputs.col(motion.acceleration).array();
    Eigen::MatrixXd columns(rows.inputs.rows(), 3);
    columns.col(0) = -of_load(output_here).matrix();
    columns.col(1) = (of_load(acceleration) + second(output_here)).matrix();
    columns.col(2) = of_load(speed).matrix();
    return columns;
  };
  term.output = output;
  term.inner_state = "a spring in the drive";
  term.shown_by = fmt::format("an encoder behind the spring, beside {}", q);
  term.unit = fmt::format("{}/{}", q, output);
  return term;
}

// Share of the second derivative of a signal that is noise, from fourth differences: var(D^4 e) = 70 var(e).
double noise_of_second(const Derivatives& derivatives, const Rows& rows, const Eigen::VectorXd& values) {
  constexpr double factor = 70.0;
  const Eigen::ArrayXd v = values(rows.sequence).array();
  const Eigen::Index n = v.size() - 4;
  const Eigen::ArrayXd fourth =
      v.tail(n) - 4.0 * v.segment(3, n) + 6.0 * v.segment(2, n) - 4.0 * v.segment(1, n) + v.head(n);
  Random random(1);
  Eigen::VectorXd white(values.size());
  for (double& value : white) value = random.normal();
  const double gain = derivatives.second(white).squaredNorm() / static_cast<double>(white.size());
  const double whole = derivatives.second(values).squaredNorm() / static_cast<double>(values.size());
  return whole > 0.0 ? fourth.square().mean() / factor * gain / whole : 1.0;
}

}  // namespace

std::vector<ModelTerm> inner_state_terms(const Inputs& inputs, const Eigen::MatrixXd& simulated,
                                         const std::vector<std::string>& outputs) {
  const Recording recording(inputs);
  const Rows& rows = recording.rows();
  if (simulated.rows() != inputs.values.rows() || simulated.cols() != std::ssize(outputs)) {
    throw std::invalid_argument(
        fmt::format("llmt::discovery::inner_state_terms: {} x {} simulated outputs, must be {} x {}", simulated.rows(),
                    simulated.cols(), inputs.values.rows(), outputs.size()));
  }
  std::vector<ModelTerm> terms;
  if (inputs.values.rows() < fewest_for_derivatives || !simulated.allFinite()) return terms;
  const auto of_rows = std::make_shared<OfRows>();
  const auto surrogate = recording.surrogate(simulated);
  const auto slopes = std::make_shared<SlopesOfSimulation>(surrogate);
  const std::vector<Motion>& all = recording.axes();
  constexpr double largest_noise_share = 0.3;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const Eigen::VectorXd output = simulated.col(static_cast<Eigen::Index>(o));
    // Compliance, inertia and damping are not negative.
    const auto limit = [&](ModelTerm& term) {
      constexpr double far = 10.0;  // times the output
      Rows here = rows;
      here.simulated = output;
      Eigen::VectorXd constants(std::ssize(term.constants));
      for (std::size_t k = 0; k < term.constants.size(); ++k) constants(k) = term.constants[k].tried.front();
      const Eigen::MatrixXd columns = term.columns(here, constants);
      term.lower = Eigen::VectorXd::Zero(columns.cols());
      term.upper = (far * output.norm() / columns.colwise().norm().array().max(smallest_divisor)).matrix().transpose();
    };
    const auto place = static_cast<Eigen::Index>(o);
    terms.push_back(delay(of_rows, surrogate, rows, inputs.cutoff > 0.0, outputs[o], place));
    Rows here = rows;
    here.simulated = output;
    std::vector<double> frequencies = resonant_frequencies(here);
    // What rings above the cutoff is not in the rows: such a term would take noise out of the simulation.
    if (inputs.cutoff > 0.0) std::erase_if(frequencies, [&](double f) { return f > inputs.cutoff; });
    if (!frequencies.empty()) {
      terms.push_back(resonance(outputs[o], std::move(frequencies)));
      terms.back().lower = Eigen::VectorXd::Zero(1);
      terms.back().upper = Eigen::VectorXd::Ones(1);
    }
    std::ranges::move(memory_terms(recording, outputs[o]), std::back_inserter(terms));
    if (surrogate->described()(place) < well_described) continue;
    // The spring's term holds the second derivative of the simulated output, which should not be noise.
    if (noise_of_second(recording.derivatives(), rows, parts_of(*surrogate, here, place).smooth) >
        largest_noise_share) {
      continue;
    }
    for (const Motion& motion : all) {
      terms.push_back(drive_spring(of_rows, surrogate, slopes, motion, inputs, outputs[o], place));
      limit(terms.back());
    }
  }
  return terms;
}

}  // namespace llmt::discovery
