// Simulations that are known as tables and by their derivatives.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "discovery/answer/findings.hpp"
#include "discovery/answer/refusals.hpp"
#include "discovery/recording/recording.hpp"
#include "discovery/recording/refuse.hpp"
#include "discovery/terms/term_model.hpp"
#include "llmt/discovery/simulation.hpp"
#include "llmt/statistics.hpp"

namespace llmt::discovery {
namespace {

constexpr int most_steps = 10;

// The simulation as the steps see it.
class Linearisation {
 public:
  Linearisation(const Simulation& simulation, const OutputDerivatives& derivatives, const Inputs& inputs,
                const MeasuredOutputs& measured)
      : simulation_(simulation), derivatives_(derivatives), inputs_(inputs), measured_(measured) {}

  Eigen::MatrixXd outputs(const Eigen::VectorXd& values) const {
    Eigen::MatrixXd outputs = simulation_.predict(inputs_.values, values);
    if (outputs.rows() != measured_.values.rows() || outputs.cols() != measured_.values.cols()) {
      refuse("find_missing", fmt::format("the simulation gave {} x {} outputs, must be {} x {}", outputs.rows(),
                                         outputs.cols(), measured_.values.rows(), measured_.values.cols()));
    }
    for (Eigen::Index i = 0; i < outputs.rows(); ++i) {
      if (!outputs.row(i).allFinite()) {
        refuse("find_missing", fmt::format("the simulation is not finite at row {}", i + 1));
      }
    }
    return outputs;
  }

  // Where `outputs` are those at `values`. Its nominal values are those of the simulation.
  Simulation at(const Eigen::VectorXd& values, const Eigen::MatrixXd& outputs) const {
    std::vector<Eigen::MatrixXd> by = derivatives_(inputs_.values, values);
    if (by.size() != simulation_.parameters.size()) {
      refuse("find_missing",
             fmt::format("derivatives by {} parameters, must be {}", by.size(), simulation_.parameters.size()));
    }
    Eigen::MatrixXd at_nominal = outputs;
    for (std::size_t k = 0; k < by.size(); ++k) {
      const Parameter& parameter = simulation_.parameters[k];
      if (by[k].rows() != outputs.rows() || by[k].cols() != outputs.cols()) {
        refuse("find_missing", fmt::format("the derivatives by {} are {} x {}, must be {} x {}", parameter.name,
                                           by[k].rows(), by[k].cols(), outputs.rows(), outputs.cols()));
      }
      at_nominal -= (values(static_cast<Eigen::Index>(k)) - parameter.value) * by[k];
    }
    // The outputs' own offsets and scales are no parameters here.
    Simulation table;
    table.predict = [at_nominal](const Eigen::MatrixXd&, const Eigen::VectorXd&) { return at_nominal; };
    return linearised(std::move(table), at_nominal, simulation_.parameters, std::move(by));
  }

