// Sums of trees as C.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <vector>

#include "c_source/c_text.hpp"
#include "llmt/c_source.hpp"

namespace llmt {
namespace {

const char* const c_boosted_tables = R"(
struct @_input {
  double centre, deviation, levels; /* levels: how many, of a category */
  double empty; /* the level of a missing value, or -1 */
};

struct @_feature {
  int first_part, parts, level; /* level: -1 for a number */
};

struct @_part {
  int input;
  double factor;
};

struct @_split {
  int feature, left, right; /* children: splits, or -1 - k for leaf k */
  double threshold, half_width;
  double missing_left; /* part of a row without the feature on the left side */
};

struct @_leaf {
  int first_term, terms;
  double constant, low, high;
};

struct @_term {
  int feature;
  double slope, missing; /* missing: what stands in for a missing feature, times the slope */
};

struct @_root {
  int at; /* a split, or -1 - k for leaf k */
  double smallest; /* part of a row on one side of a split */
};

struct @_output {
  int first_tree, trees; /* of the roots */
  double base, rate;
};
)";

const char* const c_boosted_runtime = R"(
static double @_feature_at(const struct @_feature *f, const double *x) {
  double sum = 0.0;
  int k;
  if (f->level >= 0) {
    const int input = @_parts[f->first_part].input;
    const double level = x[input] == x[input] ? x[input] : @_inputs[input].empty;
    if (!(level >= 0.0 && level < @_inputs[input].levels && level == (double)(int)level)) return NAN;
    return level == (double)f->level ? 1.0 : 0.0;
  }
  for (k = f->first_part; k < f->first_part + f->parts; ++k) {
    const struct @_input *of = @_inputs + @_parts[k].input;
    sum += @_parts[k].factor * ((x[@_parts[k].input] - of->centre) / of->deviation);
  }
  return sum;
}

static double @_leaf_at(const struct @_leaf *leaf, const double *z) {
  double value = leaf->constant;
  int k;
  for (k = leaf->first_term; k < leaf->first_term + leaf->terms; ++k) {
    const double of_feature = z[@_terms[k].feature];
    value += of_feature == of_feature ? @_terms[k].slope * of_feature : @_terms[k].missing;
  }
  return value < leaf->low ? leaf->low : leaf->high < value ? leaf->high : value;
}

/* The sides of a split are summed in the order of the library: all below the left one first. */
static double @_tree(const struct @_root *root, const double *z) {
  int waiting[@_DEPTH + 1] = {0};
  double shares[@_DEPTH + 1] = {0.0};
  double sums[@_DEPTH + 1] = {0.0};
  double share = 1.0;
  double sum = 0.0;
  int at = root->at;
  int count = 0;
  for (;;) {
    while (at >= 0) {
      const struct @_split *s = @_splits + at;
      const double value = z[s->feature];
      const double beyond = value - s->threshold;
      if (value != value) {
        at = s->missing_left == 1.0 ? s->left : s->right;
        if (s->missing_left > 0.0 && s->missing_left < 1.0) {
          waiting[count] = s->right;
          shares[count] = share * (1.0 - s->missing_left);
          sums[count++] = sum;
          at = s->left;
          share *= s->missing_left;
          sum = 0.0;
        }
        continue;
      }
      if ((beyond < 0.0 ? -beyond : beyond) < s->half_width) {
        const double u = beyond / s->half_width;
        const double right = 0.5 + u * (3.0 - u * u) / 4.0;
        if (share * (right < 1.0 - right ? right : 1.0 - right) >= root->smallest) {
          waiting[count] = s->right;
          shares[count] = share * right;
          sums[count++] = sum;
          at = s->left;
          share *= 1.0 - right;
          sum = 0.0;
          continue;
        }
      }
      at = value <= s->threshold ? s->left : s->right;
    }
    sum += share * @_leaf_at(@_leaves + (-1 - at), z);
    if (count == 0) return sum;
    --count;
    sum = sums[count] + sum;
    share = shares[count];
    at = waiting[count];
  }
}

int @_predict(const double *inputs, double *outputs) {
  double z[@_FEATURES];
  int i, k;
  for (i = 0; i < @_INPUTS; ++i) {
    if (inputs[i] == inputs[i] && inputs[i] - inputs[i] != 0.0) return 1;
  }
  for (i = 0; i < @_FEATURES; ++i) z[i] = @_feature_at(@_features + i, inputs);
  for (i = 0; i < @_OUTPUTS; ++i) {
    const struct @_output *output = @_outputs + i;
    double sum = 0.0;
    for (k = output->first_tree; k < output->first_tree + output->trees; ++k) sum += @_tree(@_roots + k, z);
    outputs[i] = output->base + output->rate * sum;
  }
  return 0;
}
)";

