// The texts of a tree for the pictures that Python draws: the library's, with names as they are shown.

#include <nanobind/nanobind.h>
#include <nanobind/stl/optional.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/tuple.h>
#include <nanobind/stl/vector.h>

#include <optional>
#include <stdexcept>
#include <string>
#include <tuple>
#include <vector>

#include "llmt/intervals.hpp"
#include "llmt/model.hpp"
#include "python/bindings/module.hpp"
#include "report/model/rule_text.hpp"
#include "report/text/text.hpp"

namespace llmt::python {
namespace {

namespace nb = nanobind;

// A partition whose inputs and levels are called as they are shown: names may be cut, so two may be the same.
class Words {
 public:
  Words(const ModelWithIntervals& of, Eigen::Index partition, const std::vector<std::string>& names,
        const std::vector<std::vector<std::string>>& levels)
      : model_(of.model), partition_(partition), inputs_(model_.inputs()) {
    if (partition < 0 || partition >= std::ssize(model_.partitions()) || names.size() != inputs_.size() ||
        levels.size() != inputs_.size()) {
      throw std::invalid_argument("Words: no such partition, or not a name and a list of levels for each input");
    }
    for (std::size_t j = 0; j < inputs_.size(); ++j) {
      if (levels[j].size() != inputs_[j].levels.size()) throw std::invalid_argument("Words: not a name for each level");
      inputs_[j].name = names[j];
      inputs_[j].levels = levels[j];
    }
  }

  std::vector<std::string> regressors() const {
    std::vector<std::string> names;
    for (const Regressor& regressor : model_.regressors()) names.push_back(report::regressor_name(inputs_, regressor));
    return names;
  }

  // The node and the conditions of each leaf, from left to right.
  std::vector<std::tuple<int, std::vector<std::string>>> leaves() const {
    std::vector<std::tuple<int, std::vector<std::string>>> result;
    for (const Leaf& leaf : model_.leaves(partition_)) {
      result.emplace_back(leaf.node, report::conditions_of(inputs_, partition(), leaf));
    }
    return result;
  }

  std::tuple<std::string, std::string> condition(std::size_t node, bool left, std::optional<double> tolerance) const {
    const Node& split = partition().nodes.at(node);
    if (split.is_leaf()) throw std::invalid_argument("Words: a leaf has no condition");
    const report::Condition found = report::condition(inputs_, split, left, tolerance);
    return {found.what, found.how};
  }

  std::vector<std::string> equation(double intercept, const std::vector<double>& slope) const {
    if (slope.size() != model_.regressors().size())
      throw std::invalid_argument("Words: not a slope for each regressor");
    return report::equation(inputs_, model_.regressors(), intercept,
                            Eigen::Map<const Eigen::RowVectorXd>(slope.data(), std::ssize(slope)));
  }

 private:
  const Partition& partition() const { return model_.partitions()[partition_]; }

  Model model_;
  Eigen::Index partition_;
  std::vector<InputColumn> inputs_;
};

}  // namespace

void add_words(nb::module_& module) {
  using nb::arg;
  module.def(
      "decimal", [](double value, std::optional<double> tolerance) { return report::decimal(value, tolerance); },
      arg("value"), arg("tolerance") = nb::none(),
      "The number with as few digits as say it to within the tolerance; without one, up to rounding.");
  module.def(
      "number", [](double value, int digits) { return report::number(value, digits); }, arg("value"), arg("digits") = 4,
      "The number rounded to significant digits.");
  nb::class_<Words>(module, "Words", "The texts of a partition, with names as they are shown.")
      .def(nb::init<const ModelWithIntervals&, Eigen::Index, const std::vector<std::string>&,
                    const std::vector<std::vector<std::string>>&>(),
           arg("model"), arg("partition"), arg("names"), arg("levels"))
      .def("regressors", &Words::regressors)
      .def("leaves", &Words::leaves)
      .def("condition", &Words::condition, arg("node"), arg("left"), arg("tolerance") = nb::none())
      .def("equation", &Words::equation, arg("intercept"), arg("slope"));
}

}  // namespace llmt::python
