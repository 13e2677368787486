"""Motions that a machine follows, as functions of the time with exact first and second derivatives.

`draw(rng, kind, fastest, amplitude, seconds)` gives a function: times (n) -> position, velocity, acceleration (n each).
Frequencies are in Hz, times in s; a motion begins anywhere.
"""

import numpy as np

KINDS = ("sines", "chirp", "moves", "steps")


def sines(rng, fastest, amplitude, seconds):
    """Three to six sines from a tenth of the fastest frequency up to it."""
    count = int(rng.integers(3, 7))
    w = 2 * np.pi * np.geomspace(fastest / 10, fastest, count) * rng.uniform(0.93, 1.0, count)
    sizes, phases = rng.uniform(0.5, 1.5, count), rng.uniform(0, 2 * np.pi, count)
    sizes *= amplitude / sizes.sum() * 1.4

    def motion(t):
        angle = np.multiply.outer(t, w) + phases
        return np.sin(angle) @ sizes, np.cos(angle) @ (sizes * w), -np.sin(angle) @ (sizes * w * w)

    return motion


def chirp(rng, fastest, amplitude, seconds):
    """Two sweeps of the frequency, one up and one down, of different lengths."""
    slowest, phases = fastest * rng.uniform(0.03, 0.1), rng.uniform(0, 2 * np.pi, 2)
    shares = rng.uniform(0.3, 0.7)
    ends = [(slowest, fastest), (fastest * rng.uniform(0.6, 1.0), slowest)]
    sizes = amplitude * np.array([shares, 1 - shares])

    def motion(t):
        q, dq, ddq = np.zeros_like(t), np.zeros_like(t), np.zeros_like(t)
        for size, (first, last), phase in zip(sizes, ends, phases):
            rate = 2 * np.pi * (last - first) / seconds
            w = 2 * np.pi * first + rate * t
            angle = phase + 2 * np.pi * first * t + rate * t * t / 2
            q += size * np.sin(angle)
            dq += size * w * np.cos(angle)
            ddq += size * (rate * np.cos(angle) - w * w * np.sin(angle))
        return q, dq, ddq

    return motion


def moves(rng, fastest, amplitude, seconds):
    """Point-to-point moves, polynomials of degree 7 in time, with rests between them."""
    starts, lengths, points = [], [], [rng.uniform(-1, 1) * amplitude]
    t = rng.uniform(0, 1) / fastest
    rests = rng.uniform(0.05, 0.8)
    while t < seconds:
        starts.append(t)
        lengths.append(rng.uniform(1.0, 2.5) / fastest)
        points.append(rng.uniform(-1, 1) * amplitude)
        t += lengths[-1] + rng.exponential(rests) / fastest
    starts, lengths, points = np.array(starts), np.array(lengths), np.array(points)

    def motion(t):
        k = np.maximum(np.searchsorted(starts, t, side="right") - 1, 0)
        span = lengths[k]
        x = np.clip((t - starts[k]) / span, 0, 1)
        way = points[k + 1] - points[k]
        q = points[k] + way * x**4 * (35 - 84 * x + 70 * x**2 - 20 * x**3)
        dq = way / span * 140 * x**3 * (1 - x) ** 3
        ddq = way / span**2 * 420 * x**2 * (1 - x) ** 2 * (1 - 2 * x)
        return q, dq, ddq

    return motion


def steps(rng, fastest, amplitude, seconds):
    """Random steps through five equal lags of the first order (a gamma distribution's step response)."""
    w = 2 * np.pi * fastest
    gaps = rng.exponential(1.2 / fastest, int(3 * seconds * fastest) + 10) + 0.3 / fastest
    times = np.cumsum(gaps) - 3 / fastest
    times = times[times < seconds]
    levels = rng.uniform(-1, 1, len(times) + 1) * amplitude * 1.2
    jumps = np.diff(levels)

    def motion(t):
        q, dq, ddq = np.full_like(t, levels[0]), np.zeros_like(t), np.zeros_like(t)
        for at, jump in zip(times, jumps):
            first, last = np.searchsorted(t, [at, at + 45 / w])
            x = w * (t[first:last] - at)
            tail = np.exp(-x)
            q[first:last] += jump * (1 - tail * (1 + x + x**2 / 2 + x**3 / 6 + x**4 / 24))
            q[last:] += jump
            dq[first:last] += jump * w * tail * x**4 / 24
            ddq[first:last] += jump * w * w * tail * (x**3 / 6 - x**4 / 24)
        return q, dq, ddq

    return motion


def draw(rng, kind, fastest, amplitude, seconds):
    """A motion of one coordinate; `steps` needs times in rising order."""
    return {"sines": sines, "chirp": chirp, "moves": moves, "steps": steps}[kind](rng, fastest, amplitude, seconds)
