"""Does what was named repair the simulation? Motions of a run that nobody has seen, in rad (m for the cart).

    python bench/logs/motion.py --program build/release/bin/llmt --cases c1_all1,a_all1 --seeds 3

For each case and seed the program reads the log of run 0, and the real machine makes run 1000. Three models make it
again: the nominal one; the nominal one with parameters fitted to the log of run 0 by least squares, which knows of no
missing term; and the nominal one with the terms and parameters that the program named. A column is the root mean square
difference of the joint's position to the real run:

    open     the real torques, in windows of 1 s that begin at the real position and velocity
    closed   the machine's own controller follows the same reference

A term is torque that the motion needs, so that its negative is applied (qfrc_applied). Dry friction goes into
dof_frictionloss, a term of the acceleration into a mass or an armature, a term of the velocity into the damping. A term
that is neither, such as one of the row before, cannot act in a simulation. It is left out and listed.
"""

import argparse
import json
import pathlib
import subprocess
import tempfile

import numpy as np

import logs
import machines
import score

HELD_OUT = 1000
SECONDS = 8.0
# What a table of torques can tell about the parameters, and nearly nothing else.
FITTED = {"cart": ("m", "b", "f"), "arm": ("m1", "m2", "b1", "f1")}
# Terms that are parameters of the model.
AS_PARAMETER = {
    "cart": {"linear ddq": "m", "linear dq": "b", "sign dq": "f"},
    "arm": {"linear ddq1": "a1", "linear dq1": "b1", "sign dq1": "f1"},
}
# Functions of one signal x with a coefficient a and a constant c, under the names of docs/discovery-generic.md.
OF_ONE = {
    "linear": lambda x, a: a * x,
    "square": lambda x, a: a * x * x,
    "cube": lambda x, a: a * x**3,
    "absolute": lambda x, a: a * abs(x),
    "signed_square": lambda x, a: a * x * abs(x),
    "step": lambda x, a, c: a * (x > c),
    "hinge": lambda x, a, c: a * max(0.0, x - c),
    "hinge_below": lambda x, a, c: a * max(0.0, c - x),
    "wave": lambda x, a, b, period: a * np.cos(2 * np.pi * x / period) + b * np.sin(2 * np.pi * x / period),
}
FRICTION = {
    "stribeck": lambda v, a, c: a * np.exp(-((v / c) ** 2)),
    "tanh": lambda v, a, c: a * abs(np.tanh(v / c)),
}


def reader(name):
    """The function (q, dq) -> signal of this name, None for a signal that is neither."""
    joint = int(name[-1]) - 1 if name[-1].isdigit() else 0
    kind = name.rstrip("0123456789")
    if kind == "q":
        return lambda q, dq: q[joint]
    return (lambda q, dq: dq[joint]) if kind == "dq" else None


def effect_of(family, place, values):
    """The Effect of a named term on the first joint, None where a simulation cannot have it."""
    names = place.split(",") if place else []
    signals = [reader(name) for name in names]
    if None in signals:
        return None
    if family == "offset":
        return machines.Effect(0, needed=lambda q, dq: values[0])
    if family in FRICTION and names[0] in ("dq", "dq1"):
        return machines.Effect(0, friction=lambda q, dq: FRICTION[family](dq[0], *values))
    if family in OF_ONE and len(names) == 1:
        return machines.Effect(0, needed=lambda q, dq: OF_ONE[family](signals[0](q, dq), *values))
    if family == "product":
        return machines.Effect(0, needed=lambda q, dq: values[0] * signals[0](q, dq) * signals[1](q, dq))
    return None


def repair(document, case):
    """Changes of parameters, effects, and the terms left out, of an answer."""
    nominal = machines.PARAMETERS[case.machine]
    changes, effects, left_out = {}, [], []
    for name, _, estimated in score.parameter_effects(document, case):
        changes[name] = changes.get(name, 0.0) + score.values_of(estimated)[0]
    of_parameters = [id(estimated) for _, _, estimated in score.parameter_effects(document, case)]
    for effect in document["effects"]:
        label, values = score.label(effect), score.values_of(effect)
        if id(effect) in of_parameters:
            continue
        if label in AS_PARAMETER[case.machine]:
            name = AS_PARAMETER[case.machine][label]
            changes[name] = changes.get(name, 0.0) + values[0]
        elif (made := effect_of(effect["name"], score.place(effect), values)) is not None:
            effects.append(made)
        else:
            left_out.append(label)
    return tuple((name, max(1e-6, nominal[name] + change)) for name, change in changes.items()), effects, left_out


