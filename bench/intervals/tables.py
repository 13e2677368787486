"""Tables for intervals: public sets, and made ones whose noise is known. Each is (train, test, groups of test rows).

A column "weight" holds the weights of the rows, and no input.
"""

import numpy as np
import pandas as pd

SETS = "yacht concrete airfoil abalone cpu_act kin8nm puma8NH ccpp california fried".split()


def public(folder, name, split, most_train=3000, most_test=2000):
    table = pd.read_csv(f"{folder}/{name}.csv")
    is_test = pd.read_csv(f"{folder}/{name}.splits.csv")[f"split{split}"].to_numpy() == 1
    parts = table[~is_test], table[is_test]
    train, test = (
        part.sample(min(len(part), most), random_state=split).reset_index(drop=True)
        for part, most in zip(parts, (most_train, most_test), strict=True)
    )
    return train, test, {}


def frame(X, y):
    table = pd.DataFrame(X, columns=[f"x{j + 1}" for j in range(X.shape[1])])
    table["y"] = y
    return table


def noise_changes(rng, rows):
    """Noise of 0.02 + x3^2."""

    def made(n):
        X = rng.uniform(size=(n, 5))
        noise = 0.02 + X[:, 2] ** 2
        return frame(X, 3 * X[:, 0] + np.sin(6 * X[:, 1]) + noise * rng.normal(size=n))

    train, test = made(rows), made(4000)
    return train, test, {"fifth of noise": np.minimum(5 * test["x3"], 4).astype(int)}


def loud_levels(rng, rows):
    """Three of twelve levels have noise of 1, the others of 0.15."""

    def made(n):
        X, level = rng.uniform(size=(n, 3)), rng.integers(0, 12, n)
        noise = np.where(level % 4 == 0, 1.0, 0.15)
        table = frame(X, 2 * X[:, 0] + 3 * X[:, 1] ** 2 + 0.3 * level + noise * rng.normal(size=n))
        table["x4"] = [f"c{k:02d}" for k in level]
        return table, level % 4 == 0

    (train, _), (test, loud) = made(rows), made(4000)
    return train, test, {"loud": loud}


def rare_levels(rng, rows):
    """30 levels, noise of 0.8 in those of at most 30 rows, 0.2 in the others. Test rows: as many of each level."""
    shares = 1 / np.arange(1, 31) ** 2.2
    level = rng.choice(30, rows, p=shares / shares.sum())
    count = np.bincount(level, minlength=30)
    offset = rng.normal(size=30) / 2

    def made(level):
        X = rng.uniform(size=(len(level), 2))
        noise = np.where(count[level] <= 30, 0.8, 0.2)
        table = frame(X, 2 * X[:, 0] + X[:, 1] + offset[level] + noise * rng.normal(size=len(level)))
        table["x3"] = [f"c{k:02d}" for k in level]
        return table

    asked = rng.choice(np.flatnonzero(count), 4000)
    names = np.array(["1-5", "6-10", "11-30", "31-100", "100-"])
    return made(level), made(asked), {"rows of level": names[np.digitize(count[asked], [6, 11, 31, 101])]}


def missing_cells(rng, rows):
    """A tenth of the rows lack an input that counts."""

    def made(n):
        X = rng.uniform(size=(n, 3))
        table = frame(X, 4 * X[:, 0] + np.sin(5 * X[:, 1]) + 0.2 * rng.normal(size=n))
        lacks = rng.uniform(size=n) < 0.1
        table.loc[lacks, "x1"] = np.nan
        return table, lacks

    (train, _), (test, lacks) = made(rows), made(4000)
    return train, test, {"lacks x1": lacks}


def hole(rng, rows):
    """No training rows where x1 is from 0.4 to 0.7 and x2 from 0.3 to 0.7."""

    def truth(X):
        return 2 * np.sin(5 * X[:, 0]) + 3 * X[:, 1] ** 2

    def inside(X):
        return (np.abs(X[:, 0] - 0.55) < 0.15) & (np.abs(X[:, 1] - 0.5) < 0.2)

    X = rng.uniform(size=(4 * rows, 2))
    X = X[~inside(X)][:rows]
    asked = rng.uniform(size=(4000, 2))
    made = [frame(x, truth(x) + 0.15 * rng.normal(size=len(x))) for x in (X, asked)]
    return made[0], made[1], {"in the hole": inside(asked)}


