#include "c_source/runtime.hpp"

namespace llmt {

const char* const c_tables = R"(
struct @_branch {
  int left, right; /* children; -1 in a leaf */
  int input;
  int first_level, levels;  /* of the level shares; -1: a number */
  int first_term, terms;    /* of an oblique split; -1: axis-orthogonal */
  double threshold, per_half_width, missing_left;
};

struct @_term {
  int input;
  double weight, centre;
};

struct @_regressor {
  int input, second, level; /* second: of a product, or -1; level: -1 for a number */
  double levels, centre;
};

struct @_partition {
  int kind, smoothness; /* 0 crisp or blend, 1 logistic, 2 Gaussian */
  int outputs;
  const int *columns; /* of the model's outputs */
  const struct @_branch *branches;
  const double *level_share;
  const struct @_term *terms;
  const int *parents;    /* whose slopes take over beyond a node's range */
  const double *nodes;   /* per node: low, high, mean, slopes of each output */
  const double *values;  /* per node and output */
  const double *outer;   /* slopes beyond the training extent */
  const double *residual_range, *output_range; /* per output low, high; or null */
  int leaves;
  const int *leaf_nodes;
  const double *centres, *per_sigma;
};
)";

const char* const c_runtime = R"(
static double @_hold(double x, double low, double high) {
  const double round = 0.1 * (high - low);
  const double beyond = x > high ? x - high : low - x;
  const double parabola = 0.5 * beyond * beyond / round;
  if (x > high) return beyond >= round ? high + 0.5 * round : x - parabola;
  if (x < low) return beyond >= round ? low - 0.5 * round : x + parabola;
  return x;
}

static double @_factor(int input, double x) {
  const double *extent = @_inputs + 3 * input; /* low, high, centre */
  const double low = extent[0] - extent[2];
  const double high = extent[1] - extent[2];
  const double deviation = x - extent[2];
  return deviation > high || deviation < low ? @_hold(deviation, low, high) : deviation;
}

static void @_deviations(const double *x, double *d) {
  int k;
  for (k = 0; k < @_REGRESSORS; ++k) {
    const struct @_regressor *r = @_regressors + k;
    if (r->second >= 0) {
      d[k] = @_factor(r->input, x[r->input]) * @_factor(r->second, x[r->second]) - r->centre;
    } else if (r->level < 0) {
      d[k] = x[r->input] - r->centre;
    } else {
      const double value = x[r->input];
      d[k] = !(value >= 0.0 && value < r->levels) ? NAN
             : value == (double)r->level          ? 1.0 - r->centre
                                                  : 0.0 - r->centre;
    }
  }
  for (; k < @_STRIDE; ++k) d[k] = 0.0;
}

static double @_transition(double u, int smoothness) {
  const double held = u < -1.0 ? -1.0 : u > 1.0 ? 1.0 : u;
  const double v = 0.5 * (held + 1.0);
  const double share =
      smoothness == 1 ? 1.0 - v * v * (3.0 - 2.0 * v) : 1.0 - v * v * v * (10.0 - v * (15.0 - 6.0 * v));
  return share < 0.0 ? 0.0 : share > 1.0 ? 1.0 : share;
}

static double @_two_to(int k) {
  double power = 1.0;
  double base = k < 0 ? 0.5 : 2.0;
  unsigned left = (unsigned)(k < 0 ? -k : k);
  for (; left > 0; left /= 2) {
    if (left % 2 == 1) power *= base;
    base *= base;
  }
  return power;
}

static double @_logistic(double u) {
  static const double terms[] = {1.0 / 6227020800.0, 1.0 / 479001600.0, 1.0 / 39916800.0, 1.0 / 3628800.0,
                                 1.0 / 362880.0,     1.0 / 40320.0,     1.0 / 5040.0,     1.0 / 720.0,
                                 1.0 / 120.0,        1.0 / 24.0,        1.0 / 6.0,        0.5,
                                 1.0,                1.0};
  const double reach = 37.0;
  const double shift = 6755399441055744.0; /* 1.5 * 2^52: adding it rounds to a whole number */
  const double held = u < -reach ? -reach : u > reach ? reach : u;
  const double shifted = held * 1.4426950408889634 + shift;
  const double k = shifted - shift;
  const double r = (held - k * 6.93147180369123816490e-01) - k * 1.90821492927058770002e-10;
  double sum = terms[0];
  int i;
  if (u <= -reach) return 1.0;
  if (u >= reach) return 0.0;
  for (i = 1; i < 14; ++i) sum = sum * r + terms[i];
  return 1.0 / (1.0 + sum * @_two_to((int)k));
}

