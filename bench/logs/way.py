"""The way of a user on a drawn machine: log -> `llmt signals` -> nominal simulation -> `llmt discover` -> second run.

`walk(program, case, folder)` returns what there is to be judged: the answer (JSON), what it adds to the simulation of a
second run, and what should have been added.
"""

import dataclasses
import json
import os
import pathlib
import subprocess

import numpy as np

import generate
from generate import hidden as truth
from generate import structure, terms


@dataclasses.dataclass
class Rows:
    """Rows of `llmt signals` of one run, the nominal simulation at them, and the truth at the same instants."""

    table: dict
    noise: dict  # of each column, as `signals` says
    simulated: np.ndarray
    derivatives: dict
    run: object
    at: np.ndarray  # positions of the rows in the log


@dataclasses.dataclass
class Walk:
    case: object  # that the answer is of
    answer: dict | None
    message: str  # of the program, where it gave no answer
    seconds: dict  # CPU time of signals, discover
    rows: tuple  # of both runs
    added: np.ndarray | None  # to the nominal simulation at the true signals of the second run
    missing: np.ndarray  # what should have been added
    corrected: np.ndarray | None  # simulation of the second run, at measured signals


def write(path, columns):
    names = list(columns)
    table = np.column_stack([columns[name] for name in names])
    np.savetxt(path, table, fmt="%.12g", delimiter=",", header=",".join(names), comments="")


def read(path):
    table = np.genfromtxt(path, delimiter=",", names=True)
    return {name: np.atleast_1d(table[name]) for name in table.dtype.names}


def execute(words, folder, limit):
    """Standard output, message and CPU seconds of a program; output is None if it failed."""
    out, err = pathlib.Path(folder, "stdout"), pathlib.Path(folder, "stderr")
    with out.open("wb") as output, err.open("wb") as errors:
        child = subprocess.Popen(["prlimit", f"--cpu={limit}", *words], stdout=output, stderr=errors)
        _, status, usage = os.wait4(child.pid, 0)
        child.returncode = os.waitstatus_to_exitcode(status)
    seconds = usage.ru_utime + usage.ru_stime
    message = "" if child.returncode == 0 else f"{child.returncode}: {err.read_text()[-300:].strip()}"
    return (out.read_text() if child.returncode == 0 else None), message, seconds


def filtered(program, case, log, extra, folder, more=()):
    """`llmt signals` of a log; columns of `extra` are filtered alone. Output is None if it failed."""
    words = [program, "signals", log, "--time", "t", "--position", ",".join(case.machine.coordinates)]
    words += ["--torque", ",".join(extra), "--cutoff", f"{case.cutoff:.6g}", "--json", "-o", f"{folder}/table.csv", *more]
    return execute(words, folder, 60)


def nominal(case, rows):
    """The nominal simulation at rows, and its derivatives by the free parameters."""
    simulated = structure.output(case.machine, rows, case.machine.parameters)
    return simulated, {name: case.machine.columns[name](rows) for name in case.free}


def nominal_through_filter(program, case, log, rows, folder):
    """The same at all samples and through the filter of the log, at those of the rows that lie within its reach."""
    all_samples = ("--every", "1", "--standstill", "0")
    filtered(program, case, log, ["u", *case.machine.extras], folder, all_samples)
    dense = read(f"{folder}/table.csv")
    simulated, derivatives = nominal(case, dense)
    columns = {"sim": simulated} | {f"by_{name}": x for name, x in derivatives.items()}
    positions = {name: dense[name] for name in ("t", *case.machine.coordinates)}
    write(f"{folder}/dense.csv", positions | columns)
    filtered(program, case, f"{folder}/dense.csv", list(columns), folder, all_samples)
    smooth = read(f"{folder}/table.csv")
    inside = (rows["t"] >= smooth["t"][0]) & (rows["t"] <= smooth["t"][-1])
    at = np.searchsorted(smooth["t"], rows["t"][inside] - 0.5 / case.rate)
    return inside, smooth["sim"][at], {name: smooth[f"by_{name}"][at] for name in case.free}


