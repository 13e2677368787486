#include "model/held_out_intervals.hpp"

#include <algorithm>
#include <utility>

#include "spread/fit_spread.hpp"
#include "model/incomplete.hpp"

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
  Eigen::MatrixXd predictions(count, outputs.cols());
  Eigen::Index begin = 0;
  for (std::size_t f = 0; f < models.size(); ++f) {
    const Eigen::Index size = std::ssize(held_out[f]);
    predictions.middleRows(begin, size) = models[f].predict(x.middleRows(begin, size), max_threads);
    begin += size;
  }
  Eigen::MatrixXd residuals = (outputs(rows, Eigen::all) - predictions).cwiseAbs();
  std::vector<std::vector<Spread>> spreads(parts);
  bool has_spread = false;
  for (Eigen::Index o = 0; o < outputs.cols(); ++o) {
    const std::vector<Spread> of_output =
        fit_spreads({x, models.front().inputs(), predictions.col(o), residuals.col(o)}, part, parts);
    for (Eigen::Index i = 0; i < count; ++i) {
      residuals(i, o) /= spread_at(of_output[part[i]], x, i, predictions(i, o));
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
    made.push_back({models.size() == 1 ? 0 : static_cast<std::size_t>(p), residuals(whole[p], Eigen::all),
                    residuals(lacking[p], Eigen::all), has_spread ? std::move(spreads[p]) : std::vector<Spread>()});
  }
  return {std::move(models), std::move(made)};
}

}  // namespace llmt