// Splits on the longest way to a leaf. A child stands behind its parent.
std::size_t depth_of(const BoostedTree& tree) {
  std::vector<std::size_t> depth(tree.splits.size(), 1);
  std::size_t deepest = 0;
  for (std::size_t k = 0; k < tree.splits.size(); ++k) {
    deepest = std::max(deepest, depth[k]);
    for (const int child : {tree.splits[k].left, tree.splits[k].right}) {
      if (child >= 0) depth[child] = depth[k] + 1;
    }
  }
  return deepest;
}

// The entries of the tables, of all trees of all outputs one after the other.
struct Entries {
  std::vector<std::string> features;
  std::vector<std::string> parts;
  std::vector<std::string> splits;
  std::vector<std::string> leaves;
  std::vector<std::string> terms;
  std::vector<std::string> outputs;
  std::vector<std::string> roots;
  std::size_t depth = 0;

  void add_tree(const BoostedTree& tree, std::size_t first_feature) {
    const auto child = [first_split = splits.size(), first_leaf = leaves.size()](int k) {
      return k >= 0 ? static_cast<int>(first_split) + k : k - static_cast<int>(first_leaf);
    };
    depth = std::max(depth, depth_of(tree));
    roots.push_back(
        fmt::format("{{{}, {}}}", child(tree.splits.empty() ? -1 : 0), Tables::number(tree.smallest_share)));
    std::vector<std::string> of_tree;
    for (const BoostedSplit& split : tree.splits) {
      of_tree.push_back(fmt::format("{{{}, {}, {}, {}, {}, {}}}", first_feature + split.feature, child(split.left),
                                    child(split.right), Tables::number(split.threshold),
                                    Tables::number(split.half_width), Tables::number(split.missing_left)));
    }
    splits.insert(splits.end(), of_tree.begin(), of_tree.end());
    for (const BoostedLeaf& leaf : tree.leaves) {
      leaves.push_back(fmt::format("{{{}, {}, {}, {}, {}}}", terms.size(), leaf.features.size(),
                                   Tables::number(leaf.constant), Tables::number(leaf.low), Tables::number(leaf.high)));
      for (std::size_t k = 0; k < leaf.features.size(); ++k) {
        const double missing = leaf.means.empty() ? 0.0 : leaf.slopes[k] * leaf.means[k];
        terms.push_back(fmt::format("{{{}, {}, {}}}", first_feature + leaf.features[k], Tables::number(leaf.slopes[k]),
                                    Tables::number(missing)));
      }
    }
  }

  void add_sum(const BoostedSum& sum) {
    const std::size_t first_feature = features.size();
    for (const BoostedFeature& feature : sum.features) {
      features.push_back(fmt::format("{{{}, {}, {}}}", parts.size(), feature.inputs.size(), feature.level));
      for (std::size_t k = 0; k < feature.inputs.size(); ++k) {
        parts.push_back(fmt::format("{{{}, {}}}", feature.inputs[k], Tables::number(feature.factors[k])));
      }
    }
    outputs.push_back(fmt::format("{{{}, {}, {}, {}}}", roots.size(), sum.trees.size(), Tables::number(sum.base),
                                  Tables::number(sum.rate)));
    for (const BoostedTree& tree : sum.trees) add_tree(tree, first_feature);
  }
};

// C knows no empty table.
std::vector<std::string> or_zeros(std::vector<std::string> entries) {
  if (entries.empty()) entries.emplace_back("{0}");
  return entries;
}

}  // namespace

CSource to_c(const BoostedModel& model, const std::string& name, const std::string& header_name) {
  check_c_name(name);
  Entries entries;
  for (const BoostedSum& sum : model.sums()) entries.add_sum(sum);
  std::vector<std::string> inputs;
  for (std::size_t j = 0; j < model.inputs().size(); ++j) {
    const InputColumn& input = model.inputs()[j];
    const auto levels = static_cast<double>(input.levels.size());
    inputs.push_back(fmt::format("{{{}, {}, {}, {}}}", Tables::number(input.centre),
                                 Tables::number(model.deviations()[j]), Tables::number(levels),
                                 Tables::number(input.has_empty_level() ? levels - 1.0 : -1.0)));
  }
  Tables tables(name);
  const auto add = [&](const char* what, const char* type, const std::vector<std::string>& of) {
    tables.add(what, fmt::format("struct {}_{}", name, type).c_str(), or_zeros(of));
  };
  add("inputs", "input", inputs);
  add("features", "feature", entries.features);
  add("parts", "part", entries.parts);
  add("splits", "split", entries.splits);
  add("leaves", "leaf", entries.leaves);
  add("terms", "term", entries.terms);
  add("outputs", "output", entries.outputs);
  add("roots", "root", entries.roots);
  const std::string sizes =
      fmt::format("enum {{ @_INPUTS = {}, @_OUTPUTS = {}, @_FEATURES = {}, @_DEPTH = {} }};\n", model.num_inputs(),
                  model.num_outputs(), std::max<std::size_t>(entries.features.size(), 1), entries.depth);
  return c_source_of(head_comment("Sum of local linear model trees", model.inputs(), model.outputs(), name), name,
                     header_name, sizes + c_boosted_tables, tables, c_boosted_runtime);
}

}  // namespace llmt