def signals(program, case, number, folder, through_filter=False):
    """Rows of a run and CPU seconds."""
    run, log = generate.run(case, number), f"{folder}/log{number}.csv"
    write(log, run.log)
    more = ()
    # A fit by hand takes rows without reversals, and so does the gap of the second run.
    if number == 2 and "--independent" in execute([program, "signals", "--help"], folder, 60)[0]:
        more = ("--independent",)
    text, message, seconds = filtered(program, case, log, ["u", *case.machine.extras], folder, more)
    if text is None:
        return None, message, seconds
    table = read(f"{folder}/table.csv")
    simulated, derivatives = nominal(case, table)
    if through_filter:
        inside, simulated, derivatives = nominal_through_filter(program, case, log, table, folder)
        table = {name: x[inside] for name, x in table.items()}
    write(f"{folder}/rows{number}.csv", table)
    at = np.clip(np.round(table["t"] * case.rate).astype(int), 0, len(run.t) - 1)
    return Rows(table, json.loads(text)["noise"], simulated, derivatives, run, at), message, seconds


def whole(case, number):
    """The log itself as rows, where `signals` gave none."""
    run = generate.run(case, number)
    return Rows(run.log, {}, run.simulated, {}, run, np.arange(len(run.t)))


def discover(program, case, rows, folder, options):
    """The answer to the first run."""
    inputs = {name: rows.table[name] for name in ("t", *case.given)}
    write(f"{folder}/sim1.csv", inputs | {"u": rows.simulated})
    words = [program, "discover", f"{folder}/sim1.csv", f"{folder}/rows1.csv", "--time", "t", "-t", "u", "--json"]
    words += ["--inputs", ",".join(case.given), *options.words]
    if options.tell_noise:
        words += ["--input-noise", ",".join(f"{name}={rows.noise[name]:.6g}" for name in case.given if name in rows.noise)]
    if case.free:
        write(f"{folder}/par1.csv", rows.derivatives)
        words += ["--parameters", f"{folder}/par1.csv"]
        words += [w for name in case.free for w in ("--parameter", f"{name}={case.machine.parameters[name]!r}")]
    text, message, seconds = execute(words, folder, options.limit)
    if text is not None:
        pathlib.Path(folder, "found.json").write_text(text)
    return (json.loads(text) if text is not None else None), message, seconds


def apply(program, case, columns, simulated, derivatives, folder):
    """The corrected simulation of other rows, by --apply."""
    write(f"{folder}/other.csv", {name: columns[name] for name in ("t", *case.given)} | {"u": simulated})
    words = [program, "discover", "--apply", f"{folder}/found.json", f"{folder}/other.csv", "-o", f"{folder}/corrected.csv"]
    if case.free:
        write(f"{folder}/other_par.csv", derivatives)
        words += ["--parameters", f"{folder}/other_par.csv"]
    pathlib.Path(folder, "corrected.csv").unlink(missing_ok=True)
    text, message, _ = execute(words, folder, 60)
    if text is None or not pathlib.Path(folder, "corrected.csv").exists():
        return None, message
    return read(f"{folder}/corrected.csv")["u_corrected"], ""


def true_rows(case, rows):
    """Signals without noise and filter at the instants of the rows, nominal simulation and derivatives there."""
    s = {name: x[rows.at] for name, x in rows.run.signals.items()}
    return s | {"t": rows.table["t"]}, *nominal(case, s)


def fit_of_parameters(case, rows):
    """Least squares of the free parameters' changes to the gap of rows, no effect beside them."""
    matrix = np.column_stack([rows.derivatives[name] for name in case.free])
    return [float(x) for x in np.linalg.lstsq(matrix, rows.table["u"] - rows.simulated, rcond=None)[0]]


