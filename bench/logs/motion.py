"""Does what was named repair the simulation? Motions of a run that nobody has seen, in rad (m for slides).

    python bench/logs/motion.py --program build/release/bin/llmt --time --parameters --seeds 3
    python bench/logs/motion.py --program build/release/bin/llmt --time --parameters --sysid --cases c1_all1,a_all1

For each case and seed the program reads the log of run 0, and the real machine makes run 1000. Models make it again: the
nominal one; the nominal one with parameters alone, fitted to the same table by least squares and, with --sysid, by
mujoco.sysid to the motion of run 0; and the nominal one with what the program named (repair.py). A column is the root
mean square difference of the first joint's position to the real run:

    open     the real torques, in windows of 1 s that begin at the real position and velocity
    closed   the machine's own controller follows the same reference

A run is worse if a difference grows by more than 0.1 % of the nominal one and by more than 1e-6 rad or m.
"""

import argparse
import json
import pathlib
import statistics
import subprocess
import tempfile

import numpy as np

import logs
import machines
import score
from repair import FITTED, Model, fitted_parameters, is_of_mujoco, repaired

HELD_OUT = 1000
SECONDS = 8.0
SMALLEST = 1e-6  # rad or m


def answer(options, case, seed):
    with tempfile.TemporaryDirectory() as folder:
        log, stem = logs.write(folder, case, seed)
        done = subprocess.run(score.command(options, case, stem), capture_output=True, text=True)
        if done.returncode:
            raise SystemExit(f"{case.name}, seed {seed}: {done.stderr}")
        return json.loads(done.stdout), log


class OfMujoco:
    """A machine of machines.py on the reference of a run."""

    def __init__(self, case, seed, run):
        self.machine = case.machine
        self.step = machines.STEP
        self.reference = machines.references(logs.generator(case.machine, seed, run), case.machine, SECONDS)
        self.true = [machines.EFFECTS[case.machine][name] for name in case.effects]

    def real(self, case):
        every = round(1 / self.step)
        parameters = machines.as_key(self.machine, case.changes)
        rigid = self.machine != "elastic"
        _, q, self.dq, self.ddq, self.u = machines.move(
            self.machine, parameters, self.true, self.reference, rate=every, rigid=rigid
        )
        self.q = q
        return q[:, 0]

    def positions(self, model, part=None):
        """Of the first joint at every step: of the whole run, or open loop in this part of it."""
        parameters = machines.as_key(self.machine, model.changes)
        reference, torques, start = self.reference, None, None
        if part is not None:
            reference, torques = tuple(x[part] for x in reference), self.u[part]
            start = self.start(model, part.start, dict(parameters))
        _, q, _, _, _ = machines.move(self.machine, parameters, model.effects, reference, rate=round(1 / self.step),
                                      torques=torques, start=start, rigid=not model.has_spring)
        return q[:, 0]

    def start(self, model, k, p):
        """The state at step k. The angle of a spring that nobody measured is that of the torque that it carries."""
        if self.machine != "elastic":
            return self.q[k], self.dq[k]
        motor = self.q[k, :1], self.dq[k, :1]
        if not model.has_spring:
            return motor
        twist = (p["armature"] * self.ddq[:, 0] + p["b"] * self.dq[:, 0] - self.u[:, 0]) / p["k"]
        speed = np.gradient(twist, self.step)
        return np.append(motor[0], twist[k]), np.append(motor[1], speed[k])


class OfEquations:
    """A machine of machines_of_ode.py, with the functions of OfMujoco."""

    def __init__(self, case, seed, run):
        self.source = logs.source(case.machine)
        self.machine = case.machine
        self.step = self.source.MACHINES[case.machine].step
        self.reference = self.source.references(logs.generator(case.machine, seed, run), case.machine, SECONDS)
        self.true = [self.source.EFFECTS[case.machine][name] for name in case.effects]

    def real(self, case):
        self.run = self.source.move(self.machine, case.changes, self.true, self.reference)
        return self.run["q"]

    def positions(self, model, part=None):
        reference, forces, start = self.reference, None, None
        if part is not None:
            reference, forces = tuple(x[part] for x in reference), self.run["u"][part]
            start = [tuple(self.run[name][part.start] for name in body) for body in (("q", "v"), ("q_b", "v_b"))
                     if body[0] in self.run]
        return self.source.move(self.machine, model.changes, model.effects, reference, forces=forces, start=start)["q"]


class HeldOut:
    """The real run, and how far a model is from it."""

    def __init__(self, case, seed):
        self.machine = (OfMujoco if is_of_mujoco(case) else OfEquations)(case, seed, HELD_OUT)
        self.q = self.machine.real(case)

    def closed(self, model):
        return float(np.sqrt(np.mean((self.machine.positions(model) - self.q) ** 2)))

    def open(self, model):
        window = round(1 / self.machine.step)
        squares = []
        for begin in range(0, len(self.q), window):
            part = slice(begin, begin + window)
            squares.append((self.machine.positions(model, part) - self.q[part]) ** 2)
        return float(np.sqrt(np.mean(np.concatenate(squares))))