 private:
  const Simulation& simulation_;
  const OutputDerivatives& derivatives_;
  const Inputs& inputs_;
  const MeasuredOutputs& measured_;
};

// What the terms add, n x d.
Eigen::MatrixXd added(const Simulation& linear, const Missing& missing, const Recording& recording) {
  return missing.corrected -
         recording.as_measured(linear.predict(recording.inputs().values, values_of(missing.parameters)));
}

// Sum of squares at the rows searched that are no outliers, outputs by their spread.
double left(const Missing& missing, const MeasuredOutputs& measured, const Eigen::MatrixXd& predicted) {
  double sum = 0.0;
  for (Eigen::Index o = 0; o < predicted.cols(); ++o) {
    const double spread = spread_of(measured.values.col(o));
    for (const Eigen::Index row : missing.searched) {
      if (std::ranges::find(missing.outliers, row) != missing.outliers.end()) continue;
      sum += std::pow((measured.values(row, o) - predicted(row, o)) / (spread > 0.0 ? spread : 1.0), 2.0);
    }
  }
  return sum;
}

bool has_settled(const Missing& missing, const Eigen::VectorXd& before) {
  constexpr double share_of_error = 0.05;
  constexpr double share_of_scale = 1e-9;
  const Eigen::VectorXd after = values_of(missing.parameters);
  for (Eigen::Index k = 0; k < after.size(); ++k) {
    const double error = missing.standard_errors(k);
    const double enough =
        std::max(std::isfinite(error) ? share_of_error * error : 0.0, share_of_scale * missing.parameters[k].scale);
    if (std::abs(after(k) - before(k)) > enough) return false;
  }
  return true;
}

// Whether the simulation went as its linearisation said, but for a millionth of what it deviates by.
bool is_linear(const Eigen::MatrixXd& as_linearised, const Eigen::MatrixXd& outputs, const MeasuredOutputs& measured) {
  constexpr double negligible = 1e-6;
  return (outputs - as_linearised).norm() <= negligible * (measured.values - outputs).norm();
}

Samples set_aside(const Missing& missing) {
  Samples samples;
  for (std::size_t begin = 0, end = 0; begin < missing.held_out.size(); begin = end) {
    while (end < missing.held_out.size() && missing.held_out_samples[end] == missing.held_out_samples[begin]) ++end;
    samples.add(std::span(missing.held_out).subspan(begin, end - begin));
  }
  return samples;
}

}  // namespace

Simulation tabulated(const Eigen::MatrixXd& simulated, const std::vector<std::string>& outputs, bool offset,
                     bool scale) {
  if (std::ssize(outputs) != simulated.cols()) {
    throw std::invalid_argument(
        fmt::format("llmt::discovery::tabulated: {} names for {} columns", outputs.size(), simulated.cols()));
  }
  Simulation simulation;
  for (std::size_t o = 0; o < outputs.size(); ++o) {
    const auto column = simulated.col(o);
    const double spread = column.size() > 0 ? column.maxCoeff() - column.minCoeff() : 0.0;
    simulation.parameters.push_back({.name = outputs[o] + ".offset",
                                     .unit = outputs[o],
                                     .value = 0.0,
                                     .scale = spread > 0.0 ? 0.01 * spread : 1.0,
                                     .free = offset});
    simulation.parameters.push_back(
        {.name = outputs[o] + ".scale", .unit = "1", .value = 1.0, .scale = 0.01, .free = scale});
  }
  simulation.predict = [simulated](const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    if (inputs.rows() != simulated.rows()) {
      throw std::invalid_argument(
          fmt::format("a tabulated simulation has {} rows, not {}", simulated.rows(), inputs.rows()));
    }
    Eigen::MatrixXd predicted = simulated;
    for (Eigen::Index o = 0; o < simulated.cols(); ++o) {
      predicted.col(o) = (values(2 * o) + values(2 * o + 1) * simulated.col(o).array()).matrix();
    }
    return predicted;
  };
  return simulation;
}

Simulation linearised(Simulation simulation, const Eigen::MatrixXd& simulated, std::vector<Parameter> parameters,
                      std::vector<Eigen::MatrixXd> derivatives) {
  if (parameters.size() != derivatives.size()) {
    refuse("linearised", fmt::format("{} parameters, {} derivatives", parameters.size(), derivatives.size()));
  }
  std::set<std::string> names;
  for (const Parameter& own : simulation.parameters) names.insert(own.name);
  Eigen::VectorXd nominal(std::ssize(parameters));
  for (std::size_t k = 0; k < parameters.size(); ++k) {
    Parameter& parameter = parameters[k];
    if (parameter.name.empty()) refuse("linearised", "a parameter has no name");
    if (!names.insert(parameter.name).second) {
      refuse("linearised", fmt::format("the parameter \"{}\" is there twice", parameter.name));
    }
    const Eigen::MatrixXd& by = derivatives[k];
    if (by.rows() != simulated.rows() || by.cols() != simulated.cols()) {
      refuse("linearised", fmt::format("the derivatives by {} are {} x {}, must be {} x {}", parameter.name, by.rows(),
                                       by.cols(), simulated.rows(), simulated.cols()));
    }
    if (!by.allFinite()) refuse("linearised", fmt::format("a derivative by {} is not finite", parameter.name));
    nominal(k) = parameter.value;
    double largest = 0.0;
    for (Eigen::Index o = 0; o < by.cols(); ++o) {
      const auto output = simulated.col(o);
      const double spread = output.size() > 0 ? output.maxCoeff() - output.minCoeff() : 0.0;
      const double rms = by.col(o).norm() / std::sqrt(static_cast<double>(std::max<Eigen::Index>(1, by.rows())));
      largest = std::max(largest, rms / (spread > 0.0 ? spread : 1.0));
    }
    constexpr double share_of_spread = 0.01;
    parameter.scale = largest > 0.0 ? share_of_spread / largest : 1.0;
  }
  const Eigen::Index own = std::ssize(simulation.parameters);
  simulation.parameters.insert(simulation.parameters.end(), parameters.begin(), parameters.end());
  simulation.predict = [base = std::move(simulation.predict), nominal, by = std::move(derivatives), own](
                           const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    Eigen::MatrixXd predicted = base(inputs, values.head(own));
    for (Eigen::Index k = 0; k < nominal.size(); ++k) predicted += (values(own + k) - nominal(k)) * by[k];
    return predicted;
  };
  return simulation;
}

OutputDerivatives central_differences(Simulation simulation) {
  return [own = std::move(simulation)](const Eigen::MatrixXd& inputs, const Eigen::VectorXd& values) {
    constexpr double share_of_scale = 0.01;
    std::vector<Eigen::MatrixXd> derivatives;
    Eigen::VectorXd moved = values;
    for (std::size_t k = 0; k < own.parameters.size(); ++k) {
      const auto place = static_cast<Eigen::Index>(k);
      const double step = share_of_scale * own.parameters[k].scale;
      moved(place) = values(place) + step;
      const double upper = moved(place);
      const Eigen::MatrixXd above = own.predict(inputs, moved);
      moved(place) = values(place) - step;
      derivatives.push_back((above - own.predict(inputs, moved)) / (upper - moved(place)));
      moved(place) = values(place);
    }
    return derivatives;
  };
}

Missing find_missing_in_steps(const Simulation& simulation, const OutputDerivatives& derivatives, const Inputs& inputs,
                              const MeasuredOutputs& measured, const std::vector<ModelTerm>& terms,
                              const MissingOptions& options) {
  const Linearisation linearisation(simulation, derivatives, inputs, measured);
  const Eigen::VectorXd start = values_of(simulation.parameters);
  const Recording recording(inputs);
  const Eigen::MatrixXd nominal = linearisation.outputs(start);
  refuse_random(nominal, linearisation.outputs(start), measured.names);
  Eigen::VectorXd values = start;
  Eigen::MatrixXd outputs = nominal;
  Eigen::MatrixXd terms_added = Eigen::MatrixXd::Zero(outputs.rows(), outputs.cols());
  Missing missing;
  bool settled = false;
  for (int step = 0; step < most_steps && !settled; ++step) {
    const Simulation linear = linearisation.at(values, outputs);
    missing = find_missing(linear, inputs, measured, terms, options);
    terms_added = added(linear, missing, recording);
    const double before = left(missing, measured, recording.as_measured(outputs) + terms_added);
    Eigen::VectorXd next = values_of(missing.parameters);
    Eigen::MatrixXd at_next = linearisation.outputs(next);
    settled = has_settled(missing, values) || is_linear(linear.predict(inputs.values, next), at_next, measured);
    constexpr int most_halvings = 6;
    constexpr double rounding = 1e-9;
    for (int k = 0;
         k < most_halvings &&
         left(missing, measured, recording.as_measured(at_next) + terms_added) > (1.0 + rounding) * before && !settled;
         ++k) {
      next = 0.5 * (next + values);
      at_next = linearisation.outputs(next);
    }
    values = next;
    outputs = at_next;
  }
  if (!settled) {
    missing.notes.push_back(
        fmt::format("the parameters still moved after {} linearisations of the simulation", most_steps));
  }
  for (std::size_t k = 0; k < missing.parameters.size(); ++k) {
    missing.parameters[k].value = values(static_cast<Eigen::Index>(k));
  }
  missing.corrected = recording.as_measured(outputs) + terms_added;
  Eigen::VectorXd alone = start;
  for (const FittedParameter& fitted : missing.fitted_parameters) {
    const auto first = std::ranges::find(missing.parameters, fitted.parts.front(), &Parameter::name);
    alone(first - missing.parameters.begin()) += fitted.alone;
  }
  missing.before = missing.found.empty() ? missing.corrected : recording.as_measured(linearisation.outputs(alone));
  const Samples aside = set_aside(missing);
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
    Gap& gap = missing.gaps[static_cast<std::size_t>(o)];
    const auto errors = [&](const Eigen::MatrixXd& predicted) -> Eigen::VectorXd {
      Eigen::VectorXd left = measured.values.col(o) - predicted.col(o);
      if (missing.change_by_smoothing.size() > 0) left -= missing.change_by_smoothing.col(o);
      return means(left, aside);
    };
    const double known_noise = gap.known_noise;
    gap = gap_of(gap.output, errors(recording.as_measured(nominal)), errors(missing.before), errors(missing.corrected),
                 gap.noise_floor);
    gap.known_noise = known_noise;
  }
  return missing;
}

}  // namespace llmt::discovery
