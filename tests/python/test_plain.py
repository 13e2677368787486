"""A readable tree as plain C, Python and SQL says what predict says."""

import ctypes
import math
import shutil
import sqlite3
import subprocess

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor

NAMES = ["flow, l/min", "if", "colour", "size"]
COLOURS = ["red", "gr\"een", "it's"]


def rows_of(count, seed):
    random = np.random.default_rng(seed)
    flow, x = random.uniform(50, 90, count), random.uniform(-2, 1, count)
    colour = np.array(COLOURS, dtype=object)[np.arange(count) % 3]
    size = random.integers(0, 4, count).astype(float)
    bent = np.where(colour == COLOURS[1], 30 + (flow - 70) * x, np.abs(flow - 70) + 4 * x) + np.array([0, 9, -4, 2])[size.astype(int)]
    return {"flow, l/min": flow, "if": x, "colour": colour, "size": size}, bent + 0.1 * random.normal(size=count)


@pytest.fixture(scope="module", params=["trees", "one rule"])
def fitted(request):
    pandas = pytest.importorskip("pandas")
    table, y = rows_of(400, 1)
    if request.param == "one rule":
        y = 3 + 0.5 * table["flow, l/min"] + table["if"] * (table["flow, l/min"] - 70) + np.where(table["colour"] == "red", 5, 0)
    frame = pandas.DataFrame(table)
    model = LocalLinearTreeRegressor(readable=0.02, cv=3).fit(frame, y)
    asked, _ = rows_of(60, 2)
    asked = pandas.DataFrame(asked)
    asked.loc[::7, "flow, l/min"] = math.nan
    asked.loc[::11, "if"] = math.nan
    asked.loc[::5, "colour"] = "puce"
    asked.loc[::13, "colour"] = None
    asked.loc[::17, "size"] = math.nan
    asked.loc[3::9, "flow, l/min"] *= 3
    asked.loc[4::9, "if"] += 1.05
    asked.loc[5::9, "if"] -= 40
    return model, asked, model.predict(asked)


def test_python(fitted):
    model, asked, expected = fitted
    space = {}
    source = model.to_plain("python", "my")
    assert "if colour" in source or "one rule" or len(model.rules_) == 1
    assert "[" not in source.split("def my_y")[1]  # no arrays
    exec(source, space)  # noqa: S102
    function = space["my_y"]
    order = [NAMES[k] for k in range(4) if used(function)[k]]
    found = [function(*(None if isinstance(v, float) and math.isnan(v) else v for v in row)) for row in asked[order].values.tolist()]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def used(function):
    arguments = function.__code__.co_varnames[: function.__code__.co_argcount]
    return [any(a in (name, f"x{name}", "flow_l_min" if k == 0 else "") for a in arguments) for k, name in enumerate(NAMES)]


def test_c(fitted, tmp_path):
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    model, asked, expected = fitted
    source = model.to_plain("c", "my")
    (tmp_path / "my.c").write_text(source)
    subprocess.run(
        ["cc", "-std=c99", "-Wall", "-Wextra", "-Werror", "-shared", "-fPIC", "-o", tmp_path / "my.so", tmp_path / "my.c", "-lm"],
        check=True,
    )
    space = {}
    exec(model.to_plain("python", "my"), space)  # noqa: S102
    order = [k for k in range(4) if used(space["my_y"])[k]]
    function = ctypes.CDLL(str(tmp_path / "my.so")).my_y
    function.restype = ctypes.c_double
    function.argtypes = [ctypes.c_char_p if NAMES[k] == "colour" else ctypes.c_double for k in order]

    def as_c(k, value):
        if NAMES[k] == "colour":
            return None if value is None or value != value else value.encode()
        return float(value)

    found = [function(*(as_c(k, row[k]) for k in order)) for row in asked[NAMES].values.tolist()]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_sql(fitted):
    model, asked, expected = fitted
    base = sqlite3.connect(":memory:")
    base.execute('CREATE TABLE "my ""t" ("flow, l/min" REAL, "if" REAL, colour TEXT, size REAL)')
    base.executemany(
        'INSERT INTO "my ""t" VALUES (?, ?, ?, ?)',
        [[None if v is None or v != v else v for v in row] for row in asked[NAMES].values.tolist()],
    )
    found = [row[-1] for row in base.execute(model.to_plain("sql", 'my "t'))]
    np.testing.assert_allclose(found, expected, rtol=1e-9)


def test_what_is_refused(fitted):
    model, _, _ = fitted
    with pytest.raises(ValueError, match="language is 'java'; it must be one of c, python, sql"):
        model.to_plain("java")
    with pytest.raises(ValueError, match="must be an identifier"):
        model.to_plain("c", "1 x")
    table, y = rows_of(200, 3)
    smooth = LocalLinearTreeRegressor(validity="blend", cv=3).fit(np.column_stack([table["flow, l/min"], table["if"]]), y)
    with pytest.raises(ValueError, match="more than its rules"):
        smooth.to_plain()
