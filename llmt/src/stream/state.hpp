/// \file
/// The parts of a Stream.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "base/matrix.hpp"
#include "llmt/model.hpp"
#include "llmt/options.hpp"
#include "llmt/stream_options.hpp"
#include "stream/reservoir.hpp"
#include "stream/setting.hpp"
#include "stream/tree.hpp"

namespace llmt {

/// Trees, reservoir and statistics of a stream. Members mean what those of Stream mean; inputs are checked there.
class StreamState {
 public:
  /// `options`: with their defaults filled in.
  StreamState(Eigen::Index inputs, Eigen::Index outputs, const StreamOptions& options);

  Eigen::Index inputs() const { return inputs_; }
  Eigen::Index outputs() const { return outputs_; }
  /// Rows that have been added: all, and those of positive weight.
  Eigen::Index offered() const { return offered_; }
  Eigen::Index rows() const { return rows_; }

  /// Learns a row: inputs, outputs and weight one after the other.
  void add(const std::vector<double>& row);

  /// Adds what another stream with the same options, and with no more rows, has learned.
  void merge(const StreamState& other);
  bool has_options_of(const StreamState& other) const { return options_ == other.options_; }

  Eigen::MatrixXd predict(const Eigen::Ref<const Eigen::MatrixXd>& inputs) const;

  Eigen::VectorXd prequential_rmse() const;
  Eigen::VectorXd recent_rmse() const { return recent_.cwiseSqrt(); }
  StreamCounts counts() const;
  Model snapshot(ValidityChoice validity) const;

 private:
  /// Numbers of a row: inputs, outputs, weight.
  Eigen::Index width() const { return inputs_ + outputs_ + 1; }

  friend struct StreamJson;

  /// The trees start when there are so many rows.
  Eigen::Index rows_before_trees() const;
  /// The setting of a tree but for what comes from the first rows.
  StreamSetting usual_setting() const;
  StreamTree& add_tree(const StreamSetting& setting, const Eigen::VectorXd& first_model);

  void describe_columns(const std::vector<double>& row);
  std::vector<LeafRows> learn_sample(const StreamState& other);
  void merge_columns(const StreamState& other);
  void learn(const double* row);
  void start();
  void start_tree(const RowMajor& first, Eigen::Index output, const Eigen::VectorXd& centre,
                  const Eigen::VectorXd& scale);
  Eigen::VectorXd scale_of_inputs(const RowMajor& first) const;
  Model model_of_first_rows() const;
  std::vector<Partition> crisp_partitions() const;
  void choose_by_reservoir(const std::vector<InputColumn>& inputs, const std::vector<Regressor>& regressors,
                           ValidityChoice validity, std::vector<Partition>& partitions) const;

  Eigen::Index inputs_;
  Eigen::Index outputs_;
  StreamOptions options_;
  Reservoir reservoir_;
  std::vector<double> first_rows_;  // empty once the trees have started
  std::vector<ColumnRange> columns_;
  Eigen::VectorXd known_;  // number of values of each column
  Eigen::VectorXd squares_;
  Eigen::VectorXd recent_;
  Eigen::Index offered_ = 0;
  Eigen::Index rows_ = 0;
  Eigen::Index tested_ = 0;
  Eigen::Index missing_ = 0;
  std::vector<std::unique_ptr<StreamTree>> trees_;  // one per output
};

}  // namespace llmt
