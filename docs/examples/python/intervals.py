"""Prediction intervals that hold what they promise, and rows that they were not made for."""

import numpy as np

from llmt import LocalLinearTreeRegressor

rng = np.random.default_rng(0)


def table(rows):
    X = rng.uniform(0, 10, (rows, 2))
    y = np.where(X[:, 0] < 4, X[:, 1], 8 - X[:, 0]) + rng.normal(scale=0.5, size=rows)
    return X, y


X, y = table(800)
model = LocalLinearTreeRegressor().fit(X, y)

X_new, y_new = table(5000)
for coverage in (0.5, 0.8, 0.9, 0.95):
    lower, upper = model.predict_interval(X_new, coverage=coverage).T
    inside = np.mean((lower <= y_new) & (y_new <= upper))
    print(f"asked for {coverage:.2f}, held {inside:.3f}, mean width {np.mean(upper - lower):.2f}")

print(model.check(X_new + [4, 0]))  # a sensor that reads 4 too much
