#include "model/interval_checks.hpp"

#include <fmt/format.h>

#include <stdexcept>

namespace llmt {
namespace {

// True for the name that fit() gives to an input or an output that has none.
bool is_unnamed(const std::string& name, const char* letter, Eigen::Index position, Eigen::Index count) {
  return name == fmt::format("{}{}", letter, position + 1) || (letter[0] == 'y' && count == 1 && name == "y");
}

// A column without any value in training has the extent 0 ... 0.
template <class Column>
bool is_within(const Column& part, const Column& all) {
  return (part.low >= all.low && part.high <= all.high) || (part.low == 0.0 && part.high == 0.0);
}

template <class Column>
void check_columns_belong(const char* kind, const char* letter, const std::vector<Column>& of_fold,
                          const std::vector<Column>& of_model, std::size_t fold) {
  const auto refuse = [&](std::size_t i, const std::string& problem) {
    throw std::invalid_argument(
        fmt::format("the intervals belong to another model: {} {} of fold {} {}", kind, i, fold, problem));
  };
  for (std::size_t i = 0; i < of_fold.size(); ++i) {
    const Column& part = of_fold[i];
    const Column& all = of_model[i];
    if (part.name != all.name && !is_unnamed(part.name, letter, i, std::ssize(of_model))) {
      refuse(i, fmt::format("is \"{}\", that of the model \"{}\"", part.name, all.name));
    }
    if (!is_within(part, all)) {
      refuse(i, fmt::format("was trained on {} ... {}, that of the model on {} ... {}", part.low, part.high, all.low,
                            all.high));
    }
  }
}

}  // namespace

std::string difference_of_columns(const Model& one, const Model& other) {
  if (one.num_inputs() != other.num_inputs() || one.num_outputs() != other.num_outputs()) {
    return fmt::format("{} inputs and {} outputs, and {} inputs and {} outputs", one.num_inputs(), one.num_outputs(),
                       other.num_inputs(), other.num_outputs());
  }
  for (Eigen::Index i = 0; i < one.num_inputs(); ++i) {
    const std::size_t first = one.inputs()[i].levels.size();
    const std::size_t second = other.inputs()[i].levels.size();
    if (one.inputs()[i].codes != other.inputs()[i].codes) return fmt::format("other codes of input {}", i);
    if (first != second) return fmt::format("{} and {} levels of input {}", first, second, i);
  }
  return "";
}

void check_belong(const std::vector<Model>& folds, const Model& model) {
  for (std::size_t k = 0; k < folds.size(); ++k) {
    const Model& fold = folds[k];
    if (const std::string difference = difference_of_columns(fold, model); !difference.empty()) {
      throw std::invalid_argument(
          fmt::format("the intervals belong to another model: fold {} and the model have {}", k, difference));
    }
    check_columns_belong("input", "x", fold.inputs(), model.inputs(), k);
    check_columns_belong("output", "y", fold.outputs(), model.outputs(), k);
  }
}

}  // namespace llmt