def calibrated(case, first, second):
    """The case of a user who fitted the free parameters to the first run before, whatever is hidden there. A complete
    machine then has parameters that are off, by what errors of the signals do to such a fit."""
    moved = dict(zip(case.free, fit_of_parameters(case, first)))
    nominal = {name: value + moved.get(name, 0.0) for name, value in case.machine.parameters.items()}
    changes = {name: case.hidden.changes.get(name, 0.0) - change for name, change in moved.items()}
    case = dataclasses.replace(
        case,
        kind="parameters" if case.kind == "complete" else case.kind,
        machine=dataclasses.replace(case.machine, parameters=nominal),
        hidden=dataclasses.replace(case.hidden, changes=changes),
    )
    for rows in (first, second):
        rows.simulated = rows.simulated + sum(change * rows.derivatives[name] for name, change in moved.items())
    return case


def walk(program, case, folder, options):
    first, message, spent = signals(program, case, 1, folder, options.through_filter)
    second, other, more = signals(program, case, 2, folder, options.through_filter)
    seconds = {"signals": spent + more}
    if first is None or second is None:
        return Walk(case, None, "signals: " + (message or other), seconds, (first, second), None, None, None)
    if options.calibrated and case.free:
        case = calibrated(case, first, second)
    answer, message, seconds["discover"] = discover(program, case, first, folder, options)
    columns, exact, derivatives = true_rows(case, second)
    missing = hidden_at(case, second, columns, exact)
    if answer is None:
        return Walk(case, None, message, seconds, (first, second), None, missing, None)
    by_answer, message = apply(program, case, columns, exact, derivatives, folder)
    corrected, _ = apply(program, case, second.table, second.simulated, second.derivatives, folder)
    added = by_answer - exact if by_answer is not None else None
    return Walk(case, answer, message, seconds, (first, second), added, missing, corrected)


def parameter_part(case, signals):
    """What the changes of parameters add."""
    return sum(change * case.machine.columns[name](signals) for name, change in case.hidden.changes.items())


def by_past(case):
    """Does what is hidden depend on the past, so that it is known along the whole log only?"""
    return bool(case.hidden.state) or bool(case.hidden.outside and case.hidden.outside[0] in ("play", "presliding"))


def hidden_at(case, rows, signals, simulated):
    """The true missing part at rows: a function of the signals given, or of the past of the true run.

    Beside what depends on the past no parameter is off, but for what a calibration has moved.
    """
    if by_past(case):
        return rows.run.missing[rows.at] + parameter_part(case, signals)
    return case.hidden.force(signals, simulated) + parameter_part(case, signals)


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def rests(case, walk):
    """Root mean square of the second run's gap: nominal, free parameters alone fitted to the first run, true model."""
    first, second = walk.rows
    gap = second.table["u"] - second.simulated
    alone = gap
    if case.free:
        alone = gap - np.column_stack([second.derivatives[name] for name in case.free]) @ fit_of_parameters(case, first)
    return rms(gap), rms(alone), rms(gap - hidden_at(case, second, second.table, second.simulated))


def true_gap(case, rows):
    """What is hidden, at the true signals of the rows."""
    columns, simulated, _ = true_rows(case, rows)
    return hidden_at(case, rows, columns, simulated)


def imitation(case, rows):
    """Of an effect outside every family: what the best single term of the library, beside the free parameters, leaves
    of it at the true signals of the rows (share of the root mean square)."""
    few, simulated, derivatives = true_rows(case, rows)
    gap, best = hidden_at(case, rows, few, simulated), 1.0
    columns = [*derivatives.values(), np.ones(len(gap))]
    for family in (*terms.OF_OUTPUT, *terms.ONE, *terms.TWO):
        for place in terms.applicable(family, few, list(dict.fromkeys(case.given))):
            for position in ((a, b) for a in np.linspace(0, 1, 6) for b in (0.1, 0.9)):
                constants = terms.constants_of(family, few[place[0]], position) if len(place) == 1 else ()
                term = terms.Term(family, place, constants)
                tried = terms.basis(term, few, simulated)
                if all(np.all(np.isfinite(x)) for x in tried):
                    best = min(best, truth.beside(gap, columns + tried))
                if not constants:
                    break
    return best