def grows(after, before):
    return after > before * 1.001 and after > before + SMALLEST


def can_move(case):
    """Tables of torques, of logs that are no longer than 20 s; a rigid belt's table says nothing of its two bodies."""
    tables = ("two_encoders", "one_step", "rigid_belt", "second_derivatives", "ten_kilohertz")
    return case.machine in FITTED and case.preparation not in tables and case.seconds <= 20.0 and not case.refused


def judged(options, case, seed):
    document, log = answer(options, case, seed)
    run = HeldOut(case, seed)
    models = {"nominal": Model(), "parameters": fitted_parameters(case, log)}
    if options.sysid and is_of_mujoco(case):
        import fit_by_sysid

        models["sysid"] = fit_by_sysid.fitted(case, seed)
    models["llmt"] = repaired(document, case)
    errors = {name: (run.open(model), run.closed(model)) for name, model in models.items()}
    worse = [name for name, error in errors.items() if any(grows(*pair) for pair in zip(error, errors["nominal"]))]
    return {"case": case.name, "seed": seed, "verdict": document["verdict"], "errors": errors, "worse": worse,
            "left_out": models["llmt"].left_out}


NAMES = ("nominal", "parameters", "sysid", "llmt")


def line(result):
    cells = [f"{result['case']:30}{result['seed']:>5}"]
    for loop in (0, 1):
        errors = [result["errors"].get(name) for name in NAMES]
        cells += [f"{error[loop]:>11.3g}" if error else f"{'-':>11}" for error in errors]
    worse = "worse " if "llmt" in result["worse"] else ""
    return "".join(cells) + f"  {worse}{', '.join(result['left_out'])}"


def groups(results):
    """Sums over runs by what the machine hides."""
    cases = {case.name: case for case in logs.chosen("")}
    kinds = {
        "an effect": lambda c: c.truth and not c.changes,
        "parameters": lambda c: c.changes and not c.effects,
        "both": lambda c: c.effects and c.changes,
        "an inner state": lambda c: c.inner,
        "nothing": lambda c: score.is_complete(c) and not c.changes,
    }
    for kind, holds in kinds.items():
        members = [r for r in results if holds(cases[r["case"]])]
        if members:
            yield kind, members


def summary(results):
    yield (f"{'hidden':16}{'runs':>6}" + "".join(f"{name + ' worse':>18}" for name in NAMES[1:])
           + "   open loop, median of model / nominal: " + ", ".join(NAMES[1:]))
    for kind, members in groups(results):
        cells, ratios = [], []
        for name in NAMES[1:]:
            there = [r for r in members if name in r["errors"]]
            cells.append(f"{sum(name in r['worse'] for r in there)}/{len(there)}" if there else "-")
            shares = [r["errors"][name][0] / r["errors"]["nominal"][0] for r in there if r["errors"]["nominal"][0] > 1e-9]
            ratios.append(f"{statistics.median(shares):.3g}" if shares else "-")
        yield f"{kind:16}{len(members):>6}" + "".join(f"{cell:>18}" for cell in cells) + "   " + ", ".join(ratios)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--program", required=True)
    parser.add_argument("--cases", default="", metavar="NAME,...", help="default: all whose motion can be made again")
    parser.add_argument("--seeds", type=int, default=3, metavar="COUNT")
    parser.add_argument("--first", type=int, default=1, metavar="SEED", help="the first of the seeds; default: %(default)s")
    parser.add_argument("--sysid", action="store_true", help="fit parameters by mujoco.sysid too; minutes for a case")
    parser.add_argument("--time", action="store_true", help="name the columns of time and runs to the program")
    parser.add_argument("--parameters", action="store_true", help="give derivatives by --parameters, not as inputs")
    parser.add_argument("--options", default="", help="further options of the program, separated by blanks")
    parser.add_argument("--results", type=pathlib.Path, metavar="FILE", help="JSON lines; what is in there is not run again")
    options = parser.parse_args()
    cases = [case for case in logs.chosen(options.cases) if can_move(case)]
    kept = []
    if options.results and options.results.exists():
        kept = [json.loads(text) for text in options.results.read_text().splitlines()]
    print(f"{'case':30}{'seed':>5}" + "".join(f"{loop + name:>11}" for loop in ("", "") for name in NAMES)
          + "  open loop, then closed loop; left out")
    results = []
    for case in cases:
        for seed in range(options.first, options.first + options.seeds):
            done = [r for r in kept if (r["case"], r["seed"]) == (case.name, seed)]
            results.append(done[0] if done else judged(options, case, seed))
            print(line(results[-1]), flush=True)
            if options.results and not done:
                with options.results.open("a") as file:
                    file.write(json.dumps(results[-1]) + "\n")
    print()
    for text in summary(results):
        print(text)


if __name__ == "__main__":
    main()
