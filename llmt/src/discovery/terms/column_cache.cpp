#include "discovery/terms/column_cache.hpp"

#include <algorithm>
#include <utility>

#include "discovery/recording/row_split.hpp"

namespace llmt::discovery {

ColumnCache::ColumnCache(const Recording& recording) : places_(recording.inputs().values.rows(), -1) {
  MissingOptions nothing_aside;
  nothing_aside.held_out_share = 0.0;
  all_ = split_in_time(recording, nothing_aside, 1).searched;
  for (Eigen::Index i = 0; i < all_.size(); ++i) places_[all_.rows()[i]] = i;
}

namespace {

bool is_of_inputs_alone(const ModelTerm& term) {
  return !term.inputs.empty() && !term.code.empty() && term.inner_state.empty() &&
         std::ranges::none_of(term.code, [](const std::string& code) { return code.find("$s") != std::string::npos; });
}

}  // namespace

bool ColumnCache::holds(const ModelTerm& term) { return term.constants.empty() && is_of_inputs_alone(term); }

bool ColumnCache::is_state_of_inputs(const ModelTerm& term) {
  return !term.constants.empty() && !term.inner_state.empty() && !term.inputs.empty();
}

bool ColumnCache::holds_grid(const ModelTerm& term) {
  return (!term.constants.empty() && is_of_inputs_alone(term)) || is_state_of_inputs(term);
}

Eigen::MatrixXd ColumnCache::of_samples(const Eigen::MatrixXd& all, const Samples& samples) const {
  std::vector<Eigen::Index> places(samples.size());
  for (Eigen::Index i = 0; i < samples.size(); ++i) places[i] = places_[samples.rows_of(i).front()];
  return all(places, Eigen::all);
}

Eigen::MatrixXd ColumnCache::at(const Samples& samples, std::size_t draw, std::size_t term,
                                const std::function<Eigen::MatrixXd()>& columns) {
  const auto [place, is_new] = columns_.try_emplace({draw, term});
  if (is_new) place->second = means(columns(), all_);
  return of_samples(place->second, samples);
}

Eigen::MatrixXd ColumnCache::grid_at(const Samples& samples, std::size_t term,
                                     const std::vector<Eigen::VectorXd>& tried,
                                     const std::function<Eigen::MatrixXd(const Samples&)>& columns) {
  std::vector<double> values;
  for (const Eigen::VectorXd& constants : tried) values.insert(values.end(), constants.begin(), constants.end());
  const auto [place, is_new] = grids_.try_emplace({term, std::move(values)});
  if (is_new) place->second = columns(all_);
  return of_samples(place->second, samples);
}

}  // namespace llmt::discovery
