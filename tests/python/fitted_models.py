"""Models of every kind with rows to ask them and what `llmt predict` answers, for the tests of the exports."""

import csv
import json
import math
import os
import shutil
import subprocess
from dataclasses import dataclass

import numpy as np
import pytest
from study import sampled

from llmt.export import to_python

PROGRAM = os.environ.get("LLMT_PROGRAM") or shutil.which("llmt")

LABELS = ["red", "it's", 'say "hi"', "a,b; c", "grün", "back\\slash", "雪 ❄", "x_y%$&#{}~^"]
NUMBERS = ["a", 'width "w", mm', "größe", "c_1"]  # names of numeric inputs; the names of outputs are below


@dataclass
class Fitted:
    """A model, rows of it (None: missing) and their predictions."""

    name: str
    model: dict
    path: str
    rows: list  # in the order of the model's inputs: numbers, labels, None
    predicted: np.ndarray  # rows x outputs
    kinds: list  # "training", "far", "missing", "unknown", "threshold"

    def of(self, *kinds):
        return [i for i, kind in enumerate(self.kinds) if kind in kinds]


def _table(rows, seed, categories=False, missing=0.0):
    random = np.random.default_rng(seed)
    columns = {
        NUMBERS[0]: random.uniform(0.0, 10.0, rows),
        NUMBERS[1]: 1e3 + 5.0 * random.standard_normal(rows),
        NUMBERS[2]: random.uniform(-1.0, 1.0, rows),
        NUMBERS[3]: random.exponential(0.01, rows),
    }
    a, b, c, d = columns.values()
    y = np.abs(a - 4.0) + 0.3 * (b - 1e3) * (c > 0.1) + 2.0 * c * c + 40.0 * d + 0.1 * random.standard_normal(rows)
    if categories:
        labels = random.choice(LABELS, rows)
        columns["kind, of 'it'"] = labels
        y = y + np.array([LABELS.index(label) % 3 for label in labels]) * (1.0 + a)
    columns = {name: list(values) for name, values in columns.items()}
    if missing:
        for values in columns.values():
            for i in np.flatnonzero(random.uniform(size=rows) < missing):
                values[i] = None
        y = y + 6.0 * np.array([value is None for value in columns["c_1"]])  # a row without a value tells something
    return columns, {"y": y}


def _codes(rows, seed):
    """Two columns of whole numbers whose effects are no straight lines; llmt takes them for codes."""
    random = np.random.default_rng(seed)
    month, side = random.integers(1, 13, rows), random.integers(2, 6, rows)
    x = random.uniform(-1.0, 1.0, (rows, 2))
    y = random.uniform(-3.0, 3.0, 12)[month - 1] + np.array([0.0, 2.0, -1.0, 1.5])[side - 2] * (1.0 + x[:, 0])
    y += np.abs(x[:, 1]) + 0.3 * random.standard_normal(rows)
    return {"month": list(month * 1.0), "side": list(side * 1.0), "x": list(x[:, 0]), "z": list(x[:, 1])}, {"y": y}


def _machines(rows, seed):
    """Numbers that are names, as whole numbers and as text."""
    random = np.random.default_rng(seed)
    machine, x = random.choice([3.0, 7.0, 12.5, 1e6], rows), random.uniform(-1.0, 1.0, rows)
    y = np.where(machine > 5.0, x, -x) + 0.1 * machine % 3.0 + 0.05 * random.standard_normal(rows)
    return {"machine": [f"{number:g}" if number < 1e5 else "1000000" for number in machine], "x": list(x)}, {"y": y}


def _two(rows, seed):
    columns, outputs = _table(rows, seed)
    return columns, {"y": outputs["y"], 'z "2"': np.array(columns["a"]) ** 2 + outputs["y"]}


def _bounded(rows, seed):
    random = np.random.default_rng(seed)
    x, z = random.uniform(-3.0, 3.0, rows), random.uniform(-1.0, 1.0, rows)
    return {"x": list(x), "z": list(z)}, {"share": np.clip(50.0 + 40.0 * x + 10.0 * z, 0.0, 100.0)}


