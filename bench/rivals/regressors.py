"""The regressors that run.py compares: name -> (package, function that makes one of a seed: 0, 1, ...).

All have the defaults of their package, except for one thread, the seed where there is one, and silence; what else a
row sets is in its name. requirements.txt has the packages. M5P is a program of Weka, which Debian packages.
"""
import json
import os
import resource
import subprocess
import tempfile

import numpy as np
from aplr import APLRRegressor
from catboost import CatBoostRegressor
from chimeraboost import ChimeraBoostRegressor
from cubist import Cubist
from interpret.glassbox import ExplainableBoostingRegressor
from lightgbm import LGBMRegressor
from pyoperon.sklearn import SymbolicRegressor
from sklearn.ensemble import HistGradientBoostingRegressor, RandomForestRegressor
from sklearn.linear_model import LinearRegression, RidgeCV
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from xgboost import XGBRegressor

WEKA = "/usr/share/java/weka.jar"


class Program:
    """A regressor that is a program of its own: its time includes reading the table and writing the model."""

    clock = resource.RUSAGE_CHILDREN

    def __init__(self):
        self.folder = tempfile.TemporaryDirectory()

    def path(self, name):
        return os.path.join(self.folder.name, name)

    def run(self, *command):
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode:
            raise RuntimeError((done.stderr.strip().splitlines() or [f"exit {done.returncode}"])[-1])
        return done.stdout


class Llmt(Program):
    program = "llmt"

    def __init__(self, seed, *options):
        super().__init__()
        self.options = ["--seed", str(seed + 1), *options]  # 1 is the default

    def write(self, name, x, y=None):
        columns = [f"x{j}" for j in range(x.shape[1])] + ([] if y is None else ["y"])
        np.savetxt(self.path(name), x if y is None else np.column_stack([x, y]), "%.17g", ",",
                   header=",".join(columns), comments="")
        return self.path(name)

    def fit(self, x, y):
        summary = json.loads(self.run(self.program, "fit", self.write("train.csv", x, y), "--target", "y", "--threads",
                                      "1", "--json", "-o", self.path("model.json"), *self.options))
        if "partitions" in summary:
            self.leaves = summary["partitions"][0]["leaves"]

    def predict(self, x):
        answer = self.run(self.program, "predict", self.path("model.json"), self.write("test.csv", x))
        column = answer[:answer.index("\n")].split(",").index("y_pred")
        return np.loadtxt(answer.splitlines(), delimiter=",", skiprows=1, usecols=column)


class M5P(Program):
    def write(self, name, x, y):
        columns = [f"x{j}" for j in range(x.shape[1])] + ["y"]
        header = "\n".join(["@relation table", *(f"@attribute {column} numeric" for column in columns), "@data"])
        np.savetxt(self.path(name), np.column_stack([x, y]), "%.17g", ",", header=header, comments="")
        return self.path(name)

    def run(self, *arguments):
        return super().run("java", "-Xmx4g", "-XX:+UseSerialGC", "-XX:ActiveProcessorCount=1", "-cp", WEKA,
                           "weka.classifiers.trees.M5P", *arguments)

    def fit(self, x, y):
        self.run("-t", self.write("train.arff", x, y), "-d", self.path("model"), "-no-cv", "-v")

    def predict(self, x):
        # Lines "row actual predicted error", the actual value unknown; three decimals.
        self.write("test.arff", x, np.zeros(len(x)))
        lines = self.run("-T", self.path("test.arff"), "-l", self.path("model"), "-p", "0").splitlines()
        rows = [line.split() for line in lines]
        return np.array([float(row[2]) for row in rows if len(row) == 4 and row[0].isdigit()])


REGRESSORS = {
    "llmt": (None, Llmt),
    "llmt (boost)": (None, lambda seed: Llmt(seed, "--boost")),
    "llmt (teach)": (None, lambda seed: Llmt(seed, "--teach")),
    "llmt (crisp)": (None, lambda seed: Llmt(seed, "--validity", "crisp")),
    "ChimeraBoost": ("chimeraboost", lambda seed: ChimeraBoostRegressor(thread_count=1, random_state=seed)),
    "CatBoost": ("catboost", lambda seed: CatBoostRegressor(
        thread_count=1, random_seed=seed, verbose=0, allow_writing_files=False)),
    "LightGBM": ("lightgbm", lambda seed: LGBMRegressor(n_jobs=1, random_state=seed, verbose=-1)),
    "LightGBM (300 rounds)": ("lightgbm", lambda seed: LGBMRegressor(
        n_jobs=1, random_state=seed, verbose=-1, n_estimators=300)),
    "LightGBM (linear_tree)": ("lightgbm", lambda seed: LGBMRegressor(
        n_jobs=1, random_state=seed, verbose=-1, linear_tree=True)),
    "XGBoost": ("xgboost", lambda seed: XGBRegressor(n_jobs=1, random_state=seed)),
    "XGBoost (300 rounds, rate 0.1)": ("xgboost", lambda seed: XGBRegressor(
        n_jobs=1, random_state=seed, n_estimators=300, learning_rate=0.1)),
    "HistGradientBoosting": ("scikit-learn", lambda seed: HistGradientBoostingRegressor(random_state=seed)),
    "HistGradientBoosting (300 rounds)": ("scikit-learn", lambda seed: HistGradientBoostingRegressor(
        random_state=seed, max_iter=300, early_stopping=False)),
    "EBM": ("interpret-core", lambda seed: ExplainableBoostingRegressor(n_jobs=1, random_state=seed)),
    "APLR": ("aplr", lambda seed: APLRRegressor(n_jobs=1, random_state=seed)),
    "Cubist": ("cubist", lambda seed: Cubist(random_state=seed)),
    "Cubist (20 committees, 5 neighbours)": ("cubist", lambda seed: Cubist(
        random_state=seed, n_committees=20, neighbors=5)),
    "pyoperon": ("pyoperon", lambda seed: SymbolicRegressor(n_threads=1, random_state=seed)),
    "random forest": ("scikit-learn", lambda seed: RandomForestRegressor(n_jobs=1, random_state=seed)),
    "ridge": ("scikit-learn", lambda seed: make_pipeline(StandardScaler(), RidgeCV())),
    "least squares": ("scikit-learn", lambda seed: LinearRegression()),
    "M5P": (None, lambda seed: M5P()),
}
# Fits or predictions that can take minutes, the program that pip does not install, and what folds.py compares.
ONLY_WHEN_NAMED = ["llmt (teach)", "EBM", "APLR", "Cubist (20 committees, 5 neighbours)", "pyoperon", "M5P",
                   "random forest", "ridge"]
