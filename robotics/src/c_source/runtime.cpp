#include "c_source/runtime.hpp"

namespace llmt::robotics {

const char* const c_kinematics = R"(
struct @_element {
  int axis, rotation, joint; /* joint: whose value is added, or -1 */
  int body;                  /* the joint whose moving frame lies before this element, or -1 */
  double value;
};

struct @_frame {
  double p[3], r[3][3];
};

struct @_arm {
  struct @_frame tool;
  double origin[@_JOINTS][3], axis[@_JOINTS][3], body[@_JOINTS][3], payload[3];
};

static void @_translate(struct @_frame *f, const double *by) {
  int i;
  for (i = 0; i < 3; ++i) f->p[i] += f->r[i][0] * by[0] + f->r[i][1] * by[1] + f->r[i][2] * by[2];
}

static void @_rotate(struct @_frame *f, int axis, double angle) {
  const double s = sin(angle);
  const double c = cos(angle);
  const int u = (axis + 1) % 3;
  const int v = (axis + 2) % 3;
  int i;
  for (i = 0; i < 3; ++i) {
    const double first = f->r[i][u];
    f->r[i][u] = c * first + s * f->r[i][v];
    f->r[i][v] = c * f->r[i][v] - s * first;
  }
}

static void @_walk(const double *q, const double *more, struct @_arm *arm) {
  struct @_frame f = {{0.0, 0.0, 0.0}, {{1.0, 0.0, 0.0}, {0.0, 1.0, 0.0}, {0.0, 0.0, 1.0}}};
  int e, i;
  for (e = 0; e <= @_ELEMENTS; ++e) {
    const struct @_element *element = @_elements + e;
    double value = element->value;
    if (element->body >= 0) {
      struct @_frame body = f;
      @_translate(&body, @_centres[element->body]);
      for (i = 0; i < 3; ++i) arm->body[element->body][i] = body.p[i];
    }
    if (e == @_ELEMENTS) break;
    if (element->joint >= 0) {
      const int j = element->joint;
      for (i = 0; i < 3; ++i) {
        arm->origin[j][i] = f.p[i];
        arm->axis[j][i] = @_signs[j] * f.r[i][2];
      }
      value += @_signs[j] * (q[j] + more[j]);
    }
    if (element->rotation) {
      @_rotate(&f, element->axis, value);
    } else {
      for (i = 0; i < 3; ++i) f.p[i] += value * f.r[i][element->axis];
    }
  }
  arm->tool = f;
  @_translate(&f, @_payload_centre);
  for (i = 0; i < 3; ++i) arm->payload[i] = f.p[i];
}

static void @_cross(const double *a, const double *b, double *c) {
  c[0] = a[1] * b[2] - a[2] * b[1];
  c[1] = a[2] * b[0] - a[0] * b[2];
  c[2] = a[0] * b[1] - a[1] * b[0];
}

static double @_dot(const double *a, const double *b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }

struct @_load {
  double force[3], moment[3], about_axis;
};

/* Weights from the flange inwards: force in N, moment about the joint's origin in N m. */
static void @_sum_loads(const struct @_arm *arm, double payload, struct @_load *loads) {
  double force[3], moment[3] = {0.0, 0.0, 0.0};
  const double *point = arm->payload;
  int i, j;
  for (i = 0; i < 3; ++i) force[i] = payload * @_gravity[i];
  for (j = @_JOINTS - 1; j >= 0; --j) {
    double lever[3], centre[3], weight[3], by_force[3], by_weight[3];
    for (i = 0; i < 3; ++i) {
      lever[i] = point[i] - arm->origin[j][i];
      centre[i] = arm->body[j][i] - arm->origin[j][i];
      weight[i] = @_masses[j] * @_gravity[i];
    }
    @_cross(lever, force, by_force);
    @_cross(centre, weight, by_weight);
    for (i = 0; i < 3; ++i) {
      moment[i] += 1e-3 * (by_force[i] + by_weight[i]);
      force[i] += weight[i];
      loads[j].force[i] = force[i];
      loads[j].moment[i] = moment[i];
    }
    loads[j].about_axis = @_dot(arm->axis[j], @_slides[j] ? force : moment);
    point = arm->origin[j];
  }
}
)";

