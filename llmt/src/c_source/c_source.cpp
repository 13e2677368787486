#include "llmt/c_source.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <vector>

#include "base/simd.hpp"
#include "c_source/c_text.hpp"
#include "c_source/runtime.hpp"
#include "partition/leaf_validities.hpp"
#include "partition/tree.hpp"

namespace llmt {
namespace {

const char* const c_gaussians = R"(
static void @_add_gaussians(const struct @_partition *p, const double *x, const double *d, double *sums) {
  double exponent[@_LEAVES];
  double largest = -HUGE_VAL;
  double sum = 0.0;
  int i, j;
  for (i = 0; i < p->leaves; ++i) {
    double s[4] = {0.0, 0.0, 0.0, 0.0};
    for (j = 0; j < @_INPUTS; ++j) {
      const long at = (long)i * @_INPUTS + j;
      const double z = x[j] != x[j] ? 0.0 : (x[j] - p->centres[at]) * p->per_sigma[at];
      s[j % 4] += z * z;
    }
    exponent[i] = -0.5 * @_sum(s);
    if (largest < exponent[i]) largest = exponent[i];
  }
  for (i = 0; i < p->leaves; ++i) {
    exponent[i] = exponent[i] - largest >= -40.0 ? exp(exponent[i] - largest) : 0.0;
    sum += exponent[i];
  }
  for (i = 0; i < p->leaves; ++i) {
    if (exponent[i] > 0.0) @_add(p, p->leaf_nodes[i], exponent[i] / sum, d, sums);
  }
}
)";

const char* const c_codes = R"(
/* The position of the nearest code; of two, the smaller. */
static double @_position(const double *codes, int count, double value) {
  int above = 0;
  if (value != value) return value;
  while (above < count && codes[above] < value) ++above;
  if (above == 0) return 0.0;
  return above < count && codes[above] - value < value - codes[above - 1] ? above : above - 1;
}
)";

void append_padded(std::vector<double>& to, const auto& values, Eigen::Index stride) {
  to.insert(to.end(), values.begin(), values.end());
  to.resize(to.size() + (stride - std::ssize(values)), 0.0);
}

std::vector<double> node_table(const Partition& partition, Eigen::Index stride) {
  std::vector<double> table;
  for (const Node& node : partition.nodes) {
    append_padded(table, node.low, stride);
    append_padded(table, node.high, stride);
    append_padded(table, node.mean, stride);
    for (Eigen::Index o = 0; o < node.slope.rows(); ++o) append_padded(table, node.slope.row(o), stride);
  }
  return table;
}

std::vector<double> by_rows(const Eigen::MatrixXd& matrix) {
  std::vector<double> values;
  for (Eigen::Index i = 0; i < matrix.rows(); ++i)
    values.insert(values.end(), matrix.row(i).begin(), matrix.row(i).end());
  return values;
}

std::vector<double> residual_ranges(const Partition& partition) {
  if (partition.residual_range.size() == 0) return {};
  Eigen::MatrixXd range = partition.residual_range;
  const Eigen::VectorXd margin = 0.1 * (range.col(1) - range.col(0));
  range.col(0) -= margin;
  range.col(1) += margin;
  return by_rows(range);
}

// One partition's tables; returns the initialiser of its struct.
std::string add_partition(Tables& tables, const Model& model, std::size_t index, Eigen::Index stride,
                          const std::string& name) {
  const Partition& partition = model.partitions()[index];
  const LeafValidities validities(partition, model.inputs());
  const auto of = [&](const char* what) { return fmt::format("p{}_{}", index, what); };
  std::vector<std::string> branches;
  for (const LeafValidities::Branch& b : validities.branches()) {
    branches.push_back(fmt::format("{{{}, {}, {}, {}, {}, {}, {}, {}, {}, {}}}", b.left, b.right, b.input,
                                   b.first_level, b.levels, b.first_term, b.terms, Tables::number(b.threshold),
                                   Tables::number(b.per_half_width), Tables::number(b.missing_left)));
  }
  std::vector<std::string> terms;
  for (const LeafValidities::Term& t : validities.terms()) {
    terms.push_back(fmt::format("{{{}, {}, {}}}", t.input, Tables::number(t.weight), Tables::number(t.centre)));
  }
  std::vector<double> values;
  for (const Node& node : partition.nodes) values.insert(values.end(), node.value.begin(), node.value.end());
  const Eigen::MatrixXd& outer =
      partition.outer_slope.size() > 0 ? partition.outer_slope : partition.nodes.front().slope;
  std::vector<double> outer_slopes;
  for (Eigen::Index o = 0; o < outer.rows(); ++o) append_padded(outer_slopes, outer.row(o), stride);
  const LeafValidities::Gaussians& gaussians = validities.gaussians();
  std::vector<double> centres;
  std::vector<double> per_sigma;
  for (std::size_t i = 0; i < gaussians.nodes.size(); ++i) {
    for (Eigen::Index j = 0; j < gaussians.inputs; ++j) {
      centres.push_back(gaussians.centres[i * gaussians.stride + j]);
      per_sigma.push_back(gaussians.per_sigma[i * gaussians.stride + j]);
    }
  }
  const ValidityKind kind = partition.validity.kind;
  const int kind_number = kind == ValidityKind::logistic ? 1 : kind == ValidityKind::gaussian ? 2 : 0;
  std::vector<std::string> parts = {std::to_string(kind_number), std::to_string(partition.outputs.size())};
  parts.push_back(tables.add(of("columns"), partition.outputs));
  parts.push_back(tables.add(of("branches"), fmt::format("struct {}_branch", name).c_str(), branches));
  parts.push_back(tables.add(of("level_share"), validities.level_shares()));
  parts.push_back(tables.add(of("terms"), fmt::format("struct {}_term", name).c_str(), terms));
  parts.push_back(tables.add(of("parents"), parents_of(partition)));
  parts.push_back(tables.add(of("nodes"), node_table(partition, stride)));
  parts.push_back(tables.add(of("values"), values));
  parts.push_back(tables.add(of("outer"), outer_slopes));
  parts.push_back(tables.add(of("residual_range"), residual_ranges(partition)));
  parts.push_back(tables.add(of("output_range"), by_rows(partition.output_range)));
  parts.push_back(std::to_string(gaussians.nodes.size()));
  parts.push_back(tables.add(of("leaf_nodes"), gaussians.nodes));
  parts.push_back(tables.add(of("centres"), centres));
  parts.push_back(tables.add(of("per_sigma"), per_sigma));
  std::string text;
  for (const std::string& part : parts) text += (text.empty() ? "{" : ", ") + part;
  return text + "}";
}

