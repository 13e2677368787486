"""A case: all that a seed draws. `case(seed)` draws it, `run(case, number)` moves and logs its machine.

Everything comes from one numpy.random.Generator(PCG64(seed)), the second run from one of its own.
"""

import dataclasses

import numpy as np

from . import hidden as truth
from . import loop, measure, references, states, structure

FINER = 4  # steps of integration in a sample of the log
LOOP = 0.4  # share of the mechanisms that move in a simulated loop
LOOP_SAMPLES = 6000  # of such a log at most


@dataclasses.dataclass
class Case:
    seed: int
    kind: str
    machine: structure.Machine
    parameters: dict  # of the real machine
    free: list  # parameters whose derivatives are given
    given: list  # inputs of the search
    rate: float  # Hz
    samples: int
    fastest: float  # Hz, of the reference
    cutoff: float  # Hz, of the user's filter
    kinds: list  # of the references: first and second run
    amplitudes: dict
    middles: dict
    in_loop: bool
    stiff: float  # rad/s, of the controller
    holds: bool  # at rest, friction holds any torque within its cone (prescribed motion)
    size: float  # of what is hidden, in standard deviations of the target's noise, as drawn
    chain: measure.Chain
    hidden: truth.Hidden


@dataclasses.dataclass
class Run:
    t: np.ndarray
    signals: dict  # true, at the times of the log
    target: np.ndarray  # true
    simulated: np.ndarray  # by the nominal model at the true signals
    log: dict
    in_loop: bool

    @property
    def missing(self):
        return self.target - self.simulated


def motions(case, number):
    """The references of a run: coordinate or extra -> function of time."""
    rng = np.random.Generator(np.random.PCG64([case.seed, number]))
    seconds, result = case.samples / case.rate, {}
    smaller = 1.0 if number == 1 else rng.uniform(0.75, 1.0)
    for name in case.machine.coordinates + case.machine.extras:
        slow = name in case.machine.extras
        speed = case.fastest * (rng.uniform(0.1, 0.5) if slow else rng.uniform(0.7, 1.0))
        kind = "sines" if slow else case.kinds[number - 1]
        result[name] = references.draw(rng, kind, speed, case.amplitudes[name] * smaller, seconds)
    return result


def prescribed(case, number, t):
    """True signals of a run that follows its references exactly, at rising times t."""
    signals = {}
    for name, motion in motions(case, number).items():
        q, dq, ddq = motion(t)
        signals |= {name: case.middles[name] + q, "d" + name: dq, "dd" + name: ddq}
    return signals


def holding(case, signals):
    """What dry friction does at rest, -1 ... 1: another value at each position."""
    if not case.holds:
        return {}
    name = case.machine.coordinates[case.machine.target_axis]
    return {"hold_" + name: np.sin(1000 * signals[name] / case.amplitudes[name])}


def fine_run(case, number, finer=FINER):
    """The machine without what is hidden but for its parameters, on a grid `finer` times that of the log."""
    t = np.arange((case.samples - 1) * finer + 1) / (case.rate * finer)
    signals = prescribed(case, number, t)
    target = structure.output(case.machine, signals | holding(case, signals), case.parameters)
    return states.Fine(t, signals, target, case.machine, case.parameters, 1 / case.rate, case.fastest)


def target_of(case, fine):
    """The true target on the fine grid."""
    nominal = structure.output(case.machine, fine.signals, case.machine.parameters)
    total = fine.target + case.hidden.force(fine.signals, nominal)
    if case.hidden.state:
        total = total + states.missing(case.hidden.state[0], fine, *case.hidden.state[1:])
    return total


