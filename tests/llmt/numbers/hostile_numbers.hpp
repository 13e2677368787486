// Numbers that nobody means, and what a call may do with them.
#pragma once

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <cmath>
#include <concepts>
#include <cstdint>
#include <limits>
#include <stdexcept>
#include <string>
#include <vector>

#include "llmt/boosted_model.hpp"
#include "llmt/model.hpp"
#include "llmt/random.hpp"
#include "llmt/training_data.hpp"

namespace hostile {

inline const std::vector<double> numbers = {0.0,    -0.0,  -1.0,   5e-324,   -5e-324,   2.2250738585072014e-308,
                                            1e-200, 0.5,   1e16,   1e70,     1e150,     1.0000000000000002e150,
                                            1e200,  1e308, -1e308, INFINITY, -INFINITY, NAN};

template <std::integral Whole>
std::vector<Whole> wholes() {
  using Limits = std::numeric_limits<Whole>;
  return {0, 1, static_cast<Whole>(-1), 3, Limits::max(), Limits::min(), static_cast<Whole>(Limits::max() - 1)};
}

// A call that returns whether its results are finite. It may also refuse, as the library refuses; nothing else.
template <class Call>
void expect_finite_or_refused(const std::string& what, const Call& call) {
  try {
    EXPECT_TRUE(call()) << what << ": a result is not finite";
  } catch (const std::invalid_argument&) {
  } catch (const std::runtime_error&) {
  } catch (const std::exception& error) {
    ADD_FAILURE() << what << ": " << error.what();
  }
}

// Rows with a jump and a slope; deterministic.
inline llmt::TrainingData small_table(Eigen::Index rows = 60) {
  llmt::Random random(7);
  llmt::TrainingData data{.inputs = Eigen::MatrixXd(rows, 2), .outputs = Eigen::MatrixXd(rows, 1)};
  for (Eigen::Index i = 0; i < rows; ++i) {
    data.inputs.row(i) << random.uniform(), random.uniform();
    data.outputs(i, 0) = data.inputs(i, 0) + (data.inputs(i, 1) > 0.5 ? 1.0 : 0.0) + 0.01 * random.normal();
  }
  return data;
}

// Whether the model says something finite at the rows it was learned from, and is one that its reader takes.
inline bool is_finite(const llmt::Model& model, const Eigen::MatrixXd& inputs) {
  return model.predict(inputs).allFinite() && llmt::from_json(llmt::to_json(model)).predict(inputs).allFinite();
}
inline bool is_finite(const llmt::BoostedModel& model, const Eigen::MatrixXd& inputs) {
  return model.predict(inputs).allFinite() && llmt::boosted_from_json(llmt::to_json(model)).predict(inputs).allFinite();
}

}  // namespace hostile
