"""Every export in its own engine against `llmt predict`.

The models are fitted by the program that LLMT_PROGRAM names, or by `llmt` of the path. LLMT_POSTGRES, if set, is the
connection string of a PostgreSQL database in which a table may be made; psql asks it.
"""

import copy
import csv
import io
import json
import math
import os
import re
import sqlite3
import subprocess
import sys

import numpy as np
import pytest
from fitted_models import (  # noqa: F401
    MODELS,
    PROGRAM,
    assert_same,
    constants,
    every_model,
    fitted,
    function_of,
    predictions,
)

from llmt.export import to_latex, to_onnx, to_python, to_sql, to_sympy
from llmt.export.model import read


def test_the_models_are_of_every_kind(fitted):
    """What the other tests say of these models would be empty otherwise."""
    kinds = set()
    for name in MODELS:
        model = fitted(name).model
        for partition in model["partitions"]:
            kinds.add(partition["validity"]["kind"])
            kinds.add("output_range" if any(partition.get("output_range", [])) else "")
            kinds.add("no residual_range" if not partition["residual_range"] else "")
            kinds.add(
                "jump in a blend"
                if partition["validity"]["kind"] == "blend"
                and any(node["split"].get("half_width") == 0.0 for node in partition["nodes"] if "split" in node)
                else ""
            )
            for node in partition["nodes"]:
                split = node.get("split", {})
                kinds |= {member for member in ("direction", "level_side") if member in split}
                kinds.add("presence" if split.get("threshold", 0.0) > 1e300 else "")
        kinds |= {"codes" for column in model["inputs"] if "codes" in column}
        kinds |= {"products" for regressor in model["regressors"] if "second_column" in regressor}
        kinds |= {"indicators" for regressor in model["regressors"] if "level" in regressor}
        kinds |= {"several outputs" for _ in model["outputs"][1:]}
    assert kinds - {""} == {
        "crisp",
        "blend",
        "gaussian",
        "logistic",
        "output_range",
        "no residual_range",
        "presence",
        "jump in a blend",
        "direction",
        "level_side",
        "codes",
        "products",
        "indicators",
        "several outputs",
    }


# Python


@every_model
def test_python_has_the_bits_of_predict(fitted, name):
    model = fitted(name)
    predict, _ = function_of(model.model)
    got = np.array([np.atleast_1d(predict(row)) for row in model.rows])
    if any(partition["validity"]["kind"] == "gaussian" for partition in model.model["partitions"]):
        assert_same(got, model.predicted, 1e-14)  # exp() of the C library
    else:
        np.testing.assert_array_equal(got, model.predicted)


def test_python_takes_rows_by_name_and_nan_as_missing(fitted):
    model = fitted("missing")
    predict, _ = function_of(model.model)
    names = [column["name"] for column in model.model["inputs"]]
    for row, expected in zip(model.rows, model.predicted):
        by_name = {name: math.nan if value is None else value for name, value in zip(names, row)}
        assert predict({"another column": 1, **dict(reversed(by_name.items()))}) == expected[0]


def test_python_needs_no_package(fitted, tmp_path):
    source = to_python(fitted("categories").model, "f")
    assert re.findall(r"^\s*(?:import|from)\b.*", source, re.M) == ["import math"]
    (tmp_path / "f.py").write_text(source, encoding="utf-8")
    call = "from f import f; print(repr(f([None] * 5)))"
    done = subprocess.run([sys.executable, "-S", "-c", call], cwd=tmp_path, capture_output=True, text=True, check=True)
    model = fitted("categories")
    assert float(done.stdout) == model.predicted[model.rows.index([None] * 5)][0]


def test_python_refuses_bad_rows_and_names(fitted):
    predict, _ = function_of(fitted("crisp").model)
    with pytest.raises(ValueError, match="'a' is infinite"):
        predict([math.inf, 1.0, 1.0, 1.0])
    with pytest.raises(ValueError, match="3 values, the model has 4"):
        predict([1.0, 1.0, 1.0])
    with pytest.raises(KeyError, match="größe"):
        predict({"a": 1.0, 'width "w", mm': 1.0, "c_1": 1.0})
    for name in ("2f", "a b", ""):
        with pytest.raises(ValueError, match="identifier"):
            to_python(fitted("crisp").model, name)