def looped(case, number, finer=FINER):
    """A run in a simulated loop: signals, target and what the sensors showed; None if it cannot hold the machine."""
    machine, rng = case.machine, np.random.Generator(np.random.PCG64([case.seed, number, 1]))
    chosen, names = motions(case, number), machine.coordinates
    parameters = [dict(axis.parameters) for axis in machine.axes]
    parameters[machine.target_axis] = {**case.parameters}
    coupling = machine.coupling.copy()
    for j in range(len(names)):
        if j != machine.target_axis:
            coupling[machine.target_axis, j] = coupling[j, machine.target_axis] = case.parameters[f"c{j + 1}"]
    middle = [case.middles[name] for name in names]
    noise = np.repeat(rng.standard_normal((case.samples, len(names))), finer, axis=0)
    noise *= [case.chain.jitter[name] for name in names]
    force = (lambda s: case.hidden.force(s, np.zeros(()))) if case.hidden.terms or case.hidden.function else None
    own = "d" + names[machine.target_axis]
    jumps = any(term.family in loop.DISCONTINUOUS and term.place[0] == own for term in case.hidden.terms)
    with np.errstate(all="ignore"):
        return loop.follow(
            dataclasses.replace(machine, coupling=coupling), parameters, [shifted(chosen[name], m) for name, m in zip(names, middle)], force, jumps,
            [case.chain.resolutions[name] for name in names], noise, 1 / case.rate, case.samples, finer, case.stiff,
        )


def shifted(motion, middle):
    return lambda t: (motion(t)[0] + middle, *motion(t)[1:])


def run(case, number, finer=FINER):
    """Run 1 or 2 of a case and its log."""
    rng = np.random.Generator(np.random.PCG64([case.seed, number, 2]))
    t = np.arange(case.samples) / case.rate
    result = looped(case, number, finer) if case.in_loop else None
    if result:
        signals, target, shown = result
        grid, on_grid = t, target
    else:
        fine, shown = fine_run(case, number, finer), None
        grid, on_grid = fine.t, target_of(case, fine)
        signals, target = {name: x[::finer] for name, x in fine.signals.items()}, on_grid[::finer]
    simulated = structure.output(case.machine, signals, case.machine.parameters)
    log = measure.log(rng, case.chain, t, signals, grid, on_grid, shown)
    return Run(t, signals, target, simulated, log, bool(result))


def machine_of(rng, family):
    """A machine without sizes: coordinates and columns."""
    if family not in structure.MOTION:
        names, extras, columns = structure.other_machine(family)
        if family in ("cylinder", "thermal", "vehicle") and rng.uniform() < 0.4:
            columns.pop({"cylinder": "k", "thermal": "r", "vehicle": "c0"}[family])
        return structure.Machine(family, names, extras, columns, {})
    count = int(rng.choice([1, 1, 1, 2, 2, 3]))
    names = structure.names_of_axes(family, count)
    laws = [structure.FRICTION[k] for k in rng.integers(len(structure.FRICTION), size=count)]
    axes = [structure.Axis(name, law) for name, law in zip(names, laws)]
    return structure.Machine(family, names, [], {}, {}, int(rng.integers(count)), axes, family == "gravity")


def give_sizes(rng, machine, signals):
    """Draws all parameters, so that the parts of a target are alike within a decade."""
    scale = 10 ** rng.uniform(-1, 2.5)
    if not machine.moves:
        machine.parameters = structure.sized(rng, machine.columns, signals, scale)
        return
    for axis in machine.axes:
        axis.speed = float(np.quantile(np.abs(signals["d" + axis.name]), 0.95) * 10 ** rng.uniform(-1.3, -0.6))
        columns = structure.axis_columns(machine.family, axis.name, axis.friction, axis.speed)
        axis.parameters = structure.sized(rng, columns, signals, scale)
        if axis is machine.axes[machine.target_axis]:
            machine.columns, machine.parameters = columns, axis.parameters
    n, own = len(machine.axes), machine.target_axis
    inertias = [axis.parameters.get("J", axis.parameters.get("m")) for axis in machine.axes]
    machine.coupling = np.zeros((n, n))
    for i in range(n):
        for j in range(i):
            share = rng.uniform(0.1, 0.45) * (rng.integers(2) * 2 - 1)
            machine.coupling[i, j] = machine.coupling[j, i] = share * np.sqrt(inertias[i] * inertias[j])
    machine.parameters = dict(machine.parameters)
    for j in range(n):
        if j != own:
            name = f"c{j + 1}"
            machine.columns[name] = structure.coupled(machine.coordinates[own], machine.coordinates[j], machine.angular)
            machine.parameters[name] = float(machine.coupling[own, j])


