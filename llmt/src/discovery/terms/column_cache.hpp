// Columns of terms that no search changes.
#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <functional>
#include <map>
#include <utility>
#include <vector>

#include "discovery/recording/recording.hpp"
#include "discovery/recording/samples.hpp"
#include "llmt/discovery/model_term.hpp"

namespace llmt::discovery {

/// A term without constants that is a function of the inputs alone is the same in every search of the same rows. It is
/// computed at all rows and filtered once, at all rows that may be samples.
class ColumnCache {
 public:
  /// Of filtered rows.
  explicit ColumnCache(const Recording& recording);

  static bool holds(const ModelTerm& term);

  /// Whether a term with constants is a function of the inputs alone.
  static bool holds_grid(const ModelTerm& term);

  /// Whether it is one of their past: a state that they move.
  static bool is_state_of_inputs(const ModelTerm& term);

  /// samples x k. `draw`: 0 for the inputs as they are, else the number of the draw of their errors. `columns` computes
  /// them at all rows.
  Eigen::MatrixXd at(const Samples& samples, std::size_t draw, std::size_t term,
                     const std::function<Eigen::MatrixXd()>& columns);

  /// samples x m: columns of a term with constants at all values of them that are tried. `columns` computes them at the
  /// samples it is given.
  Eigen::MatrixXd grid_at(const Samples& samples, std::size_t term, const std::vector<Eigen::VectorXd>& tried,
                          const std::function<Eigen::MatrixXd(const Samples&)>& columns);

 private:
  Samples all_;
  std::vector<Eigen::Index> places_;  // of each row among them; -1: none
  std::map<std::pair<std::size_t, std::size_t>, Eigen::MatrixXd> columns_;
  std::map<std::pair<std::size_t, std::vector<double>>, Eigen::MatrixXd> grids_;

  Eigen::MatrixXd of_samples(const Eigen::MatrixXd& all, const Samples& samples) const;
};

}  // namespace llmt::discovery
