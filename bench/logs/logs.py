"""From a machine to the two files of `llmt discover`, with the truth beside them.

    python bench/logs/logs.py FOLDER --cases c1_all5,d_exact_all5 --seeds 3

writes NAME.SEED_sim.csv and NAME.SEED_meas.csv, and NAME.SEED_truth.csv: what the simulation lacks at each row, without
noise and at the true signals. A column t holds the seconds, a column run the number of the run where there are several.
Derivatives by parameters are in NAME.SEED_derivatives.csv where a case has them.
"""

import argparse
import dataclasses
import functools
import pathlib
import zlib

import numpy as np
from scipy import interpolate, signal

import machines
import machines_of_ode
from cases import all_cases

ENDS = 0.5  # seconds that a filter needs at either end of a run
EVERY = {"tenth": 10, "fifth": 5, "all": 1}
POSITIONS = {"q": 1e-4, "q1": 1e-4, "q2": 1e-4, "q_link": 1e-4, "T": 0.02, "fan": 0.0}  # noise, whatever the spread
FINE = {"gripper": {"q": 1e-5}, "belt": {"q": 1e-6, "q_b": 1e-6}}
TORQUES = ("u", "u1", "u2")
COUNTS = 2 * np.pi / 65536  # step of an encoder


@dataclasses.dataclass
class Log:
    """Columns of one case and seed. `simulated` and `measured` are of the target, `missing` is measured - simulated on
    signals without noise."""

    signals: dict
    simulated: np.ndarray
    measured: np.ndarray
    missing: np.ndarray
    derivatives: dict


def generator(*key):
    """A random generator for this key; the same on every machine."""
    return np.random.default_rng([zlib.crc32(str(part).encode()) for part in key])


def source(machine):
    """The module that has this machine."""
    return machines if machine in machines.PARAMETERS else machines_of_ode


@functools.lru_cache(maxsize=8)
def clean(machine, changes, effects, seed, run, seconds, rate):
    """A run of the machine: the same for every case that differs in noise alone."""
    return source(machine).record(machine, changes, effects, generator(machine, seed, run), seconds, rate)


def target_of(case, rows):
    """What was measured without noise, and what the nominal model says, at these rows."""
    if case.preparation == "two_encoders":
        return rows[case.target], rows["q"]
    if case.preparation == "one_step":
        return rows["ddq"], machines.simulate_forward(case.machine, rows)[:, 0]
    if case.preparation == "rigid_belt":
        return rows["u"], machines_of_ode.simulate_rigid_belt(rows)
    return rows["u" if "u" in rows else "u1"], source(case.machine).simulate(case.machine, rows)[:, 0]


def filtered(rows, rate, cutoff, times=2):
    """All signals through the same Butterworth filter, forwards and backwards."""
    sections = signal.butter(times, cutoff, fs=rate, output="sos")
    return {name: x if name == "t" else signal.sosfiltfilt(sections, x) for name, x in rows.items()}


def noise_like(case, x, rng, rate):
    """Noise of a torque, of standard deviation 1: white, correlated, or with a bandwidth of 100 Hz."""
    white = rng.standard_normal(len(x) + 1000)
    if case.preparation == "correlated":
        keep = np.exp(-1 / (case.correlation * rate))
        return np.sqrt(1 - keep**2) * signal.lfilter([1], [1, -keep], white)[1000:]
    if case.preparation == "ten_kilohertz":
        slow = signal.sosfilt(signal.butter(2, 100, fs=rate, output="sos"), white)[1000:]
        return slow / np.std(slow)
    return white[1000:]


def add_noise(case, rows, rng, rate):
    """Rows as they are logged."""
    logged = dict(rows)
    encoder = case.preparation.startswith("encoder")
    positions = POSITIONS | FINE.get(case.machine, {})
    for name, x in rows.items():
        if name == "t":
            continue
        if name in TORQUES:
            logged[name] = x + case.noise * np.std(x) * noise_like(case, x, rng, rate)
        elif encoder and name in positions:
            logged[name] = np.round(x / COUNTS) * COUNTS
        elif case.noisy == "all":
            logged[name] = x + positions.get(name, case.noise * np.std(x)) * rng.standard_normal(len(x))
    if encoder:
        differentiate(logged, rate, case.preparation == "encoder")
    return logged


def differentiate(rows, rate, smooth):
    """Velocity and acceleration from the positions of an encoder, in place."""
    for name in [name for name in rows if name in ("q", "q1", "q2")]:
        end = name[1:]
        if smooth:
            for order, derived in ((1, "dq"), (2, "ddq")):
                rows[derived + end] = signal.savgol_filter(rows[name], 25, 3, deriv=order, delta=1 / rate)
        else:
            rows["dq" + end] = np.gradient(rows[name], 1 / rate)
            rows["ddq" + end] = np.gradient(rows["dq" + end], 1 / rate)


