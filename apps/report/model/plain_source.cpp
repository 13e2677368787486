#include "report/model/plain_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <vector>

#include "report/model/plain_words.hpp"
#include "report/model/rules.hpp"

namespace llmt::report {
namespace {

constexpr double known_or_not = std::numeric_limits<double>::max();  // a split into rows with and without a value

// The variables of one function: of each input its argument, and what equations are made of.
struct Variables {
  std::vector<std::string> argument;   // of each input; empty: not used
  std::vector<std::string> regressor;  // of each regressor; empty: not used
  std::vector<PlainArgument> arguments;
  std::vector<PlainDefinition> definitions;
};

// Whether a single equation goes on beyond the training rows. Its slopes there may be written out.
bool continues(const Partition& partition) {
  return partition.num_leaves() == 1 &&
         (partition.outer_slope.size() == 0 || partition.outer_slope == partition.nodes.front().slope);
}

class Writer {
 public:
  Writer(const Model& model, const PlainWords& words) : model_(model), words_(words) {}

  // The definitions and the body of one partition.
  Variables variables(const Partition& partition) const {
    Variables made;
    std::set<std::string> taken = words_.reserved();
    const auto unused = [&](const std::string& wish) {
      std::string name = words_.identifier(wish);
      for (int k = 2; !taken.insert(name).second; ++k) name = words_.identifier(fmt::format("{}_{}", wish, k));
      return name;
    };
    const std::vector<bool> has_slope = slopes_of(partition);
    std::vector<bool> used(model_.inputs().size(), false);
    for (const Node& node : partition.nodes) {
      if (!node.is_leaf()) used[node.split_input] = true;
    }
    for (std::size_t k = 0; k < has_slope.size(); ++k) {
      if (!has_slope[k]) continue;
      used[model_.regressors()[k].input] = true;
      if (const int second = model_.regressors()[k].second_input; second >= 0) used[second] = true;
    }
    made.argument.resize(used.size());
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (!used[j]) continue;
      const std::string& name = model_.inputs()[j].name;
      made.argument[j] = words_.column(name).empty() ? unused(name) : words_.column(name);
      made.arguments.push_back(
          {made.argument[j], name, model_.inputs()[j].is_categorical() && model_.inputs()[j].codes.empty()});
    }
    for (std::size_t j = 0; j < used.size(); ++j) {
      if (!used[j]) continue;
      const std::string& given = made.argument[j];
      std::string known = words_.known(given, model_.inputs()[j]);
      if (known == given) continue;
      if (!words_.column(given).empty()) made.argument[j] = unused(model_.inputs()[j].name + "_known");
      made.definitions.push_back({made.argument[j], std::move(known)});
    }
    made.regressor.resize(has_slope.size());
    std::vector<std::string> factors(used.size());
    const bool is_held = !continues(partition);
    for (std::size_t k = 0; k < has_slope.size(); ++k) {
      if (!has_slope[k]) continue;
      const Regressor& regressor = model_.regressors()[k];
      const InputColumn& input = model_.inputs()[regressor.input];
      const std::string& x = made.argument[regressor.input];
      const auto define = [&](const std::string& wish, const std::string& expression) {
        made.definitions.push_back({unused(wish), expression});
        return made.definitions.back().name;
      };
      if (regressor.level >= 0) {
        made.regressor[k] = define(input.name + "_is_" + input.shown_level(regressor.level), indicator(x, regressor));
      } else if (regressor.second_input < 0) {
        made.regressor[k] = define(input.name + "_held", is_held ? words_.held(x, input.low, input.high, input.centre)
                                                                 : words_.or_mean(x, input.centre));
      } else {
        for (const int j : {regressor.input, regressor.second_input}) {
          const InputColumn& factor = model_.inputs()[j];
          if (!factors[j].empty()) continue;
          const std::string held = words_.held(made.argument[j], factor.low, factor.high, factor.centre);
          factors[j] = define(factor.name + "_off", held + signed_text(-factor.centre));
        }
        const std::string product = factors[regressor.input] + " * " + factors[regressor.second_input];
        const Node& root = partition.nodes.front();
        made.regressor[k] = define(input.name + "_x_" + model_.inputs()[regressor.second_input].name,
                                   is_held ? words_.held(product, root.low(k), root.high(k), 0.0) : product);
      }
    }
    return made;
  }