const char* const c_solution = R"(
/* Turns a rotation by a rotation vector (Rodrigues). */
static void @_turn(const double *by, double rotation[3][3]) {
  const double angle = sqrt(by[0] * by[0] + by[1] * by[1] + by[2] * by[2]);
  int column;
  if (!(angle > 0.0)) return;
  for (column = 0; column < 3; ++column) {
    const double sine = sin(angle), versine = 1.0 - cos(angle);
    double axis[3], across[3], along = 0.0;
    int i;
    for (i = 0; i < 3; ++i) axis[i] = by[i] / angle;
    for (i = 0; i < 3; ++i) along += axis[i] * rotation[i][column];
    across[0] = axis[1] * rotation[2][column] - axis[2] * rotation[1][column];
    across[1] = axis[2] * rotation[0][column] - axis[0] * rotation[2][column];
    across[2] = axis[0] * rotation[1][column] - axis[1] * rotation[0][column];
    for (i = 0; i < 3; ++i) {
      rotation[i][column] += sine * across[i] + versine * (axis[i] * along - rotation[i][column]);
    }
  }
}

/* The values of all joints: those with a drive, and those that follow one. */
static void @_follow(const double *drives, double *q) {
  int j;
  for (j = 0; j < @_JOINTS; ++j) {
    const struct @_following *f = @_following + j;
    q[j] = f->multiplier * drives[f->drive] + f->offset;
  }
}

static void @_pose(const double *conditions, const double *q, double *position, struct @_frame *tool) {
  double more[@_JOINTS] = {0.0};
  double turn[3] = {0.0, 0.0, 0.0};
  struct @_arm arm;
  int pass;
  for (pass = 0; pass < @_PASSES; ++pass) {
    struct @_load loads[@_JOINTS];
    @_walk(q, more, &arm);
    @_sum_loads(&arm, conditions[0], loads);
    @_deform(conditions, q, loads, more);
  }
  @_walk(q, more, &arm);
  *tool = arm.tool;
  @_correct(q, tool->p, turn);
  @_turn(turn, tool->r);
  position[0] = tool->p[0];
  position[1] = tool->p[1];
  position[2] = tool->p[2];
}

void @_forward(const double *conditions, const double *drives, double *position, double *rotation) {
  struct @_frame tool;
  double q[@_JOINTS];
  int i;
  @_follow(drives, q);
  @_pose(conditions, q, position, &tool);
  for (i = 0; i < 9; ++i) rotation[i] = tool.r[i / 3][i % 3];
}

/* What is missing: mm, and the rotation vector times the reach. */
static int @_missing(const double *position, const double *rotation, const struct @_frame *tool, double *error) {
  int i, j, k;
  double turn[3][3], v[3], sine, angle, factor;
  for (i = 0; i < 3; ++i) error[i] = position[i] - tool->p[i];
  if (rotation == 0 || @_DRIVES < 6) return 3;
  for (i = 0; i < 3; ++i) {
    for (j = 0; j < 3; ++j) {
      turn[i][j] = 0.0;
      for (k = 0; k < 3; ++k) turn[i][j] += rotation[3 * i + k] * tool->r[j][k];
    }
  }
  v[0] = 0.5 * (turn[2][1] - turn[1][2]);
  v[1] = 0.5 * (turn[0][2] - turn[2][0]);
  v[2] = 0.5 * (turn[1][0] - turn[0][1]);
  sine = sqrt(@_dot(v, v));
  angle = atan2(sine, 0.5 * (turn[0][0] + turn[1][1] + turn[2][2] - 1.0));
  factor = sine > 1e-9 ? angle / sine : 1.0;
  for (i = 0; i < 3; ++i) error[3 + i] = @_reach * factor * v[i];
  return 6;
}

