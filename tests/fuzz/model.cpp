// Model files: what is read can be evaluated, a row gives the same bytes alone and in a block, and a model survives
// writing. Inputs that begin with { are JSON as they stand; others change a fitted model.
#include <cstring>
#include <stdexcept>

#include "fuzz/fitted_models.hpp"
#include "fuzz/json_mutator.hpp"
#include "llmt/model.hpp"

namespace fuzz_model {
namespace {

const std::vector<std::string> words = {"",     "crisp",        "blend",   "gaussian", "logistic",     "x1",
                                        "y1",   "level",        "split",   "left",     "guard_parent", "direction",
                                        "rank", "output_range", "\xC3\xB6"};

bool same_bytes(const Eigen::MatrixXd& a, const Eigen::MatrixXd& b) {
  return a.rows() == b.rows() && a.cols() == b.cols() &&
         std::memcmp(a.data(), b.data(), sizeof(double) * static_cast<std::size_t>(a.size())) == 0;
}

// Rows within the training extent, beyond it, far away, and with missing values.
Eigen::MatrixXd rows_for(const llmt::Model& model) {
  constexpr Eigen::Index rows = 19;  // more than a block and a rest
  Eigen::MatrixXd x(rows, model.num_inputs());
  for (Eigen::Index i = 0; i < rows; ++i) {
    for (Eigen::Index j = 0; j < x.cols(); ++j) {
      const llmt::InputColumn& input = model.inputs()[j];
      const double share = static_cast<double>((7 * i + 3 * j) % 13) / 8.0 - 0.25;
      x(i, j) = (1.0 - share) * input.low + share * input.high;
      if (input.is_categorical()) x(i, j) = static_cast<double>((i + j) % 4);
      if ((i + 2 * j) % 9 == 4) x(i, j) = std::nan("");
      if (i == 17) x(i, j) = (j % 2 == 0 ? 1.0 : -1.0) * 1e30;
      if (!std::isnan(x(i, j)) && !std::isfinite(x(i, j))) x(i, j) = 0.0;
    }
  }
  return x;
}

void evaluate(const llmt::Model& model) {
  const Eigen::MatrixXd x = rows_for(model);
  const Eigen::MatrixXd together = model.predict(x, 1);
  for (Eigen::Index i = 0; i < x.rows(); ++i) {
    fuzz::require(same_bytes(model.predict(x.row(i), 1), together.row(i)), "a row alone is as in a block");
  }
  for (const llmt::Partition& partition : model.partitions()) {
    for (Eigen::Index o = 0; o < partition.output_range.rows(); ++o) {
      for (const double value : together.col(partition.outputs[o])) {
        fuzz::require(!(value < partition.output_range(o, 0) || value > partition.output_range(o, 1)), "it is clamped");
      }
    }
  }
  fuzz::require(model.leaf_of(x, 1).minCoeff() >= 0, "every row is in a leaf");
  model.extrapolation(x, 1);
  model.standard_errors(x, 1);
  model.jacobian(x.row(0).unaryExpr([](double value) { return std::isnan(value) ? 0.0 : value; }).transpose());
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    const Eigen::MatrixXd validities = model.validities(x, p, 1);
    fuzz::require(validities.cols() == std::ssize(model.leaves(p)), "one validity for each leaf");
  }
  model.prefix(2).predict(x, 1);
}

}  // namespace

FUZZ_TARGET(model) {
  std::string text = fuzz::text_of(data, size);
  if (!text.starts_with('{')) {
    fuzz::Bytes bytes(data, size);
    fuzz::Json json = fuzz::Json::parse(bytes.one_of(fuzz::fitted_models()));
    fuzz::mutate(json, bytes, words);
    text = json.dump(-1, ' ', false, fuzz::Json::error_handler_t::replace);
  }
  try {
    const llmt::Model model = llmt::from_json(text, "m");
    const std::string written = llmt::to_json(model);
    fuzz::require(llmt::to_json(llmt::from_json(written, "written")) == written, "a model survives writing");
    evaluate(model);
  } catch (const std::runtime_error& error) {
    fuzz::require(std::string(error.what()).starts_with("m: "), fmt::format("'{}' names the file", error.what()));
  }
  return 0;
}

}  // namespace fuzz_model