@pytest.mark.parametrize("name", ["math", "ｍath", "float", "len", "zip", "hasattr", "enumerate", "def", "__debug__"])
def test_python_refuses_names_that_mean_something_else(name):
    with pytest.raises(ValueError, match=f"name is '{name}', which means something else"):
        to_python(constants(), name)


@pytest.mark.parametrize("name", ["RETURNS", "INPUTS", "NAME", "BLANKS", "x", "row", "d", "print", "_", "größe"])
def test_python_takes_every_other_name(name):
    predict, space = function_of(constants(), name)
    assert [predict([2.0]), predict([2.5]), predict([None])] == [1.5, 2.5, 0.25 * 1.5 + 0.75 * 2.5]
    assert predict.__name__ == name
    assert "The prediction of 'y' for one row." in predict.__doc__ and "the order\n    'x'." in predict.__doc__


def test_names_cannot_become_code():
    model = constants()
    model["inputs"][0]["name"] = '"""\\"; raise SystemExit #\n@NAME INPUTS. {0}'
    model["outputs"][0]["name"] = "'''\"\"\"\\"
    predict, _ = function_of(model)
    assert predict([1.0]) == 1.5
    assert predict({model["inputs"][0]["name"]: 3.0}) == 2.5


def test_numbers_are_found_among_labels(fitted):
    model = fitted("machines")
    predict, _ = function_of(model.model)
    table = to_sql(model.model, "t", "sqlite", keep=["id"]), to_sql(model.model, "t", "duckdb", keep=["id"])
    known = [i for i in model.of("training") if model.rows[i][0] is not None]
    rows = [[float(model.rows[i][0]), model.rows[i][1]] for i in known]
    np.testing.assert_array_equal([[predict(row)] for row in rows], model.predicted[known])
    assert predict([3, 0.5]) == predict(["3", 0.5]) == predict([np.float64(3.0), 0.5]) != predict([4.0, 0.5])
    for connection, statement in zip((sqlite3.connect(":memory:"), pytest.importorskip("duckdb").connect()), table):
        connection.execute("CREATE TABLE t (id INTEGER, machine DOUBLE PRECISION, x DOUBLE PRECISION)")
        connection.executemany("INSERT INTO t VALUES (?, ?, ?)", [[i, *row] for i, row in enumerate(rows)])
        got = [row[1:] for row in connection.execute(statement + " ORDER BY 1").fetchall()]
        assert_same(np.array(got), model.predicted[known], 1e-12)


# SQL


def quoted(name):
    return '"' + name.replace('"', '""') + '"'


def columns_of(model, number):
    return ", ".join(
        f"{quoted(column['name'])} {'TEXT' if 'levels' in column else number}" for column in model["inputs"]
    )


def in_sqlite(model, rows, statement, table):
    connection = sqlite3.connect(":memory:")
    connection.execute(f"CREATE TABLE {quoted(table)} (id INTEGER, {columns_of(model, 'REAL')})")
    marks = ", ".join("?" * (1 + len(model["inputs"])))
    connection.executemany(f"INSERT INTO {quoted(table)} VALUES ({marks})", [(i, *row) for i, row in enumerate(rows)])
    return connection.execute(statement + "\nORDER BY 1").fetchall()


def in_duckdb(model, rows, statement, table):
    connection = pytest.importorskip("duckdb").connect()
    connection.execute(f"CREATE TABLE {quoted(table)} (id INTEGER, {columns_of(model, 'DOUBLE')})")
    marks = ", ".join("?" * (1 + len(model["inputs"])))
    connection.executemany(f"INSERT INTO {quoted(table)} VALUES ({marks})", [[i, *row] for i, row in enumerate(rows)])
    return connection.execute(statement + "\nORDER BY 1").fetchall()


