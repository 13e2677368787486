"""llmt.discover over simulations in Python, and llmt.find_missing against `llmt discover`."""

import json
import os
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

import llmt

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("LLMT", str(ROOT / "build" / "release" / "bin" / "llmt"))


def plate(parameters, inputs):
    """Temperature of a heated plate: R P (1 - exp(-t / tau)). The real one is cooled by a draught, too."""
    t, power = np.asarray(inputs["t"]), np.asarray(inputs["power"])
    return parameters["R"] * power * (1.0 - np.exp(-t / parameters["tau"]))


def cooling(inputs):
    return np.asarray(inputs["power"]) * np.sqrt(np.asarray(inputs["draught"]))


@pytest.fixture(scope="module")
def table():
    rng = np.random.default_rng(1)
    inputs = {"t": rng.uniform(0, 600, 120), "power": rng.uniform(10, 50, 120), "draught": rng.uniform(0, 2, 120)}
    truth = plate({"R": 0.82, "tau": 140.0}, inputs) - 0.03 * cooling(inputs)
    return inputs, {"T": truth + 0.1 * rng.normal(size=120)}


@pytest.fixture(scope="module")
def found(table):
    parameters = {"R": llmt.Parameter(1.0, scale=0.1, unit="K/W"), "tau": llmt.Parameter(100.0, unit="s")}
    return llmt.discover(plate, parameters, *table, terms={"cooling": ("power sqrt(draught)", cooling)})


def test_the_term_and_the_parameters_are_found(found):
    assert found.verdict == "named"
    values = {name: (value, error) for name, value, error in found.effects[["name", "value", "standard_error"]].values}
    assert list(values) == ["cooling"]
    assert abs(values["cooling"][0] + 0.03) < 3.0 * values["cooling"][1] < 0.01
    for parameter, truth in zip(found.to_dict()["simulation"], (0.82, 140.0), strict=True):
        assert abs(parameter["value"] - truth) < 3.0 * parameter["std_error"]
    assert found.gap["after"] < 0.5 * found.gap["before"]
    assert found.summary == "VERDICT: one term is missing: cooling" and "plate against measured" in str(found)


def test_prediction_is_simulation_and_terms(found, table):
    values = {entry["name"]: entry["value"] for entry in found.to_dict()["simulation"]}
    coefficient = found.effects.value[0]
    elsewhere = {"draught": [1.5, 0.2], "t": [300.0, 20.0], "power": [40.0, 15.0]}
    expected = plate(values, elsewhere) + coefficient * cooling(elsewhere)
    np.testing.assert_allclose(found.predict(elsewhere), expected, rtol=1e-12)
    np.testing.assert_allclose(found.predict(table[0]), found.corrected[:, 0], rtol=1e-12)
    copy = pickle.loads(pickle.dumps(found))
    assert copy.predict(elsewhere).tolist() == found.predict(elsewhere).tolist()


@pytest.mark.parametrize("kind", ["pandas", "polars", "array"])
def test_the_callable_gets_the_kind_of_table_that_was_given(found, table, kind):
    inputs, measured = table
    if kind == "array":
        given, outputs = np.column_stack(list(inputs.values())), measured["T"]
        kinds = np.ndarray

        def simulate(p, x):
            assert isinstance(x, np.ndarray) and isinstance(p, np.ndarray)
            return plate({"R": p[0], "tau": p[1]}, {"t": x[:, 0], "power": x[:, 1]})

        parameters = [llmt.Parameter(1.0, scale=0.1), 100.0]
        terms = {"cooling": lambda x: x[:, 1] * np.sqrt(x[:, 2])}
    else:
        frames = pytest.importorskip(kind)
        given, outputs, kinds = frames.DataFrame(inputs), frames.DataFrame(measured), frames.DataFrame

        def simulate(p, x):
            assert isinstance(x, kinds)
            return plate(p, x)

        parameters = {"R": llmt.Parameter(1.0, scale=0.1), "tau": 100.0}
        terms = {"cooling": cooling}
    other = llmt.discover(simulate, parameters, given, outputs, terms=terms)
    assert list(other.effects.value) == list(found.effects.value)
    assert other.predict(given).tolist() == found.predict(inputs).tolist()


def csv_of(columns):
    rows = zip(*(np.asarray(values).tolist() for values in columns.values()), strict=True)
    return "\n".join([",".join(columns), *(",".join(map(repr, row)) for row in rows)]) + "\n"


@pytest.mark.parametrize("allow", [(), ("offset", "scale")])
def test_find_missing_is_that_of_the_command(tmp_path, allow):
    if not os.path.exists(PROGRAM):
        pytest.skip("llmt is not built; LLMT names it")
    rng = np.random.default_rng(2)
    inputs = {"load": rng.uniform(0, 10, 150), "speed": rng.uniform(-2, 2, 150)}
    simulated = {"power": 5.0 + 0.8 * inputs["load"] * inputs["speed"]}
    measured = {"power": simulated["power"] + 0.3 * (inputs["load"] > 6.5) + 0.04 * rng.normal(size=150)}
    result = llmt.find_missing(inputs, simulated, measured, allow=allow)
    (tmp_path / "simulated.csv").write_text(csv_of({**inputs, **simulated}))
    (tmp_path / "measured.csv").write_text(csv_of({**inputs, **measured}))
    line = [PROGRAM, "discover", "simulated.csv", "measured.csv", "--target", "power"]
    if allow:
        line += ["--allow", ",".join(allow)]
    done = subprocess.run([*line, "--json"], capture_output=True, text=True, cwd=tmp_path, check=True)
    assert result.to_dict() == json.loads(done.stdout)
    page = subprocess.run(line, capture_output=True, text=True, cwd=tmp_path, check=True).stdout
    assert str(result) == page.replace(".csv", "")
    assert [term["name"] for term in result.to_dict()["effects"]] == ["step"]
    again = result.predict(inputs, simulated)
    np.testing.assert_allclose(again, result.corrected[:, 0], rtol=1e-12)


