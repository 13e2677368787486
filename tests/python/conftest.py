"""Fitted models that several tests look at."""

import json

import numpy as np
import pytest

from llmt import _core

HOSTILE = ['<script>"x"</script>', "größe]]>", "\u202eleft\u2066", "אבג", "$x^2$ & 'q'"]


class Fitted:
    """A model with all that the functions of output take."""

    def __init__(self, X, y, names=None, levels=None, outputs=None, **options):
        y = np.asarray(y, dtype=float).reshape(len(X), -1)
        self.X, self.y = X, y
        self.fit = _core.fit(
            X,
            y,
            {"folds.count" if name == "folds" else name: value for name, value in options.items()},
            input_names=names or [f"x{k}" for k in range(X.shape[1])],
            output_names=outputs or [f"y{k}" for k in range(y.shape[1])],
            levels=levels or [[] for _ in range(X.shape[1])],
        )
        self.model = json.loads(self.fit.model())
        self.summary = json.loads(self.fit.summary("table"))
        self.handle = _core.Model(self.fit.model())


def stepped(rows=400, noise=0.1):
    rng = np.random.default_rng(3)
    X = rng.uniform(-1, 1, (rows, 3))
    return X, np.where(X[:, 0] > 0.2, 5 + 2 * X[:, 1], -3 * X[:, 2]) + noise * rng.normal(size=rows)


def words(rows=500):
    """Numbers, a category and missing cells, with names that ask for trouble."""
    rng = np.random.default_rng(4)
    X = np.column_stack([rng.uniform(20, 90, rows), rng.integers(0, 3, rows), rng.uniform(0, 1, rows)])
    X[rng.random(rows) < 0.15, 2] = np.nan
    y = np.where(X[:, 1] == 2, 0.3 * X[:, 0], 20 - 0.1 * X[:, 0]) + 5 * np.isnan(X[:, 2]) + rng.normal(size=rows)
    return X, y, [[], [HOSTILE[0], HOSTILE[2], "green"], []]


@pytest.fixture(scope="session")
def crisp():
    X, y = stepped()
    return Fitted(X, y, validity="crisp", names=["a", "b", "c"], outputs=["force"])


@pytest.fixture(scope="session")
def hostile():
    X, y, levels = words()
    return Fitted(X, y, levels=levels, names=HOSTILE[:3], outputs=[HOSTILE[4]], validity="crisp")


@pytest.fixture(scope="session")
def smooth():
    rng = np.random.default_rng(5)
    X = rng.uniform(-2, 2, (600, 2))
    y = np.sin(2 * X[:, 0]) + 0.5 * X[:, 1] ** 2 + 0.05 * rng.normal(size=600)
    return Fitted(X, y, validity="blend", max_leaves=12)


@pytest.fixture(scope="session")
def large():
    rng = np.random.default_rng(6)
    X = rng.uniform(-3, 3, (1000, 2))
    return Fitted(X, (X**2).sum(axis=1), validity="crisp")
