"""A mechanism under a controller that sees what its encoders show, with true sticking.

Time stepping after Moreau: forces at predicted midpoints, dry friction as an impulse within its cone (projected
Gauss-Seidel). A row of the log holds means over the steps of its sample, as drives measure currents, and what the
encoder shows in the middle of it. So the equation of motion holds between the columns, and torques that follow the
noise of the encoder are not aliased.
"""

import math

import numpy as np

DISCONTINUOUS = ("sign", "stribeck", "coulomb_stribeck", "sign_product")


def inertia(machine, q, own):
    """The inertia matrix for positions q; `own` are the inertias of the axes."""
    n = len(own)
    matrix = np.diag(own)
    for i in range(n):
        for j in range(n):
            if i != j:
                matrix[i, j] = machine.coupling[i, j] * (math.cos(q[i] - q[j]) if machine.angular else 1.0)
    return matrix


def smooth_forces(machine, parameters, q, v):
    """Forces beside inertia and dry friction."""
    forces = []
    for i, p in enumerate(parameters):
        force = p.get("G", 0.0) * math.cos(q[i]) + p.get("K", 0.0) * q[i] + p.get("W", 0.0) + p.get("b", 0.0) * v[i]
        if machine.angular:
            for j in range(len(q)):
                if j != i:
                    force += machine.coupling[i, j] * math.sin(q[i] - q[j]) * v[j] ** 2
        forces.append(force)
    return forces


def dry_levels(machine, parameters, v):
    levels = []
    for axis, p, speed in zip(machine.axes, parameters, v):
        peak = p.get("h", 0.0) * math.exp(-((speed / axis.speed) ** 2)) if "h" in p else 0.0
        levels.append(max(0.0, p.get("f", 0.0) + peak))
    return levels


def with_friction(matrix, v, levels, step):
    """Velocities after the impulses of dry friction."""
    if len(v) == 1:
        most = step * levels[0] / matrix[0, 0]
        return [v[0] - min(max(v[0], -most), most)]
    compliance = np.linalg.inv(matrix)
    impulse, v = [0.0] * len(v), list(v)
    for _ in range(12):
        for i in range(len(v)):
            new = min(max(impulse[i] + v[i] / compliance[i, i], -step * levels[i]), step * levels[i])
            change = new - impulse[i]
            impulse[i] = new
            for j in range(len(v)):
                v[j] -= compliance[j, i] * change
    return v


def follow(machine, parameters, motions, hidden, jumps, sensors, noise, sample, count, finer, stiff):
    """Runs the loop for `count` samples of the log, with `finer` steps each.

    `hidden(signals)` is the force on the target's axis that the model lacks; where `jumps`, its jump at dq = 0 is
    dry friction that sticks. `sensors` are resolutions, `noise` (steps x axes) is that of the sensors, `stiff` the
    bandwidth of the loop in rad/s. Returns signals at the log's instants, the target, and what the sensors showed; or None if
    the loop does not hold the machine.
    """
    step, n, axis = sample / finer, len(machine.coordinates), machine.target_axis
    t = np.arange(count * finer + 1) * step
    wanted = [motion(t) for motion in motions]
    position, velocity = np.array([w[0] for w in wanted]).T, np.array([w[1] for w in wanted]).T
    own = [p.get("J", p.get("m")) for p in parameters]
    kp, kd = [stiff**2 * m for m in own], [2.0 * stiff * m for m in own]
    forget = 1 - math.exp(-step * stiff * 3)
    name = machine.coordinates
    q, v, a = position[0].tolist(), [0.0] * n, [0.0] * n
    limit = 20 * (np.abs(position).max(axis=0) + 1e-9)
    seen_before, speed = None, [0.0] * n
    rows, shown_rows, total = [], [], np.zeros(3 * n + 1)
    for k in range(count * finer):
        if not all(abs(q[i]) < limit[i] for i in range(n)):
            return None
        shown = [round((q[i] + noise[k, i]) / sensors[i]) * sensors[i] for i in range(n)]
        if seen_before is not None:
            speed = [s + forget * ((x - y) / step - s) for s, x, y in zip(speed, shown, seen_before)]
        seen_before = shown
        u = [kp[i] * (position[k, i] - shown[i]) + kd[i] * (velocity[k, i] - speed[i]) for i in range(n)]
        qm = [q[i] + 0.5 * step * v[i] for i in range(n)]
        vm = [v[i] + 0.5 * step * a[i] for i in range(n)]
        force = smooth_forces(machine, parameters, qm, vm)
        levels = dry_levels(machine, parameters, vm)
        if hidden is not None:
            signals = {}
            for i in range(n):
                signals[name[i]], signals["d" + name[i]] = qm[i], vm[i]
            if jumps:
                own_speed, values = "d" + name[axis], []
                for tiny in (1e-9, -1e-9):
                    signals[own_speed] = tiny
                    values.append(float(hidden(signals)))
                level = (values[0] - values[1]) / 2
                signals[own_speed] = vm[axis] or 1e-9
                force[axis] += float(hidden(signals)) - (math.copysign(level, vm[axis]) if level > 0 else 0.0)
                levels[axis] += max(0.0, level)
            else:
                force[axis] += float(hidden(signals))
        matrix = inertia(machine, qm, own)
        free = [u[i] - force[i] for i in range(n)]
        change = [free[0] / matrix[0, 0]] if n == 1 else np.linalg.solve(matrix, free)
        new = with_friction(matrix, [v[i] + step * change[i] for i in range(n)], levels, step)
        a = [(new[i] - v[i]) / step for i in range(n)]
        if k % finer == finer // 2:
            shown_rows.append(shown)
        total += (*qm, *vm, *a, u[axis])
        if k % finer == finer - 1:
            rows.append(total / finer)
            total = np.zeros(3 * n + 1)
        q = [q[i] + 0.5 * step * (v[i] + new[i]) for i in range(n)]
        v = new
    table = np.array(rows)
    signals = {}
    for i in range(n):
        signals[name[i]], signals["d" + name[i]], signals["dd" + name[i]] = table[:, i], table[:, n + i], table[:, 2 * n + i]
    return signals, table[:, -1], dict(zip(name, np.array(shown_rows).T))