def test_several_outputs_have_their_own_terms():
    rng = np.random.default_rng(3)
    x = rng.uniform(-2, 2, (160, 2))
    simulated = np.column_stack([3.0 + x.sum(axis=1), x[:, 1]])
    measured = simulated + np.column_stack([0.4 * x[:, 0] ** 2, np.zeros(160)]) + 0.02 * rng.normal(size=(160, 2))
    result = llmt.find_missing(x, simulated, measured)
    assert [(term["name"], term["output"]) for term in result.to_dict()["effects"]] == [("square", "y0")]
    assert result.predict(x, simulated).shape == (160, 2)


def test_a_result_has_a_picture_and_a_page(found):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    axes = found.plot()
    assert len(axes.lines[0].get_xdata()) == len(found.held_out) == found.gap["heldout_samples"]
    labels = [text.get_text() for text in axes.get_legend().get_texts()]
    assert labels == [
        f"parameters alone, root mean square {found.gap['before']:.3g}",
        f"with terms, root mean square {found.gap['after']:.3g}",
    ]
    assert "VERDICT" in found._repr_html_() and "power sqrt(draught)" in found._repr_html_()


def fails(parameters, inputs):
    raise ZeroDivisionError("my own")


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"simulate": fails}, ZeroDivisionError, "my own"),
        ({"simulate": lambda p, x: np.ones(3)}, ValueError, "simulate returned the shape"),
        ({"simulate": lambda p, x: np.full(len(x["t"]), np.nan)}, ValueError, "not finite, in row 0"),
        ({"simulate": lambda p, x: {"U": x["t"]}}, ValueError, "no column 'T'"),
        ({"simulate": 3}, TypeError, "callable"),
        ({"parameters": {"R": "much", "tau": 1.0}}, TypeError, "R"),
        ({"terms": {"linear": cooling}}, ValueError, "linear"),
        ({"terms": {"mine": 4.0}}, TypeError, "mine"),
        ({"terms": {"mine": lambda x: np.ones(2)}}, ValueError, "term mine"),
        ({"order": "when"}, ValueError, "when"),
        ({"held_out": 0.95}, ValueError, "held_out"),
        ({"measured": {"T": np.ones(3)}}, ValueError, "120 rows, measured has 3"),
    ],
)
def test_what_is_wrong_is_named(table, arguments, error, words):
    given = {"simulate": plate, "parameters": {"R": 1.0, "tau": 100.0}, "inputs": table[0], "measured": table[1]}
    with pytest.raises(error, match=words):
        llmt.discover(**{**given, **arguments})


@pytest.mark.parametrize(
    ("value", "words"),
    [(np.nan, "inputs, row 4: column 't'"), ("often", "inputs, row 4: column 't'"), (None, "inputs, row 4")],
)
def test_cells_that_are_no_numbers_are_named(table, value, words):
    inputs = {name: list(values) for name, values in table[0].items()}
    inputs["t"][4] = value
    with pytest.raises(ValueError, match=words):
        llmt.discover(plate, {"R": 1.0, "tau": 100.0}, inputs, table[1])


def test_progress_may_stop_the_work(table):
    def stop(done, total, step):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        llmt.discover(plate, {"R": 1.0, "tau": 100.0}, *table, progress=stop)


def log_of_a_mass(n=1000, rho=0.9):
    """Three sines, drag that the simulation lacks, and noise that is alike in neighbouring rows."""
    t = 0.02 * np.arange(n)
    dq = np.cos(t) + 1.15 * np.cos(2.3 * t + 1.0) + 0.93 * np.cos(3.1 * t)
    ddq = np.gradient(dq, t)
    random = np.random.default_rng(1)
    noise = np.zeros(n)
    for i in range(1, n):
        noise[i] = rho * noise[i - 1] + 0.1 * random.normal()
    inputs = {"dq": dq, "ddq": ddq}
    return t, inputs, {"force": 3.0 * ddq}, {"force": 3.0 * ddq + 1.5 * dq * np.abs(dq) + noise}


def test_rows_of_a_log_are_told_by_their_time():
    t, inputs, simulated, measured = log_of_a_mass()
    groups = ["a"] * 200 + ["b"] * 200 + ["c"] * 200 + ["d"] * 200 + ["e"] * 200
    found = llmt.find_missing(inputs, simulated, measured, time=t, groups=groups)
    assert [effect["name"] for effect in found.to_dict()["effects"]] == ["signed_square"]
    assert found.to_dict()["time"]["independent_share"] < 0.9
    assert len(found.held_out) == 200 and len({groups[row] for row in found.held_out}) == 1
    only = llmt.find_missing(inputs, simulated, measured, time=t, only="cube")
    assert {effect["name"] for effect in only.to_dict()["effects"]} <= {"cube"}
    for wrong, word in (
        ({"groups": groups}, "groups needs time"),
        ({"time": t[:3]}, "time has the shape"),
        ({"time": t, "groups": groups[:2]}, "groups has the shape"),
        ({"time": t, "order": "dq"}, "order is not needed"),
        ({"without": "cubes"}, 'no family "cubes"'),
    ):
        with pytest.raises(ValueError, match=word):
            llmt.find_missing(inputs, simulated, measured, **wrong)
