"""Regression beside boosted trees: a smooth function with a step, noise, and 5000 rows."""

import time

import numpy as np
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.metrics import root_mean_squared_error
from sklearn.model_selection import train_test_split

from llmt import LocalLinearTreeRegressor

rng = np.random.default_rng(0)
X = rng.uniform(-1, 1, (5000, 5))
truth = np.where(X[:, 0] > 0.3, 2 * X[:, 1], np.sin(2 * X[:, 2])) + X[:, 3]
y = truth + rng.normal(scale=0.2, size=len(X))
X_train, X_test, y_train, y_test = train_test_split(X, y, random_state=0)

rivals = {"llmt": LocalLinearTreeRegressor(), "HistGradientBoosting": HistGradientBoostingRegressor(random_state=0)}
try:
    from lightgbm import LGBMRegressor

    rivals["LightGBM"] = LGBMRegressor(verbose=-1, random_state=0)
except ImportError:
    pass

print("noise alone: 0.200")
for name, rival in rivals.items():
    start = time.process_time()
    rival.fit(X_train, y_train)
    seconds = time.process_time() - start
    error = root_mean_squared_error(y_test, rival.predict(X_test))
    print(f"{name:22} RMSE on held-out rows {error:.3f}   {seconds:.1f} CPU s")

model = rivals["llmt"]
print(model.candidates_)