def empty(rng, rows):
    """No training rows in a place of two of six inputs: a band, a box or a corner, drawn."""
    centre, half = [(0.5, 0.5), (0.55, 0.5), (0.8, 0.8)], [(0.1, 0.5), (0.15, 0.2), (0.2, 0.2)]
    place = rng.integers(0, 3)

    def inside(X):
        return np.all(np.abs(X[:, :2] - centre[place]) < half[place], axis=1)

    X = rng.uniform(size=(8 * rows, 6))
    X = X[~inside(X)][:rows]
    asked = rng.uniform(size=(4000, 6))
    made = [frame(x, 2 * np.sin(5 * x[:, 0]) + 3 * x[:, 1] ** 2 + x[:, 2] + 0.3 * rng.normal(size=len(x))) for x in (X, asked)]
    return made[0], made[1], {"in the hole": inside(asked)}


def even(rng, rows):
    """Friedman's function with noise of 1 everywhere."""

    def made(n):
        X = rng.uniform(size=(n, 6))
        y = 10 * np.sin(np.pi * X[:, 0] * X[:, 1]) + 20 * (X[:, 2] - 0.5) ** 2 + 10 * X[:, 3] + 5 * X[:, 4]
        return frame(X, y + rng.normal(size=n))

    return made(rows), made(4000), {}


def of_size(rng, rows):
    """Noise in proportion to the value."""

    def made(n):
        X = rng.normal(size=(n, 5))
        return frame(X, np.exp(0.5 * X[:, 0] + 0.3 * X[:, 1] * X[:, 2] + 0.3 * rng.normal(size=n)))

    return made(rows), made(4000), {}


def repeated(rng, rows):
    """States with five rows each; test rows are of new states."""

    def made(n):
        states = np.repeat(rng.uniform(size=(n // 5, 3)), 5, axis=0)
        return frame(states, 3 * states[:, 0] + np.sin(6 * states[:, 1]) + (0.1 + states[:, 2]) * rng.normal(size=n))

    train, test = made(rows), made(4000)
    return train, test, {"fifth of noise": np.minimum(5 * test["x3"], 4).astype(int)}


def weighted(rng, rows):
    """Noise of the variance 1 / weight, weights from 1/16 to 16."""

    def made(n):
        X, weight = rng.uniform(size=(n, 4)), 16.0 ** rng.uniform(-1, 1, n)
        table = frame(X, 5 * X[:, 0] + 2 * np.sin(6 * X[:, 1]) + 0.5 * rng.normal(size=n) / np.sqrt(weight))
        table["weight"] = weight
        return table

    train, test = made(rows), made(4000)
    return train, test, {"fifth of weight": fifth(test["weight"])}


def important(rng, rows):
    """The same weights, which say how much rows matter: noise of 0.5 everywhere."""

    def made(n):
        X = rng.uniform(size=(n, 4))
        table = frame(X, 5 * X[:, 0] + 2 * np.sin(6 * X[:, 1]) + 0.5 * rng.normal(size=n))
        table["weight"] = 16.0 ** rng.uniform(-1, 1, n)
        return table

    train, test = made(rows), made(4000)
    return train, test, {"fifth of weight": fifth(test["weight"])}


def in_time(rng, rows):
    """Rows in time: inputs and noise are AR(1) with 0.9 and 0.8. Test rows are of another stretch."""

    def steps(n, memory):
        values = np.empty(n)
        values[0] = rng.normal()
        for t in range(1, n):
            values[t] = memory * values[t - 1] + np.sqrt(1 - memory**2) * rng.normal()
        return values

    def made(n):
        X = np.column_stack([steps(n, 0.9) for _ in range(3)])
        return frame(X, 2 * X[:, 0] + np.sin(2 * X[:, 1]) + 0.5 * steps(n, 0.8))

    return made(rows), made(4000), {}


def fifth(values):
    return np.argsort(np.argsort(values, kind="stable"), kind="stable") * 5 // len(values)


# The maker, the number of rows, and what `llmt fit` is told of them.
MADE = {
    "noise changes": (noise_changes, 2000),
    "loud levels": (loud_levels, 2000),
    "rare levels": (rare_levels, 1000),
    "missing cells": (missing_cells, 1500),
    "hole": (hole, 1500),
    "empty place": (empty, 1500),
    "even": (even, 1000),
    "of size": (of_size, 1500),
    "repeated": (repeated, 1500),
    "even, 30 rows": (even, 30),
    "even, 60 rows": (even, 60),
    "noise changes, 150 rows": (noise_changes, 150),
    "weighted": (weighted, 2000),
    "weighted, 60 rows": (weighted, 60),
    "important": (important, 2000),
    "in time": (in_time, 1500, "--contiguous"),
}


def options_of(name):
    return MADE[name][2:] if name in MADE else ()


def made(name, seed):
    maker, rows = MADE[name][:2]
    return maker(np.random.default_rng([seed, len(name)]), rows)