void add_inputs(Tables& tables, const Model& model, const std::string& name) {
  std::vector<double> extents;
  for (const InputColumn& input : model.inputs()) extents.insert(extents.end(), {input.low, input.high, input.centre});
  std::vector<std::string> regressors;
  bool products = false;
  for (const Regressor& r : model.regressors()) {
    products = products || r.second_input >= 0;
    regressors.push_back(fmt::format("{{{}, {}, {}, {}, {}}}", r.input, r.second_input, r.level,
                                     Tables::number(static_cast<double>(model.inputs()[r.input].levels.size())),
                                     Tables::number(r.centre)));
  }
  tables.add("inputs", extents);
  if (regressors.empty()) regressors.emplace_back("{0, -1, -1, 0.0, 0.0}");
  tables.add("regressors", fmt::format("struct {}_regressor", name).c_str(), regressors);
}

// The function that the header declares.
std::string predict_function(Tables& tables, const Model& model, bool gaussian) {
  std::string codes;
  for (std::size_t j = 0; j < model.inputs().size(); ++j) {
    const InputColumn& input = model.inputs()[j];
    const std::vector<double>& of_input = input.codes;
    const std::string empty =
        input.has_empty_level() ? fmt::format("x[{0}] != x[{0}] ? {1}.0 : ", j, input.levels.size() - 1) : "";
    if (!of_input.empty()) {
      const std::string table = tables.add(fmt::format("codes{}", j), of_input);
      codes += fmt::format("  x[{0}] = {3}@_position({1}, {2}, x[{0}]);\n", j, table, of_input.size(), empty);
    } else if (!empty.empty()) {
      codes += fmt::format("  x[{0}] = {1}x[{0}];\n", j, empty);
    }
  }
  return fmt::format(R"(
int @_predict(const double *inputs, double *outputs) {{
  double x[@_INPUTS];
  double d[@_STRIDE];
  double sums[@_OUTPUTS];
  int i, o;
  for (i = 0; i < @_INPUTS; ++i) {{
    x[i] = inputs[i];
    if (x[i] == x[i] && x[i] - x[i] != 0.0) return 1;
  }}
{}  @_deviations(x, d);
  for (i = 0; i < (int)(sizeof @_partitions / sizeof @_partitions[0]); ++i) {{
    const struct @_partition *p = @_partitions + i;
    for (o = 0; o < p->outputs; ++o) sums[o] = 0.0;
{}    @_finish(p, d, sums);
    for (o = 0; o < p->outputs; ++o) outputs[p->columns[o]] = sums[o];
  }}
  return 0;
}}
)",
                     codes,
                     gaussian ? "    if (p->kind == 2) {\n      @_add_gaussians(p, x, d, sums);\n    } else {\n      "
                                "@_add_tree(p, x, d, sums);\n    }\n"
                              : "    @_add_tree(p, x, d, sums);\n");
}

// Sizes of the arrays on the stack.
std::string sizes(const Model& model, Eigen::Index stride) {
  Eigen::Index depth = 0;
  std::size_t leaves = 1;
  for (const Partition& partition : model.partitions()) {
    const LeafValidities validities(partition, model.inputs());
    depth = std::max(depth, validities.depth());
    leaves = std::max(leaves, validities.gaussians().nodes.size());
  }
  return fmt::format(
      "enum {{ @_INPUTS = {}, @_OUTPUTS = {}, @_REGRESSORS = {}, @_STRIDE = {}, @_DEPTH = {}, @_LEAVES = {} }};\n",
      model.num_inputs(), model.num_outputs(), model.regressors().size(), stride, depth, leaves);
}

}  // namespace

CSource to_c(const Model& model, const std::string& name, const std::string& header_name) {
  check_c_name(name);
  const Eigen::Index stride = std::max(padded_to_quads(std::ssize(model.regressors())), quad);
  Tables tables(name);
  add_inputs(tables, model, name);
  std::vector<std::string> partitions;
  bool gaussian = false;
  for (std::size_t p = 0; p < model.partitions().size(); ++p) {
    gaussian = gaussian || model.partitions()[p].validity.kind == ValidityKind::gaussian;
    partitions.push_back(add_partition(tables, model, p, stride, name));
  }
  tables.add("partitions", fmt::format("struct {}_partition", name).c_str(), partitions);
  const std::string function = predict_function(tables, model, gaussian);
  const bool codes = std::ranges::any_of(model.inputs(), [](const InputColumn& input) { return !input.codes.empty(); });
  return c_source_of(head_comment("Local linear model tree", model.inputs(), model.outputs(), name), name, header_name,
                     sizes(model, stride) + c_tables, tables,
                     std::string(c_runtime) + (gaussian ? c_gaussians : "") + (codes ? c_codes : "") + function);
}

}  // namespace llmt
