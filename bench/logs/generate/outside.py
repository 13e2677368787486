"""Effects that no family of `llmt discover` is: smooth random functions, hysteresis, products of three inputs, ...

`draw(rng, signals, candidates, history)` gives (name, inputs, function of a dict of signals in the order of time).
"""

import numpy as np

STATIC = ("smooth of one", "smooth of two", "product of three", "corner", "modulated wave", "skewed friction")
HISTORY = ("play", "presliding")


def normal(x, low, high):
    return (x - low) / (high - low)


def play(x, width):
    """Backlash: follows x within +- width (Prandtl's operator)."""
    out, now = np.empty_like(x), float(x[0])
    for k, value in enumerate(x.tolist()):
        now = min(max(now, value - width), value + width)
        out[k] = now
    return out


def presliding(x, length):
    """Dahl's friction of unit size: builds up along `length` of the way after a reversal."""
    out, now = np.zeros_like(x), 0.0
    steps = np.diff(x, prepend=x[0])
    decay, direction = np.exp(-np.abs(steps) / length).tolist(), np.sign(steps).tolist()
    for k in range(len(out)):
        now = direction[k] + (now - direction[k]) * decay[k] if direction[k] else now
        out[k] = now
    return out


def smooth(rng, count, inputs, ranges):
    """A random sum of waves of the inputs: a draw from a Gaussian process with a short memory."""
    w = rng.normal(0, 1, (count, len(inputs))) * 2 * np.pi * rng.uniform(0.8, 1.6)
    phases, sizes = rng.uniform(0, 2 * np.pi, count), rng.normal(0, 1, count)

    def function(s):
        x = np.array([normal(s[name], *ranges[name]) for name in inputs])
        return np.tensordot(sizes, np.cos(np.tensordot(w, x, 1).T + phases).T, 1)

    return function


def draw(rng, signals, candidates, own, history):
    names = list(dict.fromkeys(candidates))
    ranges = {name: (float(signals[name].min()), float(signals[name].max())) for name in names}
    kinds = STATIC + (HISTORY if history else ())
    kind = kinds[rng.integers(len(kinds))]
    order = [names[k] for k in rng.permutation(len(names))]
    a, b, c = (order * 3)[:3]
    at = {name: float(np.quantile(signals[name], rng.uniform(0.2, 0.5))) for name in (a, b)}
    position = rng.uniform()
    if kind in HISTORY:
        low, high = ranges[own]
        width = (high - low) * 0.01 * 15**position
        if kind == "play":
            return kind, (own,), lambda s: play(s[own], width) - s[own]
        return kind, (own,), lambda s: presliding(s[own], width)
    if kind == "smooth of one":
        return kind, (a,), smooth(rng, 8, (a,), ranges)
    if kind == "smooth of two":
        return kind, (a, b), smooth(rng, 8, (a, b), ranges)
    if kind == "product of three":
        return kind, (a, b, c), lambda s: s[a] * s[b] * s[c]
    if kind == "corner":
        return kind, (a, b), lambda s: np.maximum(0, s[a] - at[a]) * np.maximum(0, s[b] - at[b])
    if kind == "modulated wave":
        period = (ranges[a][1] - ranges[a][0]) * 0.5 * 0.4**position
        return kind, (a, b), lambda s: np.cos(2 * np.pi * s[a] / period) * s[b]
    middle, span = at[a], ranges[a][1] - ranges[a][0]
    return kind, (a, b), lambda s: np.tanh((s[a] - middle) / (0.2 * span)) * np.abs(s[b]) ** (0.5 + position)