def fitted_parameters(case, log):
    """Parameters alone, by least squares on the table."""
    nominal = machines.PARAMETERS[case.machine]
    columns = []
    for name in FITTED[case.machine]:
        half = 1e-3 * nominal[name]
        up, down = (machines.simulate(case.machine, log.signals, ((name, nominal[name] + h),))[:, 0] for h in (half, -half))
        columns.append((up - down) / (2 * half))
    change = np.linalg.lstsq(np.column_stack(columns), log.measured - log.simulated, rcond=None)[0]
    return tuple((name, max(1e-6, nominal[name] + c)) for name, c in zip(FITTED[case.machine], change))


def answer(options, case, seed):
    with tempfile.TemporaryDirectory() as folder:
        log, stem = logs.write(folder, case, seed)
        done = subprocess.run(score.command(options, case, stem), capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{case.name}, seed {seed}: {done.stderr}")
        return json.loads(done.stdout), log


class HeldOut:
    """The real run, and how far a model is from it."""

    def __init__(self, case, seed):
        self.machine = case.machine
        self.reference = machines.references(logs.generator(case.machine, seed, HELD_OUT), case.machine, SECONDS)
        real = [machines.EFFECTS[case.machine][name] for name in case.effects]
        every = round(1 / machines.STEP)
        _, self.q, self.dq, _, self.u = machines.move(
            case.machine, machines.as_key(case.machine, case.changes), real, self.reference, rate=every
        )

    def closed(self, changes, effects):
        parameters = machines.as_key(self.machine, changes)
        _, q, _, _, _ = machines.move(self.machine, parameters, effects, self.reference)
        every = round(1 / (machines.STEP * machines.RATE))
        return float(np.sqrt(np.mean((q[:, 0] - self.q[::every, 0]) ** 2)))

    def open(self, changes, effects):
        parameters = machines.as_key(self.machine, changes)
        window = round(1 / machines.STEP)
        every = round(1 / (machines.STEP * machines.RATE))
        squares = []
        for begin in range(0, len(self.q), window):
            part = slice(begin, begin + window)
            pieces = tuple(x[part] for x in self.reference)
            start = (self.q[begin], self.dq[begin])
            _, q, _, _, _ = machines.move(self.machine, parameters, effects, pieces, torques=self.u[part], start=start)
            squares.append((q[:, 0] - self.q[part][::every, 0]) ** 2)
        return float(np.sqrt(np.mean(np.concatenate(squares))))


DEFAULT = (
    "c1_all1,c1_all5,c2_all1,c2_all5,c1d_tau1,c2d_tau1,d_off_all1,a_all1,a_all5,arm_off_derivatives_all1,"
    "ad_derivatives_all1"
)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--cases", default=DEFAULT, metavar="NAME,...", help="of the arm and the cart; default: %(default)s")
    parser.add_argument("--seeds", type=int, default=3, metavar="COUNT")
    parser.add_argument("--time", action="store_true", help="name the columns of time and runs to the program")
    parser.add_argument("--parameters", action="store_true", help="give derivatives by --parameters, not as inputs")
    parser.add_argument("--options", default="", help="further options of the program, separated by blanks")
    options = parser.parse_args()
    print(f"{'case':30}{'seed':>5}{'open loop: nominal':>20}{'parameters':>12}{'llmt':>10}{'closed loop: nominal':>22}"
          f"{'parameters':>12}{'llmt':>10}  worse, left out")
    worse = total = 0
    for case in logs.chosen(options.cases):
        for seed in range(1, options.seeds + 1):
            document, log = answer(options, case, seed)
            changes, effects, left_out = repair(document, case)
            run = HeldOut(case, seed)
            models = [((), []), (fitted_parameters(case, log), []), (changes, effects)]
            opened, closed = [run.open(*model) for model in models], [run.closed(*model) for model in models]
            is_worse = opened[2] > opened[0] * 1.001 or closed[2] > closed[0] * 1.001
            worse, total = worse + is_worse, total + 1
            print(f"{case.name:30}{seed:>5}{opened[0]:>20.3g}{opened[1]:>12.3g}{opened[2]:>10.3g}{closed[0]:>22.3g}"
                  f"{closed[1]:>12.3g}{closed[2]:>10.3g}  {'worse ' if is_worse else ''}{', '.join(left_out)}", flush=True)
    print(f"worse than nominal in {worse} of {total}")


if __name__ == "__main__":
    main()
