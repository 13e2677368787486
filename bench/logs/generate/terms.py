"""The families of `llmt discover` as functions of signals (docs/discovery-generic.md, "What is tried"), drawn at random.

A `Term` holds family, place and searched constants; `basis()` are its columns, of which the coefficients are multiples.
"""

import dataclasses

import numpy as np

NONE = {"": [{}]}


@dataclasses.dataclass(frozen=True)
class Term:
    family: str
    place: tuple  # names of inputs
    constants: tuple = ()  # (name, value)
    coefficients: tuple = (1.0,)

    @property
    def label(self):
        return f"{self.family} {','.join(self.place)}".strip()


def sign(x):
    return np.sign(x)


# Family -> (domain of the input, names of constants, function of input x, constants c, and output s -> columns).
# Domains: any, signed (changes sign), nonnegative, positive. Two: of two inputs.
ONE = {
    "linear": ("any", lambda x, c, s: [x]),
    "square": ("any", lambda x, c, s: [x**2]),
    "cube": ("any", lambda x, c, s: [x**3]),
    "root": ("nonnegative", lambda x, c, s: [np.sqrt(np.maximum(x, 0))]),
    "log": ("positive", lambda x, c, s: [np.log(np.maximum(x, 1e-300))]),
    "reciprocal": ("positive", lambda x, c, s: [1 / x]),
    "absolute": ("signed", lambda x, c, s: [np.abs(x)]),
    "sign": ("signed", lambda x, c, s: [sign(x)]),
    "signed_square": ("signed", lambda x, c, s: [x * np.abs(x)]),
    "harmonic1": ("angle", lambda x, c, s: [np.cos(x), np.sin(x)]),
    "harmonic2": ("angle", lambda x, c, s: [np.cos(2 * x), np.sin(2 * x)]),
    "wave": ("any", lambda x, c, s: [np.cos(2 * np.pi * x / c["P"]), np.sin(2 * np.pi * x / c["P"])]),
    "step": ("any", lambda x, c, s: [(x > c["c"]) * 1.0]),
    "hinge": ("any", lambda x, c, s: [np.maximum(0, x - c["c"])]),
    "hinge_below": ("any", lambda x, c, s: [np.maximum(0, c["c"] - x)]),
    "settling": ("any", lambda x, c, s: [np.exp(-(x - c["low"]) / c["tau"])]),
    "saturation": ("nonnegative", lambda x, c, s: [x / (c["c"] + x)]),
    "tanh": ("signed", lambda x, c, s: [np.tanh(x / c["c"])]),
    "asinh": ("signed", lambda x, c, s: [np.arcsinh(x / c["c"])]),
    "stribeck": ("signed", lambda x, c, s: [sign(x) * np.exp(-((x / c["c"]) ** 2))]),
    "coulomb_stribeck": ("signed", lambda x, c, s: [sign(x), sign(x) * np.exp(-((x / c["c"]) ** 2))]),
    "signed_power": ("signed", lambda x, c, s: [sign(x) * np.abs(x) ** c["p"]]),
    "limit": ("signed", lambda x, c, s: [np.clip(x, -c["c"], c["c"])]),
    "dead_band": ("signed", lambda x, c, s: [sign(x) * np.maximum(0, np.abs(x) - c["c"])]),
    "load_friction": ("signed", lambda x, c, s: [sign(x) * np.abs(s)]),
    "power": ("nonnegative", lambda x, c, s: [np.maximum(x, 0) ** c["p"]]),
    "hill": ("nonnegative", lambda x, c, s: [np.maximum(x, 0) ** c["n"] / (c["c"] ** c["n"] + np.maximum(x, 0) ** c["n"])]),
    "sigmoid": ("any", lambda x, c, s: [1 / (1 + np.exp(-(x - c["c"]) / c["w"]))]),
}
TWO = {
    "product": lambda x, y: x * y,
    "square_product": lambda x, y: x**2 * y,
    "sign_product": lambda x, y: sign(x) * np.abs(y),
}
OF_OUTPUT = {"offset": lambda s: np.ones_like(s), "gain": lambda s: s, "gain_curvature": lambda s: s**2}


