"""Memory over many fits and predictions: resident megabytes after 100, 200, ... 1000 of them.

    python bench/python/leaks.py [FITS]
"""

import gc
import sys
from pathlib import Path

import numpy as np

from llmt import LocalLinearTreeRegressor, Model


def resident():
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * 4096 / 2**20


def main():
    fits = int(sys.argv[1]) if len(sys.argv) > 1 else 1000
    rng = np.random.default_rng(0)
    X = rng.uniform(-1, 1, (200, 3))
    y = np.where(X[:, 0] > 0, X[:, 1], X[:, 2])
    for done in range(1, fits + 1):
        model = LocalLinearTreeRegressor(cv=3, n_jobs=1).fit(X, y)
        model.predict_interval(X)
        model.explain(X[:5])
        Model(model.to_json())
        try:
            LocalLinearTreeRegressor(rule="none").fit(X, y)
        except ValueError:
            pass
        if done % max(1, fits // 10) == 0:
            gc.collect()
            print(f"{done:5d} fits {resident():8.1f} MB", flush=True)


main()
