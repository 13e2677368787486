"""What a machine has and its nominal model lacks."""

import dataclasses
from collections.abc import Callable

import numpy as np

from . import outside, states, structure, terms

KINDS = ("complete", "parameters", "effect", "both", "inner", "outside", "regime", "two")
OF_TARGET = ("gain", "gain_curvature", "load_friction")  # not in a loop, where they would depend on accelerations
IMITATED = 0.2  # a hidden term keeps at least this share of its root mean square beside the parameters that are free


@dataclasses.dataclass
class Hidden:
    """The truth of a case. `terms` are right answers; each may act in a regime (input, threshold) alone."""

    terms: tuple = ()
    regime: tuple | None = None
    changes: dict = dataclasses.field(default_factory=dict)  # of parameters
    state: tuple | None = None  # name, strength, constants
    outside: tuple | None = None  # name, inputs
    function: Callable | None = None  # of signals: the effect outside every family

    def force(self, signals, simulated):
        """The part that is a function of the signals, for rows in the order of time."""
        total = np.zeros_like(simulated)
        for term in self.terms:
            acts = signals[self.regime[0]] > self.regime[1] if self.regime else 1.0
            total = total + terms.value(term, signals, simulated) * acts
        return total + self.function(signals) if self.function else total


def beside(column, columns):
    """The share of the root mean square of a column that a fit of the others leaves."""
    if not columns:
        return 1.0
    matrix = np.column_stack(columns)
    left = column - matrix @ np.linalg.lstsq(matrix, column, rcond=None)[0]
    return float(np.sqrt(np.mean(left**2) / max(np.mean(column**2), 1e-300)))


def candidates(machine):
    """Inputs of hidden effects, the likelier ones several times."""
    own = machine.coordinates[machine.target_axis]
    others = [name for name in machine.coordinates if name != own]
    names = [own] * 3 + ["d" + own] * 4 + machine.extras * 3 + others + ["d" + name for name in others]
    return names + ["dd" + own] if machine.moves else names


def rms(x):
    return float(np.sqrt(np.mean(x**2)))


def draw_term(rng, machine, signals, simulated, free, names, size, history, regime=None, known=()):
    """A term of the library with a root mean square `size`, that the free parameters do not imitate."""
    columns = [machine.columns[name](signals) for name in free] + [np.ones_like(simulated)]
    without = () if history else OF_TARGET
    without += ("offset", "gain", "gain_curvature") if regime else ()
    if regime:
        names = [name for name in names if name != regime[0]]
    acts = signals[regime[0]] > regime[1] if regime else 1.0
    while True:
        term = terms.draw(rng, signals, names, without)
        if not machine.moves and term.family == "load_friction":
            continue
        column = terms.value(term, signals, simulated) * acts
        others = columns if term.family != "offset" else columns[:-1]
        others = others + [terms.value(other, signals, simulated) for other in known]
        if np.all(np.isfinite(column)) and rms(column) > 0 and beside(column, others) >= IMITATED:
            return terms.scaled(term, (rng.integers(2) * 2 - 1) * size / rms(column))


def draw_changes(rng, machine, parameters, signals, free, size):
    """Changes of one or more free parameters whose effect has the root mean square `size`, none by more than half."""
    count = int(rng.integers(1, len(free) + 1))
    names = [free[k] for k in rng.permutation(len(free))[:count]]
    changes = {name: parameters[name] * 10 ** rng.uniform(-1, 0) * (rng.integers(2) * 2 - 1) for name in names}
    scale = size / rms(sum(change * machine.columns[name](signals) for name, change in changes.items()))
    scale = min(scale, *(0.5 * parameters[name] / abs(change) for name, change in changes.items()))
    return {name: float(change * scale) for name, change in changes.items()}


def draw(rng, kind, machine, parameters, run, simulated, free, size, history):
    """The hidden part of a case; `run` is a Fine run of the nominal machine and `size` its root mean square."""
    signals, names = run.signals, candidates(machine)
    own = machine.coordinates[machine.target_axis]
    if not history:  # a loop needs forces that are no functions of accelerations
        names = [name for name in names if not name.startswith("dd")]
    term = lambda **more: draw_term(rng, machine, signals, simulated, free, names, size, history, **more)
    if kind == "complete":
        return Hidden()
    if kind == "parameters":
        return Hidden(changes=draw_changes(rng, machine, parameters, signals, free, size))
    if kind == "effect":
        return Hidden(terms=(term(),))
    if kind == "both":
        other = size * 10 ** rng.uniform(-0.5, 0.5)
        return Hidden(terms=(term(),), changes=draw_changes(rng, machine, parameters, signals, free, other))
    if kind == "two":
        first = term()
        second = draw_term(rng, machine, signals, simulated, free, names, size * 10 ** rng.uniform(-0.3, 0.3), history, known=(first,))
        return Hidden(terms=(first, second))
    if kind == "regime":
        inputs = list(dict.fromkeys(names))
        where = inputs[rng.integers(len(inputs))]
        threshold = float(np.quantile(signals[where], rng.uniform(0.35, 0.75)))
        return Hidden(terms=(term(regime=(where, threshold)),), regime=(where, threshold))
    if kind == "outside":
        name, inputs, function = outside.draw(rng, signals, names, own, history)
        factor = (rng.integers(2) * 2 - 1) * size / rms(function(signals))
        return Hidden(outside=(name, inputs), function=lambda s: factor * function(s))
    possible = states.names(machine)
    name = possible[rng.integers(len(possible))]
    constants = states.constants_of(rng, name, run)
    return Hidden(state=(name, states.strength_of(name, run, constants, size), constants))
