#include "discovery/terms/column_cache.hpp"

#include <algorithm>

#include "discovery/terms/row_split.hpp"

namespace llmt::discovery {

ColumnCache::ColumnCache(const Inputs& inputs) : places_(inputs.values.rows(), -1) {
  MissingOptions nothing_aside;
  nothing_aside.held_out_share = 0.0;
  all_ = split_in_time(inputs, nothing_aside, 1).searched;
  for (Eigen::Index i = 0; i < all_.size(); ++i) places_[all_.rows()[i]] = i;
}

bool ColumnCache::holds(const ModelTerm& term) {
  return term.constants.empty() && !term.inputs.empty() && !term.code.empty() &&
         std::ranges::none_of(term.code, [](const std::string& code) { return code.find("$s") != std::string::npos; });
}

Eigen::MatrixXd ColumnCache::at(const Samples& samples, std::size_t draw, std::size_t term,
                                const std::function<Eigen::MatrixXd()>& columns) {
  const auto [place, is_new] = columns_.try_emplace({draw, term});
  if (is_new) place->second = means(columns(), all_);
  Eigen::MatrixXd values(samples.size(), place->second.cols());
  for (Eigen::Index i = 0; i < samples.size(); ++i) {
    values.row(i) = place->second.row(places_[samples.rows_of(i).front()]);
  }
  return values;
}

}  // namespace llmt::discovery
