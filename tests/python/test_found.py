"""What was found, applied to other rows and as code; a simulation with derivatives of its own."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import llmt

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("LLMT_PROGRAM", str(ROOT / "build" / "release" / "bin" / "llmt"))


def cart(parameters, inputs):
    """Force of a cart whose mass is the square of a parameter: what is not linear needs several steps."""
    return parameters["root"] ** 2 * inputs["a"] + parameters["damping"] * inputs["v"]


def derivatives(parameters, inputs):
    return {"root": 2.0 * parameters["root"] * inputs["a"], "damping": inputs["v"]}


def drag(inputs):
    return 1.5 * inputs["v"] * np.abs(inputs["v"])


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(3)
    inputs = {"v": rng.uniform(-1.5, 1.5, 400), "a": rng.uniform(-4, 4, 400)}
    force = cart({"root": np.sqrt(3.5), "damping": 1.4}, inputs) + drag(inputs)
    return inputs, {"force": force + 0.05 * rng.normal(size=400)}


NOMINAL = {"root": np.sqrt(3.0), "damping": llmt.Parameter(1.0, unit="N s/m")}


@pytest.fixture(scope="module")
def found(table):
    return llmt.discover(cart, NOMINAL, *table, jacobian=derivatives)


def test_derivatives_of_ones_own_lead_to_the_same_end(found, table):
    assert found.verdict == "named" and [e["name"] for e in found.to_dict()["effects"]] == ["signed_square"]
    table_of = {row[0]: row for row in found.parameters[["name", "value", "standard_error", "changed"]].values}
    assert abs(table_of["root"][1] - np.sqrt(3.5)) < 4 * table_of["root"][2] and table_of["root"][3]
    assert abs(table_of["damping"][1] - 1.4) < 4 * table_of["damping"][2]
    other = llmt.discover(cart, NOMINAL, *table)
    np.testing.assert_allclose(found.corrected, other.corrected, atol=2e-3)
    np.testing.assert_allclose(found.predict(table[0]), found.corrected[:, 0], atol=2e-3)
    as_array = llmt.discover(
        cart, NOMINAL, *table, jacobian=lambda p, x: np.stack(list(derivatives(p, x).values()), axis=1)
    )
    assert as_array.to_dict() == found.to_dict()


def test_parameters_alone_are_the_verdict(table):
    inputs, measured = table
    alone = llmt.discover(cart, NOMINAL, inputs, {"force": measured["force"] - drag(inputs)})
    assert alone.verdict == "parameters only" and "root and damping are off their nominal values" in alone.summary


@pytest.mark.parametrize(
    "jacobian, error, part",
    [
        ("much", TypeError, "jacobian is 'much'"),
        (lambda p, x: {"root": x["a"]}, ValueError, "jacobian returned no 'damping'"),
        (lambda p, x: np.zeros((400, 3)), ValueError, "400 x 1 x 2"),
        (lambda p, x: np.full((400, 2), np.nan), ValueError, "not finite"),
        (lambda p, x: 1 / 0, ZeroDivisionError, "division"),
    ],
)
def test_mistakes_of_derivatives_are_named(table, jacobian, error, part):
    with pytest.raises(error, match=part):
        llmt.discover(cart, NOMINAL, *table, jacobian=jacobian)


def test_terms_serve_other_rows_without_the_simulation(found, tmp_path):
    rng = np.random.default_rng(9)
    elsewhere = {"a": rng.uniform(-4, 4, 50), "v": rng.uniform(-1.5, 1.5, 50)}
    values = {row[0]: row[1] for row in found.parameters[["name", "value"]].values}
    simulated = cart(values, elsewhere)
    path = tmp_path / "found.json"
    path.write_text(json.dumps(found.to_dict()))
    again = llmt.load_found(path)
    assert again.inputs == ["v", "a"] and again.outputs == ["force"] and again.parameters == ["root", "damping"]
    expected = found.predict(elsewhere)
    np.testing.assert_allclose(again.correct(elsewhere, simulated, parameters_are_set=True), expected, rtol=1e-12)
    np.testing.assert_allclose(found.correct(elsewhere, simulated, parameters_are_set=True), expected, rtol=1e-12)
    nominal = {"root": np.sqrt(3.0), "damping": 1.0}
    by = derivatives(values, elsewhere)
    linear = again.correct(elsewhere, {"force": cart(nominal, elsewhere)}, derivatives=by)
    np.testing.assert_allclose(linear, expected, atol=0.1)
    with pytest.raises(ValueError, match="the parameter 'root' changes"):
        again.correct(elsewhere, simulated)
    with pytest.raises(ValueError, match="no column 'v'"):
        again.correct({"a": [1.0]}, [1.0], parameters_are_set=True)
    scope = {}
    exec(again.code("python"), scope)
    added = scope["correction"](elsewhere["v"], elsewhere["a"])
    np.testing.assert_allclose(simulated + added, expected, rtol=1e-12)
    assert scope["correction"](1.0, 0.0) == pytest.approx(found.effects["value"][0], rel=1e-12)
    assert "double correction(double v, double a)" in found.code("c")


def test_the_program_writes_what_python_reads(table, tmp_path):
    inputs, measured = table
    rows = np.column_stack([inputs["v"], inputs["a"], cart({"root": np.sqrt(3.5), "damping": 1.4}, inputs)])
    head = dict(delimiter=",", header="v,a,force", comments="", fmt="%.17g")
    np.savetxt(tmp_path / "s.csv", rows, **head)
    np.savetxt(tmp_path / "m.csv", np.column_stack([rows[:, :2], measured["force"]]), **head)
    command = [PROGRAM, "discover", "s.csv", "m.csv", "-t", "force", "-o", "c.csv", "--code", "c.py", "--json"]
    made = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True).stdout
    corrected = np.genfromtxt(tmp_path / "c.csv", delimiter=",", names=True)["force_corrected"]
    again = llmt.load_found(made)
    np.testing.assert_allclose(again.correct(inputs, rows[:, 2]), corrected, rtol=1e-12)
    scope = {}
    exec((tmp_path / "c.py").read_text(), scope)
    np.testing.assert_allclose(rows[:, 2] + scope["correction"](inputs["v"], inputs["a"]), corrected, rtol=1e-12)


def test_what_is_no_result_is_refused(found):
    with pytest.raises(ValueError, match="this is no JSON"):
        llmt.load_found("{inputs")
    with pytest.raises(ValueError, match="is not what llmt discover"):
        llmt.load_found({"inputs": 3})
    evil = found.to_dict()
    evil["inputs"][0]["word"] = "v): import os #"
    with pytest.raises(ValueError, match="must be \"v\""):
        llmt.load_found(evil)
    with pytest.raises(ValueError, match="language is 'java'"):
        found.code("java")


def test_a_delay_is_applied_to_other_runs_by_their_times():
    def log(seed, delay=0.012):
        """A mass on a spring, whose measured force is late by the delay."""
        rng = np.random.default_rng(seed)
        time = 0.02 * np.arange(800)
        omega, size = 2 * np.pi * np.array([0.1, 0.25, 0.4, 0.55, 0.7]), 0.3 / np.arange(1, 6)
        phases = rng.uniform(0, 6, 5)

        def motion(t):
            angle = np.outer(t, omega) + phases
            return {
                "q": np.sin(angle) @ size,
                "dq": np.cos(angle) @ (size * omega),
                "ddq": -np.sin(angle) @ (size * omega**2),
            }

        def force(x):
            return 40 * x["q"] + x["dq"] + 3 * x["ddq"]

        return time, motion(time), force(motion(time)), force(motion(time - delay)) + 0.02 * rng.normal(size=800)

    time, inputs, simulated, measured = log(1)
    found = llmt.find_missing(inputs, simulated, measured, time=time)
    assert [effect["name"] for effect in found.to_dict()["effects"]] == ["delay"]
    np.testing.assert_allclose(found.correct(inputs, simulated, time=time), found.corrected[:, 0], atol=1e-9)
    time, inputs, simulated, measured = log(2)
    left = measured - found.correct(inputs, simulated, time=time)
    assert np.std(left) < 0.4 * np.std(measured - simulated)
    with pytest.raises(ValueError, match="depends on when the rows were taken, which is not given"):
        found.correct(inputs, simulated)
    with pytest.raises(ValueError, match=r"correct\(inputs, simulated, time=...\) has it"):
        found.predict(inputs, simulated)
