// Models of systems that move as C.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "c_source/c_text.hpp"
#include "llmt/c_source.hpp"
#include "llmt/dynamic_source.hpp"

namespace llmt {
namespace {

const char* const header_part = R"(
/* The past of a run. All of it is set by @_start(). */
struct @_state {
  double inputs[@_MEMORY + 1][@_SYSTEM_INPUTS + 1];
  double held[@_MEMORY + 1][@_SYSTEM_OUTPUTS];
  double free[@_MEMORY + 1][@_SYSTEM_OUTPUTS];
};

/* Sets the past: `rows` measured rows, at least one, the latest last; inputs and outputs row by row. Before the first
   of them the system was at rest there. */
void @_start(struct @_state *state, int rows, const double *inputs, const double *outputs);

/* The outputs at the time of these inputs; they become the past. 0, or 1 without touching anything if a value is not
   finite: the run has left all bounds. */
int @_step(struct @_state *state, const double *inputs, double *outputs);
)";

const char* const types = R"(
struct @_lag {
  int is_output, signal, lag, minus_lag;
};

struct @_product {
  int factors, factor[3];
};

struct @_standard {
  double centre, scale, low, high;
};
)";

// The order of all operations is that of the library.
const char* const runtime = R"(
static double @_held_factor(double x, double low, double high) {
  const double round = 0.1 * (high - low);
  const double beyond = x > high ? x - high : low - x;
  const double parabola = 0.5 * beyond * beyond / round;
  return x > high  ? (beyond >= round ? high + 0.5 * round : x - parabola)
         : x < low ? (beyond >= round ? low - 0.5 * round : x + parabola)
                   : x;
}

static void @_polynomial(const double *x, double *y) {
  double z[2 * @_COLUMNS];
  double products[@_TERMS + 1];
  int j, k, o;
  for (j = 0; j < @_COLUMNS; ++j) {
    const struct @_standard *s = @_standards + j;
    const double held = @_IS_HELD ? @_held_factor(x[j], s->low, s->high) : x[j];
    z[j] = (x[j] - s->centre) / s->scale;
    z[@_COLUMNS + j] = (held - s->centre) / s->scale;
  }
  for (k = 0; k < @_TERMS; ++k) {
    const struct @_product *p = @_products + k;
    const double *factors = p->factors > 1 ? z + @_COLUMNS : z;
    products[k] = 1.0;
    for (j = 0; j < p->factors; ++j) products[k] *= factors[p->factor[j]];
  }
  for (o = 0; o < @_SYSTEM_OUTPUTS; ++o) {
    double sum = 0.0;
    for (k = 0; k < @_TERMS; ++k) sum += @_coefficients[o * @_TERMS + k] * products[k];
    y[o] = sum;
  }
}

void @_start(struct @_state *state, int rows, const double *inputs, const double *outputs) {
  int row, k;
  for (row = 0; row < @_MEMORY; ++row) {
    const int from = rows - @_MEMORY + row < 0 ? 0 : rows - @_MEMORY + row;
    for (k = 0; k < @_SYSTEM_INPUTS; ++k) state->inputs[row + 1][k] = inputs[from * @_SYSTEM_INPUTS + k];
    for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) {
      state->held[row][k] = outputs[from * @_SYSTEM_OUTPUTS + k];
      state->free[row][k] = state->held[row][k];
    }
  }
}

int @_step(struct @_state *state, const double *inputs, double *outputs) {
  double x[@_COLUMNS], y[@_SYSTEM_OUTPUTS];
  int row, k;
  for (k = 0; k < @_SYSTEM_INPUTS; ++k) {
    if (inputs[k] - inputs[k] != 0.0) return 1;
  }
  for (k = 0; k < @_COLUMNS; ++k) {
    const struct @_lag *c = @_lags + k;
    if (!c->is_output) {
      x[k] = c->lag == 0 ? inputs[c->signal] : state->inputs[@_MEMORY + 1 - c->lag][c->signal];
    } else if (c->minus_lag < 0) {
      x[k] = state->held[@_MEMORY - c->lag][c->signal];
    } else {
      x[k] = state->free[@_MEMORY - c->lag][c->signal] - state->held[@_MEMORY - c->minus_lag][c->signal];
    }
    if (x[k] - x[k] != 0.0) return 1;
  }
  @_polynomial(x, y);
%REST%%LAST%  for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) {
    if (y[k] - y[k] != 0.0) return 1;
  }
  for (row = 0; row + 1 < @_MEMORY; ++row) {
    for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) {
      state->held[row][k] = state->held[row + 1][k];
      state->free[row][k] = state->free[row + 1][k];
    }
  }
  for (row = 1; row < @_MEMORY; ++row) {
    for (k = 0; k < @_SYSTEM_INPUTS; ++k) state->inputs[row][k] = state->inputs[row + 1][k];
  }
  for (k = 0; k < @_SYSTEM_INPUTS && @_MEMORY > 0; ++k) state->inputs[@_MEMORY][k] = inputs[k];
  for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) {
    const double *stop = @_stops + 2 * k;
    outputs[k] = y[k] < stop[0] ? stop[0] : stop[1] < y[k] ? stop[1] : y[k];
    if (@_MEMORY > 0) {
      state->held[@_MEMORY - 1][k] = outputs[k];
      state->free[@_MEMORY - 1][k] = y[k];
    }
  }
  return 0;
}
)";