def _planes(rows, seed):
    random = np.random.default_rng(seed)
    x = random.uniform(-1.0, 1.0, (rows, 3))
    return {name: list(x[:, j]) for j, name in enumerate("uvw")}, {
        "y": np.abs(x[:, 0] + x[:, 1]) + np.abs(x[:, 2] - x[:, 0]) + 0.02 * random.standard_normal(rows)
    }


# name: (table, arguments of `llmt fit`)
MODELS = {
    "crisp": (lambda: _table(400, 1), ["--validity", "crisp"]),
    "blend": (lambda: _table(400, 2), ["--validity", "blend"]),
    "readable": (lambda: _table(400, 3), ["--readable"]),
    "readable_words": (lambda: _table(600, 4, categories=True), ["--readable"]),
    "one_leaf": (lambda: _table(100, 5), ["--max-leaves", "1"]),
    "categories": (lambda: _table(600, 6, categories=True), ["--validity", "blend"]),
    "categories_crisp": (lambda: _table(600, 7, categories=True), ["--validity", "crisp"]),
    "missing": (lambda: _table(500, 8, categories=True, missing=0.1), ["--validity", "blend"]),
    "missing_crisp": (lambda: _table(500, 9, missing=0.2), ["--validity", "crisp"]),
    "quadratic": (lambda: _table(300, 10), ["--local-models", "quadratic"]),
    "codes": (lambda: _codes(300, 11), []),
    "monotone": (lambda: _table(300, 12), ["--monotone", "c_1"]),
    "gaussian": (lambda: _table(300, 13), ["--validity", "gaussian"]),
    "gaussian_missing": (lambda: _table(300, 14, missing=0.1), ["--validity", "gaussian"]),
    "hilomot": (lambda: _planes(400, 15), ["--rule", "hilomot", "--max-leaves", "5"]),
    "machines": (lambda: _machines(300, 20), ["--categorical", "machine"]),
    "two_outputs": (lambda: _two(300, 16), ["--validity", "blend"]),
    "two_shared": (lambda: _two(300, 17), ["--shared", "--validity", "crisp"]),
    "m5": (lambda: _table(400, 18), ["--rule", "m5"]),
    "output_range": (lambda: _bounded(300, 19), ["--max-leaves", "4"]),
}


