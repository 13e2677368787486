// What rows at rest still say.
#include <algorithm>
#include <cmath>
#include <vector>

#include "discovery/answer/one_search.hpp"

namespace llmt::discovery {
namespace {

// In noise floors. Friction at rest may be anything, so no row counts by more than the square of this.
constexpr double far_off_at_rest = 3.0;

class RowsAtRest {
 public:
  RowsAtRest(const TermModel& model, const Recording& recording, const MeasuredOutputs& measured,
             const Missing& missing, const Eigen::VectorXd& input, double band, Eigen::Index output)
      : model_(&model),
        recording_(&recording),
        measured_(measured.values.col(output)),
        scales_(Eigen::VectorXd::Constant(input.size(), 1.0 / missing.gaps[output].noise_floor)),
        output_(output) {
    if (missing.weights.size() > 0) scales_.array() *= missing.weights.col(output).array();
    for (Eigen::Index i = 0; i < input.size(); ++i) {
      if (std::abs(input(i)) < band) rows_.push_back(i);
    }
  }

  // In squares of the noise floor.
  double loss(const TermFit& fit) const {
    const Eigen::MatrixXd predicted = recording_->as_measured(model_->predict(fit.parameters, fit.placed));
    const Eigen::ArrayXd left = (measured_ - predicted.col(output_)).cwiseProduct(scales_)(rows_).array();
    return left.square().min(far_off_at_rest * far_off_at_rest).sum();
  }

 private:
  const TermModel* model_;
  const Recording* recording_;
  Eigen::VectorXd measured_;
  Eigen::VectorXd scales_;
  Eigen::Index output_;
  std::vector<Eigen::Index> rows_;
};

}  // namespace

void place_thresholds_at_rest(const TermModel& model, const MeasuredOutputs& measured, const SearchedRows& searched,
                              const Missing& missing, double independent, TermFit& fit) {
  constexpr int places = 20;  // on each side of 0
  const Recording& recording = model.recording();
  const Inputs& inputs = recording.inputs();
  for (PlacedTerm& placed : fit.placed) {
    const std::string& regime = model.terms()[placed.term].regime;
    if (regime.empty() || searched.bands_of_rest.size() == 0) continue;
    const auto gate = std::ranges::find(inputs.names, regime) - inputs.names.begin();
    const double band = searched.bands_of_rest(gate);
    double& threshold = placed.constants(placed.constants.size() - 1);
    if (!(std::abs(threshold) < band) || !(missing.gaps[placed.output].noise_floor > 0.0)) continue;
    const RowsAtRest rest(model, recording, measured, missing, inputs.values.col(gate), band, placed.output);
    const double before = threshold;
    const double of_before = rest.loss(fit);
    double best = before;
    double least = of_before;
    for (int k = -places; k <= places; ++k) {
      threshold = band * k / places;
      const double own = rest.loss(fit);
      if (!(own < least)) continue;
      least = own;
      best = threshold;
    }
    // A place in the band is a number, which 0 is not.
    const double of_a_sample = independent / static_cast<double>(inputs.values.rows());
    threshold = (of_before - least) * of_a_sample > std::log(independent) ? best : before;
  }
}

}  // namespace llmt::discovery
