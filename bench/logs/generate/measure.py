"""From true signals to a log: encoders, noise and its colour, clocks."""

import dataclasses

import numpy as np
from scipy import signal


@dataclasses.dataclass
class Chain:
    """How a machine is logged. Standard deviations and resolutions are those of single samples."""

    resolutions: dict  # of coordinates
    jitter: dict  # white noise of coordinates before they are rounded
    extras: dict  # white noise of the other inputs
    noise: float  # of the target
    coloured: float  # share of the variance of the target's noise that is AR(1)
    memory: float  # s, of that part
    counts: float  # resolution of the target
    late: float  # s, of the target; negative: ahead
    drift: float  # s, by which its clock is off at the end


def coloured(rng, count, memory, sample):
    """AR(1) noise of unit variance."""
    keep = np.exp(-sample / memory) if memory > 0 else 0.0
    white = rng.standard_normal(count)
    start = rng.standard_normal()
    return signal.lfilter([np.sqrt(1 - keep**2)], [1.0, -keep], white, zi=np.array([keep * start]))[0]


def draw(rng, machine, amplitudes, noise, sample, cutoff, in_loop):
    """A loop needs an encoder that is fine enough not to shake the machine."""
    coarsest = 3.4 if in_loop else 2.7
    resolutions = {name: amplitudes[name] * 10 ** -rng.uniform(coarsest, 4.7) for name in machine.coordinates}
    jitter = {name: r * 10 ** rng.uniform(-1.5, 0.2) for name, r in resolutions.items()}
    extras = {name: amplitudes[name] * 10 ** -rng.uniform(2.0, 3.5) for name in machine.extras}
    share = 0.0 if rng.uniform() < 0.5 else rng.uniform(0.2, 1.0)
    memory = sample * (0.5 / cutoff / sample) ** rng.uniform(0.2, 1.0)
    late = sample * 10 ** rng.uniform(-1.3, 0.0) * rng.choice([-1, 1]) if rng.uniform() < 0.25 else 0.0
    drift = sample * 10 ** rng.uniform(-1.3, 0.3) if rng.uniform() < 0.2 else 0.0
    return Chain(resolutions, jitter, extras, noise, share, memory, noise * rng.uniform(0.05, 1.0), late, drift)


def filtered_noise(chain, sample, cutoff):
    """Standard deviation of the target's noise behind an ideal low pass."""
    white = (1 - chain.coloured) * min(1.0, 2 * cutoff * sample)
    slow = chain.coloured * 2 / np.pi * np.arctan(2 * np.pi * cutoff * max(chain.memory, sample / 2))
    return chain.noise * np.sqrt(white + slow)


def with_plausible_clocks(chain, t, targets, cutoff):
    """Clocks of the measurement move the target of no run by more than 0.3 of its noise in the rows: more would be
    hidden."""
    seconds = t[-1] - t[0]
    most = 0.3 * filtered_noise(chain, t[1] - t[0], cutoff)
    for name in ("late", "drift"):
        by = getattr(chain, name)
        delay = by if name == "late" else by * (t - t[0]) / seconds
        moved = max(np.sqrt(np.mean((np.interp(t - delay, t, target) - target) ** 2)) for target in targets)
        if moved > most:
            chain = dataclasses.replace(chain, **{name: by * most / moved})
    return chain


def rounded(x, step):
    return np.round(x / step) * step


def log(rng, chain, t, signals, grid, target, shown=None):
    """The log at times t. `target` is given on `grid`; `shown` are coordinates that sensors in a loop have shown."""
    sample = t[1] - t[0]
    table = {"t": t}
    for name, step in chain.resolutions.items():
        white = rng.standard_normal(len(t)) * chain.jitter[name]
        table[name] = shown[name] if shown else rounded(signals[name] + white, step)
    delay = chain.late + chain.drift * (t - t[0]) / (t[-1] - t[0])
    white, slow = rng.standard_normal(len(t)), coloured(rng, len(t), chain.memory, sample)
    noise = chain.noise * (np.sqrt(1 - chain.coloured) * white + np.sqrt(chain.coloured) * slow)
    table["u"] = rounded(np.interp(t - delay, grid, target) + noise, chain.counts)
    for name, size in chain.extras.items():
        table[name] = signals[name] + size * rng.standard_normal(len(t))
    return table