def in_postgresql(model, rows, statement, table):
    if "LLMT_POSTGRES" not in os.environ:
        pytest.skip("LLMT_POSTGRES names no database")
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for i, row in enumerate(rows):
        writer.writerow([i] + ["" if v is None else v if isinstance(v, str) else repr(float(v)) for v in row])
    create = f"DROP TABLE IF EXISTS {quoted(table)}; CREATE TABLE {quoted(table)} (id INTEGER, "
    script = create + columns_of(model, "DOUBLE PRECISION") + f");\nCOPY {quoted(table)} FROM STDIN (FORMAT csv);\n"
    script += text.getvalue() + "\\.\nCOPY (" + statement.replace("\n", " ") + " ORDER BY 1) TO STDOUT (FORMAT csv);\n"
    script += f"DROP TABLE {quoted(table)};\n"
    command = ["psql", os.environ["LLMT_POSTGRES"], "-v", "ON_ERROR_STOP=1", "-q", "-f", "-"]
    done = subprocess.run(command, input=script, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return [[float(cell) for cell in line.split(",")] for line in done.stdout.splitlines()]


ENGINES = {"sqlite": in_sqlite, "duckdb": in_duckdb, "postgresql": in_postgresql}
TABLE = 'my "table" 表'


@every_model
@pytest.mark.parametrize("dialect", ENGINES)
def test_sql_predicts(fitted, name, dialect):
    model = fitted(name)
    statement = to_sql(model.model, TABLE, dialect, keep=["id"])
    try:
        rows = ENGINES[dialect](model.model, model.rows, statement, TABLE)
    except sqlite3.OperationalError as error:
        if "no such function: EXP" in str(error):
            pytest.skip("this SQLite has no EXP")
        raise
    assert [row[0] for row in rows] == list(range(len(model.rows)))
    assert_same(np.array([row[1:] for row in rows], dtype=float), model.predicted, 1e-12)


@pytest.mark.parametrize("dialect", ["duckdb", "postgresql"])
def test_sql_takes_nan_as_missing(fitted, dialect):
    model = fitted("missing_crisp")
    rows = [[math.nan if value is None else value for value in row] for row in model.rows]
    got = ENGINES[dialect](model.model, rows, to_sql(model.model, "t", dialect, keep=["id"]), "t")
    assert_same(np.array([row[1:] for row in got]), model.predicted, 1e-12)


def test_sqlite_takes_empty_text_as_missing(fitted):
    """So a table is that was imported from CSV."""
    model = fitted("missing")
    rows = [["" if value is None else value for value in row] for row in model.rows]
    got = in_sqlite(model.model, rows, to_sql(model.model, "t", "sqlite", keep=["id"]), "t")
    assert_same(np.array([row[1:] for row in got]), model.predicted, 1e-12)


def test_sql_names_what_it_gives(fitted):
    model = fitted("two_outputs").model
    connection = sqlite3.connect(":memory:")
    connection.execute(f"CREATE TABLE t (id INTEGER, {columns_of(model, 'REAL')})")
    cursor = connection.execute(to_sql(model, "t", "sqlite", keep=["c_1", "id"]))
    assert [column[0] for column in cursor.description] == ["c_1", "id", "y_pred", 'z "2"_pred']
    assert 'FROM "a b"."c""d" AS t)' in to_sql(model, ("a b", 'c"d'))


@pytest.mark.parametrize("dialect", ["sqlite", "duckdb"])
@pytest.mark.parametrize("table", ["t", "x", "elsewhere"])
def test_sql_refuses_a_table_without_an_input(dialect, table):
    """SQLite takes a quoted name that is no column for a text."""
    connection = sqlite3.connect(":memory:") if dialect == "sqlite" else pytest.importorskip("duckdb").connect()
    connection.execute(f'CREATE TABLE {table} ("x " DOUBLE PRECISION, id INTEGER)')
    connection.execute(f"INSERT INTO {table} VALUES (1.0, 7)")
    for keep in ([], ["id"]):
        with pytest.raises(Exception, match=r"no such column: t\.x|\"x\""):
            connection.execute(to_sql(constants(), table, dialect, keep)).fetchall()
    connection.execute("CREATE TABLE right_one (x DOUBLE PRECISION)")
    connection.execute("INSERT INTO right_one VALUES (1.0)")
    assert connection.execute(to_sql(constants(), "right_one", dialect)).fetchall() == [(1.5,)]
    with pytest.raises(Exception, match="id"):
        connection.execute(to_sql(constants(), "right_one", dialect, ["id"])).fetchall()


# Cells of a table that was imported as text, and what `llmt predict` makes of them: None is a missing value.
NUMBERS_AS_TEXT = {"1": 1.0, " 2.5\t\r": 2.5, "-3e0": -3.0, "+4": 4.0, ".5": 0.5, "5.": 5.0, "1E2": 100.0, "-0": 0.0}
MISSING = ["", " ", "NA", "n/a", "NaN", "nan", "null", " Null\t", "?"]
NO_NUMBERS = ["word", "0x10", "1,5", "inf", "-inf", "1e400", "1e", "1 2", "12abc", "1_0", "--1", ".", "none", "nan(1)"]


@pytest.mark.parametrize("kind", ["TEXT", "REAL", "NUMERIC", "INTEGER", "BLOB", ""])
def test_sqlite_reads_text_as_predict_does(kind, tmp_path):
    model = constants()
    model["partitions"][0]["nodes"][0]["split"]["threshold"] = 2.25
    connection = sqlite3.connect(":memory:")
    connection.execute(f"CREATE TABLE t (id INTEGER, x {kind}, y TEXT)")
    connection.executemany(
        "INSERT INTO t (id, x) VALUES (?, ?)", enumerate([*NUMBERS_AS_TEXT, *MISSING, *NO_NUMBERS, None, b"1"])
    )
    got = [row[1] for row in connection.execute(to_sql(model, "t", "sqlite", ["id"]) + " ORDER BY 1")]
    numbers = [1.5 if number <= 2.25 else 2.5 for number in NUMBERS_AS_TEXT.values()]
    missing = 0.25 * 1.5 + 0.75 * 2.5
    assert got == numbers + [missing] * len(MISSING) + [None] * len(NO_NUMBERS) + [missing, None]


def test_the_cells_above_are_what_predict_says(tmp_path):
    path = tmp_path / "constants.json"
    path.write_text(json.dumps(constants()))

    def predicted(cell):
        (tmp_path / "rows.csv").write_text(f'x,other\n"{cell}",1\n')
        command = [PROGRAM, "predict", str(path), str(tmp_path / "rows.csv")]
        return subprocess.run(command, capture_output=True, text=True)

    if PROGRAM is None:
        pytest.skip("there is no program llmt, and LLMT_PROGRAM names none")
    for cell, number in NUMBERS_AS_TEXT.items():
        assert predicted(cell).stdout.rsplit(",", 4)[1] == ("1.5" if number <= 2.0 else "2.5"), cell
    for cell in MISSING:
        assert predicted(cell).stdout.rsplit(",", 4)[1] == "2.25", cell
    for cell in NO_NUMBERS:
        assert predicted(cell).returncode == 1, cell


def test_sqlite_gives_no_prediction_of_a_row_with_a_cell_that_is_no_number(fitted):
    model = fitted("codes")
    rows = [list(row) for row in model.rows]
    for j in range(len(rows[0])):
        rows[j][j] = "word"
    got = in_sqlite(model.model, rows, to_sql(model.model, "t", "sqlite", keep=["id"]), "t")
    assert [row[1] for row in got[: len(rows[0])]] == [None] * len(rows[0])
    rest = slice(len(rows[0]), None)
    assert_same(np.array([row[1:] for row in got[rest]], dtype=float), model.predicted[rest], 1e-12)


@every_model
def test_sql_is_linear_in_nodes_times_regressors(fitted, name):
    model = fitted(name).model
    size = sum(len(p["nodes"]) * (1 + len(model["regressors"])) * len(p["outputs"]) for p in model["partitions"])
    levels = sum(len(column.get("levels", column.get("codes", []))) for column in model["inputs"])
    assert len(to_sql(model, "t")) < 450 * size + 200 * levels + 2500


def test_sql_refuses(fitted):
    model = fitted("crisp").model
    with pytest.raises(ValueError, match="dialect is 'oracle'"):
        to_sql(model, "t", "oracle")
    with pytest.raises(ValueError, match="NUL"):
        to_sql(model, "t\0")


# ONNX


def in_onnx(model, rows):
    session = pytest.importorskip("onnxruntime").InferenceSession(to_onnx(model).SerializeToString())
    names = [entry.name for entry in session.get_inputs()]
    if any("levels" in column for column in model["inputs"]):
        assert names == [column["name"] for column in model["inputs"]]
        feed = {}
        for j, name in enumerate(names):
            is_text = "levels" in model["inputs"][j]
            cells = [("" if is_text else math.nan) if row[j] is None else row[j] for row in rows]
            cells = [cell.strip() for cell in cells] if is_text else cells  # labels are compared as they are
            feed[name] = np.array(cells, dtype=object if is_text else np.float64).reshape(-1, 1)
    else:
        assert names == ["X"]
        feed = {"X": np.array([[math.nan if value is None else value for value in row] for row in rows])}
    (got,) = session.run(None, feed)
    return got


@every_model
def test_onnx_predicts(fitted, name):
    model = fitted(name)
    assert_same(in_onnx(model.model, model.rows), model.predicted, 1e-12)
    first = in_onnx(model.model, model.rows[:1])
    assert first.shape == (1, len(model.model["outputs"]))
    assert_same(first, model.predicted[:1], 1e-12)


@every_model
def test_onnx_has_only_standard_operators(fitted, name):
    pytest.importorskip("onnx")
    proto = to_onnx(fitted(name).model)
    assert {node.domain for node in proto.graph.node} <= {"", "ai.onnx.ml"}
    assert {(entry.domain, entry.version) for entry in proto.opset_import} == {("", 17), ("ai.onnx.ml", 2)}


def test_onnx_names_do_not_clash(fitted):
    onnx = pytest.importorskip("onnx")
    model = copy.deepcopy(fitted("categories").model)
    for column, name in zip(model["inputs"], ["variable", "variable_", "X", "t0", "c0"]):
        column["name"] = name
    proto = to_onnx(model)
    onnx.checker.check_model(proto, full_check=True)
    assert [entry.name for entry in proto.graph.output] == ["variable__"]
    assert_same(in_onnx(model, fitted("categories").rows), fitted("categories").predicted, 1e-12)


# Models made by hand


@pytest.mark.parametrize("leaves", [1, 2])
def test_a_tree_of_constants(leaves):
    model, rows = constants(), [[1.0], [2.0], [2.5], [None]]
    expected = np.array([[1.5], [1.5], [2.5], [0.25 * 1.5 + 0.75 * 2.5]])
    if leaves == 1:
        del model["partitions"][0]["nodes"][1:], model["partitions"][0]["nodes"][0]["split"]
        expected = np.full((4, 1), 2.0)
    predict, _ = function_of(model)
    np.testing.assert_array_equal([[predict(row)] for row in rows], expected)
    got = in_sqlite(model, rows, to_sql(model, "t", "sqlite", keep=["id"]), "t")
    np.testing.assert_array_equal([row[1:] for row in got], expected)
    np.testing.assert_array_equal(in_onnx(model, rows), expected)
    sympy = pytest.importorskip("sympy")
    assert float(to_sympy(model).subs(sympy.Symbol("x", real=True), 2.5)) == expected[2, 0]


def deep(levels):
    """A chain of splits of x at 0, 1, 2, ...; the range of z narrows at every level."""
    nodes = []
    for level in range(levels + 1):
        node = {
            "samples": 1000 - level, "rank": 3, "rss": [1.0], "value": [0.01 * level],
            "slope": [[0.02, 0.01 * (level % 7)]], "mean": [0.0, 0.0], "low": [-50.0, level - 100.0],
            "high": [50.0, 100.0 - level],
        }  # fmt: skip
        if level > 0:
            nodes.append({**copy.deepcopy(node), "samples": 1})  # the left child is a leaf
        if level < levels:
            left = 2 * level + 1
            node["split"] = {"input": "x", "column": 0, "threshold": float(level), "half_width": 0.0,
                             "missing_left": 0.5, "left": left, "right": left + 1}  # fmt: skip
        nodes.append(node)
    model = constants()
    model["inputs"] = [{"name": "x", "low": 0.0, "high": 100.0, "centre": 50.0},
                       {"name": "z", "low": -100.0, "high": 100.0, "centre": 0.0}]  # fmt: skip
    model["outputs"] = [{"name": "y", "low": -100.0, "high": 100.0}]
    model["regressors"] = [{"column": 0, "centre": 50.0}, {"column": 1, "centre": 0.0}]
    model["partitions"][0].update(nodes=nodes, outer_slope=[[0.0, 0.0]], residual_range=[[-20.0, 20.0]])
    return model


@pytest.mark.parametrize("levels", [60, 90])
def test_deep_trees(tmp_path, levels):
    """Beyond 64 ancestors the slopes of some are left out: Python does so, SQL and ONNX refuse the tree."""
    model = deep(levels)
    (tmp_path / "deep.json").write_text(json.dumps(model))
    rows = [[x + 0.5, z] for x in (0.0, 30.0, levels - 1.0, 95.0) for z in (-120.0, -99.0, -5.0, 30.0, 99.9, 130.0)]
    expected = predictions(tmp_path / "deep.json", model, rows, tmp_path)
    predict, _ = function_of(model)
    np.testing.assert_array_equal([[predict(row)] for row in rows], expected)
    if levels > 65:
        with pytest.raises(ValueError, match="more than 65 splits deep"):
            to_sql(model, "t")
        pytest.importorskip("onnx")
        with pytest.raises(ValueError, match="more than 65 splits deep"):
            to_onnx(model)
    else:
        got = in_sqlite(model, rows, to_sql(model, "t", "sqlite", keep=["id"]), "t")
        assert_same(np.array([row[1:] for row in got]), expected, 1e-12)
        assert_same(in_onnx(model, rows), expected, 1e-12)


@pytest.mark.parametrize("name", ["python", "onnx", "sympy", "latex", "sql"])
def test_what_is_no_model_is_refused(name):
    if name in ("onnx", "sympy"):
        pytest.importorskip(name)
    exports = {"python": to_python, "onnx": to_onnx, "sympy": to_sympy, "latex": to_latex}
    export = exports.get(name, lambda model: to_sql(model, "t"))
    with pytest.raises(ValueError, match="llmt-model"):
        export({"format": "llmt-stream"})
    with pytest.raises(ValueError, match="version 7"):
        export({**constants(), "version": 7})


def test_missing_packages_are_named(monkeypatch):
    for export, package in ((to_onnx, "onnx"), (to_sympy, "sympy")):
        monkeypatch.setitem(sys.modules, package, None)
        with pytest.raises(ImportError, match=f"needs the package {package}: pip install {package}"):
            export(constants())


def test_the_reader_keeps_all_numbers(fitted):
    model = fitted("blend")
    tree = read(model.model)
    for node, data in zip(tree.partitions[0].nodes, model.model["partitions"][0]["nodes"]):
        assert list(node.low) == data["low"] and [list(row) for row in node.slope] == data["slope"]
        assert node.threshold == data.get("split", {}).get("threshold", 0.0)
