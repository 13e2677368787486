"""Sizes and times of the exports of a model, and how far they are from `llmt predict`.

    PYTHONPATH=apps/python python bench/python/exports.py MODEL.json TABLE.csv [LLMT]

The inputs of the model are numbers. LLMT is the program, by default `llmt`. Engines that are not installed are left
out. Every export predicts all rows of the table. Times are CPU times of one thread.
"""

import csv
import importlib
import json
import sqlite3
import subprocess
import sys
import tempfile
import time

import numpy as np

from llmt.export import to_latex, to_onnx, to_python, to_sql, to_sympy


def expected(program, model_path, table, output):
    with tempfile.NamedTemporaryFile(suffix=".csv") as file:
        command = [program, "predict", model_path, table, "-o", file.name]
        subprocess.run(command, check=True, capture_output=True)
        with open(file.name, newline="", encoding="utf-8") as rows:
            return np.array([float(row[output + "_pred"]) for row in csv.DictReader(rows)])


def by_python(source, x):
    space = {}
    exec(source, space)
    return lambda: np.array([space["predict"](row) for row in x.tolist()])


def by_sql(connection, model, statement, x):
    columns = ", ".join('"' + column["name"].replace('"', '""') + '" DOUBLE PRECISION' for column in model["inputs"])
    connection.execute(f"CREATE TABLE t (id INTEGER, {columns})")
    connection.execute("BEGIN TRANSACTION")
    marks = ", ".join("?" * (1 + x.shape[1]))
    connection.executemany(f"INSERT INTO t VALUES ({marks})", [[i, *row] for i, row in enumerate(x.tolist())])
    connection.execute("COMMIT")
    return lambda: np.array([row[1] for row in connection.execute(statement + " ORDER BY 1").fetchall()])


def by_duckdb(model, statement, x):
    import duckdb

    connection = duckdb.connect()
    connection.execute("SET threads = 1")
    return by_sql(connection, model, statement, x)


def by_onnx(proto, x):
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = 1
    session = onnxruntime.InferenceSession(proto, options)
    parts = [x[begin : begin + 1000] for begin in range(0, len(x), 1000)]
    return lambda: np.concatenate([session.run(None, {"X": part})[0][:, 0] for part in parts])


def report(name, make, engine, answers):
    begin = time.process_time()
    try:
        made = make()
        seconds = time.process_time() - begin
        line = f"| {name} | {len(made) / 1000:.1f} kB | {seconds:.2f} s |"
        if engine is None:
            print(line + " | |")
            return
        predict = engine(made)
        begin = time.process_time()
        predicted = predict()
        seconds = time.process_time() - begin
    except ImportError:
        return
    error = np.max(np.abs(predicted - answers) / np.abs(answers))
    print(f"{line} {1e6 * seconds / len(answers):.0f} us | {error:.1e} |", flush=True)


def import_engines():
    """Before the clock runs."""
    for name in ("onnx.checker", "onnxruntime", "sympy", "duckdb"):
        try:
            importlib.import_module(name)
        except ImportError:
            print(f"{name.partition('.')[0]} is not installed", file=sys.stderr)


def main(model_path, table, program="llmt"):
    with open(model_path, encoding="utf-8") as file:
        text = file.read()
    model = json.loads(text)
    answers = expected(program, model_path, table, model["outputs"][0]["name"])
    with open(table, newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    x = np.array([[float(row[column["name"]]) for column in model["inputs"]] for row in rows])
    import_engines()
    leaves = (len(model["partitions"][0]["nodes"]) + 1) // 2
    kind = model["partitions"][0]["validity"]["kind"]
    print(f"{kind}, {leaves} leaves, {len(model['regressors'])} regressors, {len(x)} rows")
    print("| export | size | CPU to make | CPU per row | largest relative difference |")
    print("| --- | --- | --- | --- | --- |")
    report("Python", lambda: to_python(model), lambda made: by_python(made, x), answers)
    report(
        "SQL, sqlite",
        lambda: to_sql(model, "t", "sqlite", keep=["id"]),
        lambda made: by_sql(sqlite3.connect(":memory:", isolation_level=None), model, made, x),
        answers,
    )
    report(
        "SQL, duckdb",
        lambda: to_sql(model, "t", "duckdb", keep=["id"]),
        lambda made: by_duckdb(model, made, x),
        answers,
    )
    report("ONNX", lambda: to_onnx(model).SerializeToString(), lambda made: by_onnx(made, x), answers)
    report("sympy", lambda: str(to_sympy(model)), None, answers)
    report("LaTeX", lambda: to_latex(model), None, answers)


if __name__ == "__main__":
    main(*sys.argv[1:])
