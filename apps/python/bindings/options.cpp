#include "python/bindings/options.hpp"

#include <fmt/format.h>
#include <nanobind/stl/string.h>
#include <nanobind/stl/vector.h>

#include <functional>
#include <map>
#include <stdexcept>
#include <string>

namespace llmt::python {
namespace {

using Setter = std::function<void(nb::handle)>;
using Setters = std::map<std::string, Setter, std::less<>>;

template <class Value>
Setter number(Value& value) {
  return [&value](nb::handle given) { value = nb::cast<Value>(given); };
}

template <class Enum>
Setter choice(Enum& value) {
  return [&value](nb::handle given) { value = parse<Enum>(nb::cast<std::string>(given)); };
}

void apply(const nb::dict& given, const Setters& setters) {
  for (const auto& [key, value] : given) {
    const auto name = nb::cast<std::string>(key);
    const auto setter = setters.find(name);
    if (setter == setters.end()) throw std::invalid_argument(fmt::format("there is no option \"{}\"", name));
    try {
      setter->second(value);
    } catch (const nb::cast_error&) {
      throw nb::type_error(
          fmt::format("option \"{}\": {} is of the wrong type", name, nb::repr(value).c_str()).c_str());
    }
  }
}

std::vector<Trend> trends_of(nb::handle given) {
  const std::map<int, Trend> trends = {{-1, Trend::falling}, {0, Trend::any}, {1, Trend::rising}};
  std::vector<Trend> result;
  for (const int sign : nb::cast<std::vector<int>>(given)) {
    const auto trend = trends.find(sign);
    if (trend == trends.end()) throw std::invalid_argument(fmt::format("a trend is -1, 0 or 1, not {}", sign));
    result.push_back(trend->second);
  }
  return result;
}

}  // namespace

FitOptions options_of(const nb::dict& given) {
  FitOptions options;
  ExpertOptions& expert = options.expert;
  bool contiguous = false;
  bool prune = false;
  apply(given, {{"rule", choice(options.rule)},
                {"max_leaves", number(options.max_leaves)},
                {"min_leaf_samples", number(options.min_leaf_samples)},
                {"significance", number(options.significance)},
                {"split_inputs", number(options.split_inputs)},
                {"regression_inputs", number(options.regression_inputs)},
                {"choose_inputs", number(options.choose_inputs)},
                {"shared_partition", number(options.shared_partition)},
                {"prune", number(prune)},
                {"validity", choice(options.validity)},
                {"terms", choice(options.terms)},
                {"loss", choice(options.loss)},
                {"sparse", choice(options.sparse)},
                {"folds", number(options.folds.count)},
                {"contiguous", number(contiguous)},
                {"seed", number(options.folds.seed)},
                {"trends", [&options](nb::handle signs) { options.trends = trends_of(signs); }},
                {"intervals", number(options.intervals)},
                {"max_threads", number(options.max_threads)},
                {"search", choice(expert.search)},
                {"estimation", choice(expert.estimation)},
                {"widths", number(expert.widths)},
                {"jumps", number(expert.jumps)},
                {"ridges", number(expert.ridges)},
                {"shrinkages", number(expert.shrinkages)}});
  if (contiguous) options.folds.kind = FoldKind::contiguous;
  if (prune) options.pruning = Pruning::weakest_link;
  return options;
}

StreamOptions stream_options_of(const nb::dict& given) {
  StreamOptions options;
  apply(given, {{"significance", number(options.significance)},
                {"min_leaf_samples", number(options.min_leaf_samples)},
                {"max_leaves", number(options.max_leaves)},
                {"bins", number(options.bins)},
                {"shrinkage", number(options.shrinkage)},
                {"reservoir_rows", number(options.reservoir_rows)}});
  return options;
}

BoostOptions boost_options_of(const nb::dict& given) {
  BoostOptions options;
  apply(given, {{"rate", number(options.rate)},
                {"max_rounds", number(options.max_rounds)},
                {"mean_of_few", number(options.mean_of_few)},
                {"seed", number(options.seed)},
                {"max_threads", number(options.max_threads)}});
  return options;
}

}  // namespace llmt::python