  // if (...) ... else ..., from a node down.
  void add_rules(const Partition& partition, const Variables& variables, const std::vector<Leaf>& leaves, int output,
                 int node, int depth, std::string& text) const {
    const Node& here = partition.nodes[node];
    if (here.is_leaf()) {
      const auto leaf = std::ranges::find(leaves, node, &Leaf::node);
      text += words_.result(equation(variables, *leaf, output), depth);
      return;
    }
    text += words_.if_open(goes_left(variables, here), depth);
    add_rules(partition, variables, leaves, output, here.left, depth + 1, text);
    text += words_.if_else(depth);
    add_rules(partition, variables, leaves, output, here.right, depth + 1, text);
    text += words_.if_close(depth);
  }

 private:
  std::vector<bool> slopes_of(const Partition& partition) const {
    std::vector<bool> has_slope(model_.regressors().size(), false);
    for (const Node& node : partition.nodes) {
      for (std::size_t k = 0; node.is_leaf() && k < has_slope.size(); ++k)
        has_slope[k] = has_slope[k] || !node.slope.col(static_cast<Eigen::Index>(k)).isZero(0.0);
    }
    return has_slope;
  }

  static std::string signed_text(double value) {
    if (value == 0.0) return "";
    return fmt::format(" {} {}", value < 0.0 ? "-" : "+", literal(std::abs(value)));
  }

  // 1 or 0; of an unknown category its share in training.
  std::string indicator(const std::string& x, const Regressor& regressor) const {
    const InputColumn& input = model_.inputs()[regressor.input];
    std::vector<int> all(input.levels.size());
    for (std::size_t level = 0; level < all.size(); ++level) all[level] = static_cast<int>(level);
    return words_.choice(words_.among(x, input, {regressor.level}), "1",
                         words_.choice(words_.among(x, input, all), "0", literal(regressor.centre)));
  }

  std::string goes_left(const Variables& variables, const Node& node) const {
    const InputColumn& input = model_.inputs()[node.split_input];
    const std::string& x = variables.argument[node.split_input];
    const bool missing_left = node.missing_left == 1.0;
    if (node.level_side.empty() && node.threshold == known_or_not) return words_.is_known(x);
    if (node.level_side.empty()) return words_.at_most(x, literal(node.threshold), missing_left);
    std::vector<int> named;
    for (int level = 0; level < static_cast<int>(node.level_side.size()); ++level) {
      if (node.level_side[level] == (missing_left ? 1 : -1)) named.push_back(level);
    }
    return missing_left ? words_.negated(words_.among(x, input, named)) : words_.among(x, input, named);
  }

  std::string equation(const Variables& variables, const Leaf& leaf, int output) const {
    std::string text = literal(leaf.intercept(output));
    for (std::size_t k = 0; k < variables.regressor.size(); ++k) {
      const double slope = leaf.slope(output, static_cast<Eigen::Index>(k));
      if (slope == 0.0) continue;
      text += fmt::format(" {} {} * {}", slope < 0.0 ? "-" : "+", literal(std::abs(slope)), variables.regressor[k]);
    }
    return text;
  }

  const Model& model_;
  const PlainWords& words_;
};

}  // namespace

std::string plain_source(const Model& model, PlainLanguage language, const std::string& name,
                         const std::string& model_name) {
  if (!says_all(model)) {
    throw std::runtime_error(model_name +
                             ": the model is more than its rules, so plain if and equations would not be it; `llmt fit "
                             "--readable` writes a tree that is its rules, `llmt export --c` takes every model");
  }
  const std::unique_ptr<PlainWords> words = plain_words(language, name);
  std::string text = words->head(model_name);
  const Writer writer(model, *words);
  for (Eigen::Index p = 0; p < std::ssize(model.partitions()); ++p) {
    const Partition& partition = model.partitions()[p];
    const Variables variables = writer.variables(partition);
    for (std::size_t o = 0; o < partition.outputs.size(); ++o) {
      std::string rules;
      const bool is_last = p + 1 == std::ssize(model.partitions()) && o + 1 == partition.outputs.size();
      writer.add_rules(partition, variables, model.leaves(p), static_cast<int>(o), 0, 1, rules);
      text += words->function(model.outputs()[partition.outputs[o]].name, is_last, variables.arguments,
                              variables.definitions, rules);
    }
  }
  return text;
}

}  // namespace llmt::report