def basis(term, signals, simulated):
    """Columns of a term; `simulated` is the nominal output at the same rows."""
    if term.family in OF_OUTPUT:
        return [OF_OUTPUT[term.family](simulated)]
    if term.family in TWO:
        return [TWO[term.family](*(signals[name] for name in term.place))]
    return ONE[term.family][1](signals[term.place[0]], dict(term.constants), simulated)


def value(term, signals, simulated):
    return sum(c * column for c, column in zip(term.coefficients, basis(term, signals, simulated)))


def fits(domain, name, low, high):
    """Is the family defined for an input of this name and range?"""
    if domain == "signed":
        return low < -0.1 * high and high > -0.1 * low
    if domain in ("nonnegative", "positive"):
        return low > 0
    if domain == "angle":
        return name.startswith("q") and 1.0 <= high - low <= 4 * np.pi
    return True


def constants_of(family, x, position):
    """Searched constants, drawn by `position` in 0 ... 1 (one number, or two), from the distribution of the input x."""
    first, second = position
    low, high = x.min(), x.max()
    far, span = np.quantile(np.abs(x), 0.98), high - low
    between = np.quantile(x, 0.25 + 0.5 * first)
    if low < 0 < high and abs(between) < 0.1 * far:  # at 0 a step is an offset and a sign
        between = (0.1 + 0.3 * first) * far * (1 if second < 0.5 else -1)
    if family in ("step", "hinge", "hinge_below"):
        return (("c", between),)
    if family == "wave":
        return (("P", span * 0.6 * 0.2**first),)
    if family == "settling":
        return (("low", low), ("tau", span * 0.08 * 5**first))
    if family in ("saturation", "tanh", "asinh", "limit", "dead_band"):
        return (("c", far * 0.1 * 6**first),)
    if family in ("stribeck", "coulomb_stribeck"):
        return (("c", far * 0.05 * 5**first),)
    if family in ("signed_power", "power"):
        return (("p", 0.4 + 0.4 * first if second < 0.5 else 1.3 + 1.2 * first),)
    if family == "hill":
        return (("c", between), ("n", 2.0 + 4 * second))
    if family == "sigmoid":
        return (("c", between), ("w", span * (0.03 + 0.12 * second)))
    return ()


def applicable(family, signals, candidates):
    """Places at which the family may stand."""
    if family in OF_OUTPUT:
        return [()]
    if family in TWO:
        first = [a for a in candidates if family != "sign_product" or fits("signed", a, signals[a].min(), signals[a].max())]
        return [(a, b) for a in first for b in candidates if a != b]
    domain = ONE[family][0]
    return [(a,) for a in candidates if fits(domain, a, signals[a].min(), signals[a].max())]


def draw(rng, signals, candidates, without=()):
    """A term of a family drawn first, at a place drawn among those where it is defined. Coefficients are of unit size."""
    families = [f for f in (*OF_OUTPUT, *ONE, *TWO) if f not in without]
    while True:
        family = families[rng.integers(len(families))]
        places = applicable(family, signals, candidates)
        position = rng.uniform(size=2)
        place = int(rng.integers(1000000))
        turn, direction = rng.uniform(0.1, 0.9), rng.integers(2) * 2 - 1
        if places:
            place = places[place % len(places)]
            break
    constants = constants_of(family, signals[place[0]], position) if len(place) == 1 else ()
    two = family in ("harmonic1", "harmonic2", "wave", "coulomb_stribeck")
    angle = turn * np.pi / 2
    coefficients = (float(np.cos(angle)), float(np.sin(angle) * direction)) if two else (1.0,)
    if family == "coulomb_stribeck":
        coefficients = tuple(abs(c) for c in coefficients)
    return Term(family, place, constants, coefficients)


def scaled(term, factor):
    return dataclasses.replace(term, coefficients=tuple(float(c * factor) for c in term.coefficients))