/* a x = b by Cholesky, a symmetric and positive; x in place of b. */
static void @_solve(int n, double a[@_MOST][@_MOST], double *b) {
  int i, j, k;
  for (i = 0; i < n; ++i) {
    for (j = 0; j <= i; ++j) {
      double sum = a[i][j];
      for (k = 0; k < j; ++k) sum -= a[i][k] * a[j][k];
      a[i][j] = i == j ? sqrt(sum > 1e-300 ? sum : 1e-300) : sum / a[j][j];
    }
  }
  for (i = 0; i < n; ++i) {
    for (k = 0; k < i; ++k) b[i] -= a[i][k] * b[k];
    b[i] /= a[i][i];
  }
  for (i = n - 1; i >= 0; --i) {
    for (k = i + 1; k < n; ++k) b[i] -= a[k][i] * b[k];
    b[i] /= a[i][i];
  }
}

static void @_least_squares(int rows, double jacobian[6][@_DRIVES], const double *error, double *change) {
  double normal[@_MOST][@_MOST];
  double right[@_MOST];
  double size = 0.0;
  const int wide = @_DRIVES > rows;
  const int n = wide ? rows : @_DRIVES;
  const int m = wide ? @_DRIVES : rows;
  int i, j, k;
  for (i = 0; i < rows; ++i) {
    for (j = 0; j < @_DRIVES; ++j) size += jacobian[i][j] * jacobian[i][j];
  }
  for (i = 0; i < n; ++i) {
    right[i] = wide ? error[i] : 0.0;
    for (k = 0; !wide && k < rows; ++k) right[i] += jacobian[k][i] * error[k];
    for (j = 0; j < n; ++j) {
      normal[i][j] = i == j ? 1e-14 * size : 0.0;
      for (k = 0; k < m; ++k) normal[i][j] += wide ? jacobian[i][k] * jacobian[j][k] : jacobian[k][i] * jacobian[k][j];
    }
  }
  @_solve(n, normal, right);
  for (j = 0; j < @_DRIVES; ++j) {
    change[j] = wide ? 0.0 : right[j];
    for (k = 0; wide && k < rows; ++k) change[j] += jacobian[k][j] * right[k];
  }
}

double @_step(const double *conditions, const double *position, const double *rotation, double *drives) {
  static const double nothing[@_JOINTS] = {0.0};
  double jacobian[6][@_DRIVES] = {{0.0}};
  double q[@_JOINTS], error[6], change[@_DRIVES], at[3];
  double square = 0.0;
  double longest = 0.0;
  struct @_frame tool;
  struct @_arm arm;
  int rows, round, i, j, again = 1;
  @_follow(drives, q);
  @_pose(conditions, q, at, &tool);
  rows = @_missing(position, rotation, &tool, error);
  for (i = 0; i < rows; ++i) square += error[i] * error[i];
  @_walk(q, nothing, &arm);
  for (j = 0; j < @_JOINTS; ++j) {
    const struct @_following *f = @_following + j;
    const double unit = f->multiplier * (@_slides[@_drives[f->drive]] ? @_reach : 1.0);
    double lever[3], turned[3];
    for (i = 0; i < 3; ++i) lever[i] = arm.tool.p[i] - arm.origin[j][i];
    @_cross(arm.axis[j], lever, turned);
    for (i = 0; i < 3; ++i) {
      jacobian[i][f->drive] += unit * (@_slides[j] ? arm.axis[j][i] : turned[i]);
      jacobian[3 + i][f->drive] += @_slides[j] ? 0.0 : unit * @_reach * arm.axis[j][i];
    }
  }
  for (round = 0; again && round <= @_DRIVES; ++round) {
    again = 0;
    @_least_squares(rows, jacobian, error, change);
    for (j = 0; j < @_DRIVES; ++j) {
      if ((drives[j] <= @_low[j] && change[j] < 0.0) || (drives[j] >= @_high[j] && change[j] > 0.0)) {
        for (i = 0; i < 6; ++i) jacobian[i][j] = 0.0;
        again = 1;
      }
    }
  }
  for (j = 0; j < @_DRIVES; ++j) longest = longest < fabs(change[j]) ? fabs(change[j]) : longest;
  for (j = 0; j < @_DRIVES; ++j) {
    double next = change[j] * (longest > 0.2 ? 0.2 / longest : 1.0);
    next = drives[j] + (@_slides[@_drives[j]] ? @_reach * next : next);
    drives[j] = next < @_low[j] ? @_low[j] : next > @_high[j] ? @_high[j] : next;
  }
  return sqrt(square);
}
)";

}  // namespace llmt::robotics