def _write(path, columns):
    with open(path, "w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow(columns)
        for row in zip(*columns.values()):
            writer.writerow(
                "" if value is None else value if isinstance(value, str) else repr(float(value)) for value in row
            )


def _thresholds(model):
    for partition in model["partitions"]:
        for node in partition["nodes"]:
            split = node.get("split", {})
            if "direction" not in split and split.get("threshold", math.inf) < 1e300:
                yield split["column"], split["threshold"], split["half_width"]


def _rows(model, columns, seed):
    """Rows of every kind that may come, in the order of the model's inputs, and the name of each one's kind."""
    random = np.random.default_rng(seed)
    inputs = model["inputs"]
    training = [list(row) for row in zip(*(columns[column["name"]] for column in inputs))][:150]
    rows, kinds = list(training), ["training" if None not in row else "missing" for row in training]

    def add(kind, row):
        rows.append(row)
        kinds.append(kind)

    def drawn():
        return list(training[random.integers(len(training))])

    numbers = [j for j, column in enumerate(inputs) if "levels" not in column]
    words = [j for j, column in enumerate(inputs) if "levels" in column]
    for j in numbers:
        low, high = inputs[j]["low"], inputs[j]["high"]
        for beyond in (-3.0, -1.0, -0.2, -0.03, 1.03, 1.2, 2.0, 4.0):
            row = drawn()
            row[j] = low + beyond * (high - low)
            add("far", row)
    for _ in range(60):
        row = drawn()
        for j in numbers:
            low, high = inputs[j]["low"], inputs[j]["high"]
            row[j] = low + random.uniform(-1.5, 2.5) * (high - low)
        add("far", row)
    for _ in range(60):
        row = drawn()
        for j in range(len(inputs)):
            if random.uniform() < 0.4:
                row[j] = None
        add("missing", row)
    add("missing", [None] * len(inputs))
    for j in words:
        for label in ("never seen", "RED", "its", "0", " red\t "):
            row = drawn()
            row[j] = label
            add("unknown", row)
    for j, column in enumerate(inputs):
        codes = column.get("codes", [])
        for low, high in zip(codes, codes[1:]):
            for value in (0.5 * (low + high), 0.51 * (low + high)):  # of two codes that are equally near, the smaller
                row = drawn()
                row[j] = value
                add("unknown", row)
    for j, threshold, half_width in _thresholds(model):
        exact = [threshold, math.nextafter(threshold, math.inf), math.nextafter(threshold, -math.inf)]
        for value in exact + [threshold - half_width, threshold + half_width, threshold - 0.5 * half_width]:
            row = drawn()
            row[j] = float(value)
            add("threshold", row)
    return rows, kinds


def run(*arguments):
    if PROGRAM is None:
        pytest.skip("there is no program llmt, and LLMT_PROGRAM names none")
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


def predictions(model_path, model, rows, folder):
    columns = {column["name"]: [row[j] for row in rows] for j, column in enumerate(model["inputs"])}
    _write(folder / "rows.csv", columns)
    run("predict", model_path, folder / "rows.csv", "-o", folder / "predicted.csv", "--threads", 1)
    with open(folder / "predicted.csv", newline="", encoding="utf-8") as file:
        table = list(csv.DictReader(file))
    return np.array([[float(row[output["name"] + "_pred"]) for output in model["outputs"]] for row in table])


def fit(name, folder):
    """Fits the model of that name in a folder."""
    make, arguments = MODELS[name]
    columns, outputs = make()
    _write(folder / "table.csv", {**columns, **outputs})
    path = folder / "model.json"
    targets = ",".join('"' + output.replace('"', '""') + '"' if '"' in output else output for output in outputs)
    usual = ["--threads", 1, "--no-intervals", "--cv", sampled(10, 3)]
    run("fit", folder / "table.csv", "-t", targets, "-o", path, *usual, *arguments)
    if "--readable" in arguments:
        path = folder / "model.readable.json"
    model = json.loads(path.read_text(encoding="utf-8"))
    rows, kinds = _rows(model, columns, 1)
    return Fitted(name, model, str(path), rows, predictions(path, model, rows, folder), kinds)


made = {}  # by all files of tests of a process


@pytest.fixture(scope="session")
def fitted(tmp_path_factory):
    """Makes the model of a name once, with its rows and predictions."""

    def get(name):
        if name not in made:
            made[name] = fit(name, tmp_path_factory.mktemp(name))
        return made[name]

    return get


every_model = pytest.mark.parametrize("name", MODELS)


def function_of(model, name="predict"):
    space = {}
    exec(to_python(model, name), space)
    return space[name], space


def assert_same(predicted, expected, relative):
    """Equal but for rounding, which near 0 is that of the terms that cancel: relative to the output's magnitude."""
    scale = np.max(np.abs(expected), axis=0)
    np.testing.assert_array_less(np.abs(predicted - expected), relative * (np.abs(expected) + scale) + 1e-300)


def constants():
    """1.5 up to x = 2, 2.5 above, 0.25 of the first where x is missing: without regressors."""
    leaf = {"samples": 5, "rank": 1, "rss": [0.0], "slope": [[]], "mean": [], "low": [], "high": []}
    split = {
        "input": "x",
        "column": 0,
        "threshold": 2.0,
        "half_width": 0.0,
        "missing_left": 0.25,
        "left": 1,
        "right": 2,
    }
    return {
        "format": "llmt-model",
        "version": 2,
        "inputs": [{"name": "x", "low": 0.0, "high": 4.0, "centre": 2.0}],
        "outputs": [{"name": "y", "low": 1.0, "high": 3.0}],
        "regressors": [],
        "partitions": [
            {
                "outputs": [0],
                "validity": {"kind": "crisp", "width": 0.0, "smoothness": 1},
                "outer_slope": [[]],
                "residual_range": [[-1.0, 1.0]],
                "nodes": [
                    {**leaf, "samples": 10, "value": [2.0], "split": split},
                    {**leaf, "value": [1.5]},
                    {**leaf, "value": [2.5]},
                ],
            }
        ],
    }