static double @_left_share(const struct @_partition *p, const struct @_branch *b, const double *x) {
  double s = 0.0;
  if (b->first_term >= 0) {
    int k;
    for (k = 0; k < b->terms; ++k) {
      const struct @_term *t = p->terms + b->first_term + k;
      const double value = x[t->input];
      s += value == value ? t->weight * (value - t->centre) : 0.0;
    }
  } else {
    s = x[b->input];
  }
  if (b->first_level >= 0) return s >= 0.0 && s < b->levels ? p->level_share[b->first_level + (int)s] : b->missing_left;
  if (s != s) return b->missing_left;
  if (b->per_half_width == 0.0) return s <= b->threshold ? 1.0 : 0.0;
  s = (s - b->threshold) * b->per_half_width;
  return p->kind == 1 ? @_logistic(s) : @_transition(s, p->smoothness);
}

/* The order of the sums is that of the library: four partial sums. */
static double @_sum(const double *s) { return (s[0] + s[2]) + (s[1] + s[3]); }

static const double *@_node(const struct @_partition *p, int node) {
  return p->nodes + (long)node * (3 + p->outputs) * @_STRIDE;
}

static int @_inside(const struct @_partition *p, int node, const double *d) {
  const double *low = @_node(p, node);
  int k;
  for (k = 0; k < @_STRIDE; ++k) {
    if (!(d[k] >= low[k] && d[k] <= low[@_STRIDE + k])) return 0;
  }
  return 1;
}

static double @_plain(const struct @_partition *p, int node, int output, const double *d) {
  const double *slope = @_node(p, node) + (3 + output) * @_STRIDE;
  double s[4] = {0.0, 0.0, 0.0, 0.0};
  int k;
  for (k = 0; k < @_STRIDE; ++k) s[k % 4] += slope[k] * d[k];
  return p->values[node * p->outputs + output] + @_sum(s);
}

/* Beyond a node's range the slopes of its ancestors take over, of at most 64 and then of the root. */
static double @_guarded(const struct @_partition *p, int node, int output, const double *d) {
  double s[4] = {0.0, 0.0, 0.0, 0.0};
  int k;
  for (k = 0; k < @_STRIDE; ++k) {
    const double *low = @_node(p, node) + k;
    const int missing = d[k] != d[k];
    double held = missing ? low[2 * @_STRIDE] : @_hold(d[k], low[0], low[@_STRIDE]);
    int at = p->parents[node];
    int left = 64;
    s[k % 4] += low[(3 + output) * @_STRIDE] * held;
    while (!missing && held != d[k] && at >= 0) {
      double reached;
      if (at > 0 && --left < 0) at = 0;
      low = @_node(p, at) + k;
      reached = @_hold(d[k], low[0], low[@_STRIDE]);
      s[k % 4] += low[(3 + output) * @_STRIDE] * (reached - held);
      held = reached;
      at = p->parents[at];
    }
  }
  return p->values[node * p->outputs + output] + @_sum(s);
}

static void @_add(const struct @_partition *p, int node, double validity, const double *d, double *sums) {
  const int inside = @_inside(p, node, d);
  int o;
  for (o = 0; o < p->outputs; ++o) {
    sums[o] += validity * (inside ? @_plain(p, node, o, d) : @_guarded(p, node, o, d));
  }
}

static void @_finish(const struct @_partition *p, const double *d, double *values) {
  const double *low = @_node(p, 0);
  const int inside = @_inside(p, 0, d);
  int o, k;
  for (o = 0; p->residual_range != 0 && o < p->outputs; ++o) {
    const double root = inside ? @_plain(p, 0, o, d) : @_guarded(p, 0, o, d);
    values[o] = root + @_hold(values[o] - root, p->residual_range[2 * o], p->residual_range[2 * o + 1]);
  }
  for (o = 0; !inside && o < p->outputs; ++o) {
    double s[4] = {0.0, 0.0, 0.0, 0.0};
    for (k = 0; k < @_STRIDE; ++k) {
      const double beyond = d[k] != d[k] ? 0.0 : d[k] - @_hold(d[k], low[k], low[@_STRIDE + k]);
      s[k % 4] += p->outer[o * @_STRIDE + k] * beyond;
    }
    values[o] += @_sum(s);
  }
  for (o = 0; p->output_range != 0 && o < p->outputs; ++o) {
    const double least = p->output_range[2 * o];
    const double most = p->output_range[2 * o + 1];
    values[o] = values[o] < least ? least : most < values[o] ? most : values[o];
  }
}

static void @_add_tree(const struct @_partition *p, const double *x, const double *d, double *sums) {
  int waiting[@_DEPTH + 1];
  double validities[@_DEPTH + 1];
  int count = 1;
  waiting[0] = 0;
  validities[0] = 1.0;
  while (count > 0) {
    const struct @_branch *b;
    double validity;
    int node;
    --count;
    node = waiting[count];
    validity = validities[count];
    for (b = p->branches + node; b->left >= 0; b = p->branches + node) {
      const double left = @_left_share(p, b, x);
      node = left <= 0.0 ? b->right : b->left;
      if (left > 0.0 && left < 1.0) {
        waiting[count] = b->right;
        validities[count++] = validity * (1.0 - left);
        validity *= left;
      }
    }
    @_add(p, node, validity, d, sums);
  }
}
)";

}  // namespace llmt
