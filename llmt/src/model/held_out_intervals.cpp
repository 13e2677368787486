#include "model/held_out_intervals.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "model/incomplete.hpp"
#include "spread/fit_spread.hpp"

namespace llmt {
namespace {

// A held-out row, by the model that was fitted without it.
struct Place {
  int row = 0;
  int part = 0;
};

std::vector<Place> places_of(const std::vector<std::span<const int>>& held_out) {
  std::vector<Place> places;
  for (std::size_t f = 0; f < held_out.size(); ++f) {
    for (const int row : held_out[f]) places.push_back({row, static_cast<int>(f)});
  }
  if (held_out.size() != 1 || std::ssize(places) < fewest_rows_of_spread) return places;
  const std::vector<int> part = dealt_parts(std::ssize(places), parts_of_one_fold);
  for (std::size_t i = 0; i < places.size(); ++i) places[i].part = part[i];
  return places;
}

// The square root of (K - 1) / K, for K models, times what each prediction differs from the mean of the other models':
// the variance of this is that of one model.
Eigen::MatrixXd differences_of_folds(const Eigen::MatrixXd& predictions, const std::vector<Eigen::MatrixXd>& by_model) {
  const auto count = static_cast<double>(by_model.size());
  if (by_model.size() < 2) return Eigen::MatrixXd::Zero(predictions.rows(), predictions.cols());
  Eigen::MatrixXd mean = Eigen::MatrixXd::Zero(predictions.rows(), predictions.cols());
  for (const Eigen::MatrixXd& each : by_model) mean += each / count;
  // f_k - mean of others = (f_k - mean of all) K / (K - 1)
  return (predictions - mean) * std::sqrt(count / (count - 1.0));
}

// The deviation of normal numbers with this median size. A mean would be that of the few rows that are far from others.
double usual_size(const Eigen::VectorXd& differences) {
  constexpr double median_of_normal = 0.6744897501960817;
  if (differences.size() == 0) return 0.0;
  std::vector<double> sizes;
  for (const double difference : differences) sizes.push_back(std::abs(difference));
  const auto middle = sizes.begin() + std::ssize(sizes) / 2;
  std::nth_element(sizes.begin(), middle, sizes.end());
  return *middle / median_of_normal;
}

}  // namespace

Intervals held_out_intervals(std::vector<Model> models, const Eigen::Ref<const Eigen::MatrixXd>& inputs,
                             const Eigen::Ref<const Eigen::MatrixXd>& outputs,
                             const std::vector<std::span<const int>>& held_out, int max_threads) {
  if (models.empty()) return {};
  const std::vector<Place> places = places_of(held_out);
  const auto count = static_cast<Eigen::Index>(places.size());
  std::vector<int> rows;
  std::vector<int> part;
  int parts = 0;
  for (const Place& place : places) {
    rows.push_back(place.row);
    part.push_back(place.part);
    parts = std::max(parts, place.part + 1);
  }
  parts = std::max(parts, static_cast<int>(models.size()));
  const Eigen::MatrixXd x = inputs(rows, Eigen::all);
  std::vector<Eigen::MatrixXd> by_model;
  for (const Model& model : models) by_model.push_back(model.predict(x, max_threads));
  Eigen::MatrixXd predictions(count, outputs.cols());
  for (Eigen::Index i = 0; i < count; ++i) {
    predictions.row(i) = by_model[models.size() == 1 ? 0 : static_cast<std::size_t>(part[i])].row(i);
  }
  Eigen::MatrixXd residuals = (outputs(rows, Eigen::all) - predictions).cwiseAbs();
  Eigen::MatrixXd differences = differences_of_folds(predictions, by_model);
  std::vector<std::vector<Spread>> spreads(parts);
  bool has_spread = false;
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
    const std::vector<Spread> of_output =
        fit_spreads({x, models.front().inputs(), predictions.col(o), residuals.col(o)}, part, parts);
    for (Eigen::Index i = 0; i < count; ++i) {
      const double spread = spread_at(of_output[part[i]], x, i, predictions(i, o));
      residuals(i, o) /= spread;
      differences(i, o) /= spread;
    }
    for (int p = 0; p < parts; ++p) {
      has_spread = has_spread || !of_output[p].nodes.empty();
      spreads[p].push_back(of_output[p]);
    }
  }
  const std::vector<bool> incomplete = incomplete_rows(models, x);
  std::vector<std::vector<int>> whole(parts);
  std::vector<std::vector<int>> lacking(parts);
  for (Eigen::Index i = 0; i < count; ++i) (incomplete[i] ? lacking : whole)[part[i]].push_back(static_cast<int>(i));
  std::vector<HeldOutPart> made;
  for (int p = 0; p < parts; ++p) {
    HeldOutPart& of_part = made.emplace_back();
    of_part.model = models.size() == 1 ? 0 : static_cast<std::size_t>(p);
    of_part.residuals = residuals(whole[p], Eigen::all);
    of_part.incomplete = residuals(lacking[p], Eigen::all);
    if (has_spread) of_part.spreads = std::move(spreads[p]);
    if (models.size() > 1 && count >= fewest_rows_of_spread) {
      whole[p].insert(whole[p].end(), lacking[p].begin(), lacking[p].end());
      for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
        of_part.disagreement.push_back(usual_size(differences.col(o)(whole[p])));
      }
    }
  }
  return {std::move(models), std::move(made)};
}

}  // namespace llmt
