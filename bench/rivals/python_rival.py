"""python_rival.py METHOD TRAIN TEST COLUMNS THREADS: one line of JSON, see run.py. Exit 77: not installed."""
import gc
import json
import resource
import sys
import time

import numpy as np


def load(path, columns):
    # Mapped, not read: memory that is freed again would not count when the fit takes it.
    rows = np.memmap(path, mode="r", dtype=float).reshape(columns, -1).T
    return np.array(rows[:, :-1], order="C"), np.array(rows[:, -1])


def memory(word):
    with open("/proc/self/status") as status:
        return next(1024.0 * int(line.split()[1]) for line in status if line.startswith(word))


def forget_peak():
    with open("/proc/self/clear_refs", "w") as file:
        file.write("5")


def cpu_seconds():
    # Not time.process_time, which counts in ticks of 4 ms where the CPU time is limited.
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def make(method, threads):
    """An estimator, a function that counts its leaves, and the version of its package."""
    if method == "XGBoost":
        import xgboost

        count = lambda model: sum(tree.count("leaf=") for tree in model.get_booster().get_dump())
        model = xgboost.XGBRegressor(n_estimators=300, learning_rate=0.1, tree_method="hist", n_jobs=threads)
        return model, count, xgboost.__version__
    import sklearn

    if method == "HistGB":
        from sklearn.ensemble import HistGradientBoostingRegressor

        model = HistGradientBoostingRegressor(max_iter=300, early_stopping=False)
        count = lambda model: sum(tree.get_n_leaf_nodes() for step in model._predictors for tree in step)
    elif method == "tree":
        from sklearn.tree import DecisionTreeRegressor

        # Fully grown it would repeat the noise; five rows a leaf is the usual choice for regression.
        model = DecisionTreeRegressor(min_samples_leaf=5, random_state=0)
        count = lambda model: model.get_n_leaves()
    else:
        from sklearn.linear_model import LinearRegression

        model, count = LinearRegression(), lambda model: 1
    return model, count, sklearn.__version__


def main():
    method, train, test, columns, threads = sys.argv[1:]
    try:
        model, count, version = make(method, int(threads))
    except ImportError as error:
        print(error, file=sys.stderr)
        return 77
    x, y = load(train, int(columns))
    test_x, test_y = load(test, int(columns))
    gc.collect()
    forget_peak()
    before = memory("VmHWM:")
    wall, cpu = time.perf_counter(), cpu_seconds()
    model.fit(x, y)
    fit_wall, fit_cpu = time.perf_counter() - wall, cpu_seconds() - cpu
    peak = memory("VmHWM:") - before
    runs, wall, cpu = 0, time.perf_counter(), cpu_seconds()
    while runs == 0 or time.perf_counter() - wall < 0.5:
        predicted = model.predict(test_x)
        runs += 1
    per_million = 1e6 / (runs * len(test_y))
    predict_wall, predict_cpu = (time.perf_counter() - wall) * per_million, (cpu_seconds() - cpu) * per_million
    print(json.dumps({
        "fit_wall": fit_wall, "fit_cpu": fit_cpu, "predict_wall": predict_wall, "predict_cpu": predict_cpu,
        "memory": peak, "rmse": float(np.sqrt(np.mean((predicted - test_y)**2))), "leaves": int(count(model)),
        "version": version}))
    return 0


sys.exit(main())
