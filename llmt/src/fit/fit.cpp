#include "llmt/fit.hpp"

#include <fmt/format.h>

#include <stdexcept>
#include <utility>

#include "data/given_rows.hpp"
#include "fit/named.hpp"
#include "fit/pipeline.hpp"
#include "fit/prepare.hpp"

namespace llmt {

FitResult fit(const Eigen::Ref<const Eigen::MatrixXd>& inputs, const Eigen::Ref<const Eigen::MatrixXd>& outputs,
              const FitOptions& options, const Progress& progress) {
  Work work(progress);
  FitResult result = fit(prepare({.inputs = {inputs}, .outputs = {outputs}}, options, work), work);
  work.finish();
  return result;
}

FitResult fit(const TrainingData& data, const FitOptions& options, const Progress& progress) {
  Work work(progress);
  FitResult result = fit(prepare(given_rows(data), options, work), work);
  result.model = named(result.model, data);
  work.finish();
  return result;
}

FitResult fit(const PreparedFit& prepared, const Progress& progress) {
  Work work(progress);
  FitResult result = fit(prepared.rows(), work);
  result.model = named(result.model, prepared.data());
  work.finish();
  return result;
}

struct PreparedFit::Parts {
  std::shared_ptr<const TrainingData> data;
  PreparedRows rows;  // view the data
};

PreparedFit::PreparedFit(TrainingData data, const FitOptions& options, const Progress& progress)
    : PreparedFit(std::make_shared<const TrainingData>(std::move(data)), options, progress) {}

PreparedFit::PreparedFit(std::shared_ptr<const TrainingData> data, const FitOptions& options,
                         const Progress& progress) {
  Work work(progress);
  PreparedRows rows = prepare(given_rows(*data), options, work);
  parts_ = std::make_shared<const Parts>(Parts{std::move(data), std::move(rows)});
  work.finish();
}

const TrainingData& PreparedFit::data() const { return *parts_->data; }

const PreparedRows& PreparedFit::rows() const { return parts_->rows; }

PreparedFit PreparedFit::with_rows(PreparedRows rows) const {
  PreparedFit result = *this;
  result.parts_ = std::make_shared<const Parts>(Parts{parts_->data, std::move(rows)});
  return result;
}

Eigen::VectorXd rmse(const Eigen::Ref<const Eigen::MatrixXd>& predicted,
                     const Eigen::Ref<const Eigen::MatrixXd>& measured) {
  if (predicted.rows() != measured.rows() || predicted.cols() != measured.cols() || predicted.rows() == 0) {
    throw std::invalid_argument(
        fmt::format("llmt::rmse: predicted is {} x {}, measured is {} x {}; the shapes must agree and have rows",
                    predicted.rows(), predicted.cols(), measured.rows(), measured.cols()));
  }
  return ((predicted - measured).colwise().squaredNorm() / static_cast<double>(predicted.rows()))
      .cwiseSqrt()
      .transpose();
}

}  // namespace llmt