def levels(rng, machine):
    middles, amplitudes = {}, {}
    for name in machine.coordinates + machine.extras:
        if machine.moves:
            middles[name] = rng.uniform(-0.6, 0.6) if machine.angular else 0.0
            amplitudes[name] = 10 ** (rng.uniform(-0.5, 0.25) if machine.angular else rng.uniform(-1.3, -0.1))
        else:
            middles[name], amplitude = structure.LEVELS[machine.family][name]
            amplitudes[name] = amplitude * rng.uniform(0.6, 1.0)
    return middles, amplitudes


def kind_of(seed):
    return truth.KINDS[seed % len(truth.KINDS)]


def case(seed):
    """Everything that the seed says."""
    rng = np.random.Generator(np.random.PCG64(seed))
    kind = kind_of(seed)
    family = structure.FAMILIES[rng.choice(9, p=[0.16, 0.12, 0.1, 0.12, 0.1, 0.1, 0.1, 0.1, 0.1])]
    machine = machine_of(rng, family)
    slowest, quickest = structure.RATES[family]
    rate = float(np.round(slowest * (quickest / slowest) ** rng.uniform(), 0))
    samples = int(round(3000 * (20 / 3) ** rng.uniform()))
    in_loop = machine.moves and kind != "inner" and rng.uniform() < LOOP
    samples = min(samples, LOOP_SAMPLES) if in_loop else samples
    rows = min(200 * 6 ** rng.uniform(), samples / (4.0 if not in_loop else 8.0))
    cutoff = 0.433 * rows * rate / samples
    fastest = cutoff / rng.uniform(5, 10)
    kinds = [references.KINDS[k] for k in rng.integers(4, size=2)]
    middles, amplitudes = levels(rng, machine)
    holds = bool(rng.uniform() < 0.5)
    made = Case(seed, kind, machine, {}, [], [], rate, samples, fastest, cutoff, kinds, amplitudes, middles, in_loop,
                2 * np.pi * fastest * rng.uniform(4, 8), holds, 0.0, None, truth.Hidden())
    t = np.arange(samples) / rate
    signals = prescribed(made, 1, t)
    give_sizes(rng, machine, signals)
    made.parameters = dict(machine.parameters)
    size_drawn = 10 ** rng.uniform(0, 2)
    share = 10 ** rng.uniform(-3, np.log10(min(0.05, 0.7 / size_drawn)))
    return complete(rng, made, size_drawn, share)


def complete(rng, made, size, share):
    """Draws noise, free parameters and what is hidden of a machine whose nominal model is known."""
    machine = made.machine
    fine, t = fine_run(made, 1), np.arange(made.samples) / made.rate
    spread = float(np.std(fine.target))
    noise, made.size = share * spread, size
    made.chain = measure.draw(rng, machine, made.amplitudes, noise, 1 / made.rate, made.cutoff, made.in_loop)
    targets = [fine_run(made, number, 1).target for number in (1, 2)]
    made.chain = measure.with_plausible_clocks(made.chain, t, targets, made.cutoff)
    names = list(machine.parameters)
    must = made.kind in ("parameters", "both")
    if must or rng.uniform() < 0.6:
        count = int(rng.integers(1, len(names) + 1))
        made.free = sorted((names[k] for k in rng.permutation(len(names))[:count]), key=names.index)
    nominal = structure.output(machine, fine.signals, machine.parameters)
    made.given = machine.inputs()
    made.hidden = truth.draw(
        rng, made.kind, machine, machine.parameters, fine, nominal, made.free, size * noise, not made.in_loop
    )
    made.parameters = {name: value + made.hidden.changes.get(name, 0.0) for name, value in machine.parameters.items()}
    return made