def with_second_derivatives(rows, rate):
    """Of acceleration and torque, by local polynomials, with the ends of the filter as they come."""
    of = {f"d2{name}": signal.savgol_filter(rows[name], 51, 4, deriv=2, delta=1 / rate) for name in ("ddq", "u")}
    return rows | of


def at_ten_kilohertz(rows):
    """The bandwidth of the signals lies far below 2 kHz, so that a spline is exact."""
    fine = np.arange(0, rows["t"][-1], 1e-4)
    return {name: fine if name == "t" else interpolate.CubicSpline(rows["t"], x)(fine) for name, x in rows.items()}


def one_run(case, seed, run):
    """Signals as logged and as they were, at the rows that are used."""
    ten = case.preparation == "ten_kilohertz"
    rate = 1 if case.machine == "thermal" else 2000 if ten else machines.RATE
    true = clean(case.machine, case.changes, case.effects, seed, run, case.seconds, rate)
    if ten:
        true, rate = at_ten_kilohertz(true), 10000
    if case.machine == "elastic":
        p = machines.PARAMETERS["elastic"]
        true = dict(true, tau_gear=true["u"] - p["armature"] * true["ddq"] - p["b"] * true["dq"])
    if case.machine == "belt":
        p = machines_of_ode.PARAMETERS["belt"]
        needed = p["m"] * true["ddq"] + p["b"] * true["dq"] + p["f"] * np.sign(true["dq"])
        true = dict(true, tension=true["u"] - needed)
    logged = add_noise(case, true, generator(case.name, seed, run, "noise"), rate)
    if case.preparation == "second_derivatives":
        logged, true = (with_second_derivatives(rows, rate) for rows in (logged, true))
    keep = slice(None)
    if "lowpass" in case.preparation:
        logged = filtered(logged, rate, 10 if case.preparation == "encoder_lowpass" else 8)
        keep = slice(round(ENDS * rate), -round(ENDS * rate))
    step = EVERY[case.rows]
    logged, true = ({name: x[keep][::step] for name, x in rows.items()} for rows in (logged, true))
    if case.still:
        moving = np.abs(logged["dq" if "dq" in logged else "dq1"]) >= case.still
        logged, true = ({name: x[moving] for name, x in rows.items()} for rows in (logged, true))
    return logged, true


def derivatives(case, rows):
    """d target / d parameter, by central differences of the nominal model."""
    result = {}
    for name, _ in case.parameters:
        nominal = source(case.machine).PARAMETERS[case.machine][name]
        half = 1e-3 * abs(nominal)
        up, down = (source(case.machine).simulate(case.machine, rows, ((name, nominal + h),))[:, 0] for h in (half, -half))
        result[f"J_{name}"] = (up - down) / (2 * half)
    return result


def log_of(case, seed):
    logged, true = [], []
    for run in range(case.runs):
        of_log, of_truth = one_run(case, seed, run)
        if case.runs > 1:
            of_log["run"] = np.full(len(of_log["t"]), run + 1.0)
        logged.append(of_log)
        true.append(of_truth)
    logged, true = ({name: np.concatenate([part[name] for part in parts]) for name in parts[0]} for parts in (logged, true))
    measured, simulated = target_of(case, logged)
    really, ideal = target_of(case, true)
    return Log(logged, simulated, measured, really - ideal, derivatives(case, logged))


def write_csv(path, columns):
    np.savetxt(path, np.column_stack(list(columns.values())), delimiter=",", header=",".join(columns), comments="", fmt="%.12g")


def write(folder, case, seed, log=None):
    """The files of a case; returns the log and the stem of their names."""
    log = log or log_of(case, seed)
    stem = pathlib.Path(folder) / f"{case.name}.{seed}"
    keys = ["t", *(["run"] if case.runs > 1 else []), *case.inputs]
    same = {name: log.signals[name] for name in keys}
    same |= log.derivatives
    write_csv(f"{stem}_sim.csv", same | {case.target: log.simulated})
    write_csv(f"{stem}_meas.csv", same | {case.target: log.measured})
    write_csv(f"{stem}_truth.csv", {"t": log.signals["t"], "missing": log.missing})
    return log, stem


def chosen(names):
    cases = all_cases()
    if not names:
        return list(cases.values())
    for name in names.split(","):
        if name not in cases:
            raise SystemExit(f"{name} is no case. Cases: {', '.join(cases)}")
    return [cases[name] for name in names.split(",")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--cases", metavar="NAME,...", help="default: all")
    parser.add_argument("--seeds", type=int, default=1, metavar="COUNT")
    options = parser.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    for case in chosen(options.cases):
        for seed in range(1, options.seeds + 1):
            log, stem = write(options.folder, case, seed)
            print(f"{stem.name}: {len(log.measured)} rows, {','.join(case.inputs)} -> {case.target}, "
                  f"missing {np.sqrt(np.mean(log.missing**2)):.4g} of {np.std(log.measured):.4g}")


if __name__ == "__main__":
    main()