const char* const rest_step = R"(  {
    double rest[@_SYSTEM_OUTPUTS];
    if (@_predict(x, rest) != 0) return 1;
    for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) y[k] += rest[k];
  }
)";

const char* const last_step = R"(  for (k = 0; k < @_SYSTEM_OUTPUTS; ++k) {
    if (@_adds_up[k] != 0) y[k] += state->held[@_MEMORY - 1][k];
  }
)";

std::string replaced_once(std::string text, const std::string& what, const std::string& by) {
  return text.replace(text.find(what), what.size(), by);
}

void add_tables(Tables& tables, const DynamicModel& model, const std::string& name) {
  const Polynomial& polynomial = model.parts().polynomial;
  std::vector<std::string> lags;
  for (const LaggedColumn& c : model.columns()) {
    lags.push_back(fmt::format("{{{}, {}, {}, {}}}", c.is_output ? 1 : 0, c.signal, c.lag, c.minus_lag));
  }
  tables.add("lags", fmt::format("struct {}_lag", name).c_str(), lags);
  std::vector<std::string> standards;
  for (Eigen::Index j = 0; j < polynomial.centre.size(); ++j) {
    standards.push_back(fmt::format("{{{}, {}, {}, {}}}", Tables::number(polynomial.centre(j)),
                                    Tables::number(polynomial.scale(j)), Tables::number(polynomial.low(j)),
                                    Tables::number(polynomial.high(j))));
  }
  tables.add("standards", fmt::format("struct {}_standard", name).c_str(), standards);
  std::vector<std::string> products;
  for (const std::vector<int>& term : polynomial.terms) {
    std::vector<int> factors = term;
    factors.resize(most_degree, 0);
    products.push_back(fmt::format("{{{}, {{{}, {}, {}}}}}", term.size(), factors[0], factors[1], factors[2]));
  }
  std::vector<double> coefficients;
  for (const auto& row : polynomial.coefficients.rowwise()) {
    coefficients.insert(coefficients.end(), row.begin(), row.end());
  }
  // C knows no empty table.
  if (products.empty()) products.emplace_back("{0, {0, 0, 0}}");
  if (coefficients.empty()) coefficients.push_back(0.0);
  tables.add("products", fmt::format("struct {}_product", name).c_str(), products);
  tables.add("coefficients", coefficients);
  std::vector<double> stops;
  for (const Signal& output : model.parts().outputs) stops.insert(stops.end(), {output.lower_stop, output.upper_stop});
  tables.add("stops", stops);
  const std::vector<bool>& adds_up = model.parts().lags.adds_up;
  if (!adds_up.empty()) tables.add("adds_up", std::vector<int>(adds_up.begin(), adds_up.end()));
}

}  // namespace

CSource to_c(const DynamicModel& model, const std::string& name, const std::string& header_name) {
  check_c_name(name);
  const DynamicParts& parts = model.parts();
  CSource result;
  const bool has_rest = !std::holds_alternative<std::monostate>(parts.rest);
  if (const auto* tree = std::get_if<Model>(&parts.rest)) result = to_c(*tree, name, header_name);
  if (const auto* sum = std::get_if<BoostedModel>(&parts.rest)) result = to_c(*sum, name, header_name);
  if (!has_rest) {
    result.header = with_name("#ifndef @_MODEL_H\n#define @_MODEL_H\n\n#endif\n", name);
    result.source = fmt::format("#include \"{}\"\n\n#include <math.h>\n", header_name);
  }
  std::string comment = fmt::format("/* A system that moves, a row every {} {}, written by llmt.\n", parts.sample_time,
                                    c_comment(parts.time_unit));
  const auto list = [&](const char* what, const std::vector<Signal>& signals) {
    for (std::size_t k = 0; k < signals.size(); ++k) {
      comment += fmt::format("   {}[{}]: {}{}{}\n", what, k, c_comment(signals[k].name),
                             signals[k].unit.empty() ? "" : ", ", c_comment(signals[k].unit));
    }
  };
  list("inputs of a step", parts.inputs);
  list("outputs of a step", parts.outputs);
  comment += "*/\n";
  const std::string sizes = fmt::format("\nenum {{ @_SYSTEM_INPUTS = {}, @_SYSTEM_OUTPUTS = {}, @_MEMORY = {} }};\n",
                                        parts.inputs.size(), parts.outputs.size(), model.memory());
  const std::size_t end = result.header.rfind("#endif");
  result.header.insert(end, with_name(comment + sizes + header_part + "\n", name));
  Tables tables(name);
  add_tables(tables, model, name);
  const std::string private_sizes =
      fmt::format("\nenum {{ @_COLUMNS = {}, @_TERMS = {}, @_IS_HELD = {} }};\n", model.columns().size(),
                  parts.polynomial.terms.size(), parts.polynomial.is_held ? 1 : 0);
  std::string steps = replaced_once(runtime, "%REST%", has_rest ? rest_step : "");
  steps = replaced_once(std::move(steps), "%LAST%", parts.lags.adds_up.empty() ? "" : last_step);
  result.source += with_name(private_sizes + types, name) + tables.text() + with_name(steps, name);
  return result;
}

}  // namespace llmt
