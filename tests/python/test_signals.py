"""llmt.signals against `llmt signals`, tables of any kind, and what it refuses."""

import json
import os
import subprocess
from pathlib import Path

import numpy as np
import pytest

import llmt

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("LLMT_PROGRAM", str(ROOT / "build" / "release" / "bin" / "llmt"))


@pytest.fixture(scope="module")
def log():
    rng = np.random.default_rng(1)
    t = np.tile(np.arange(0.0, 5.0, 0.002), 2)
    return {
        "run": np.repeat(["one", "two"], 2500),
        "t": t,
        "q": np.sin(3.0 * t) + 1e-5 * rng.normal(size=5000),
        "u": 2.0 * np.cos(3.0 * t),
        "load": np.repeat([5.0, 8.0], 2500),
    }


OPTIONS = {"time": "t", "position": "q", "torque": "u", "cutoff": 10.0, "group": "run", "keep": "load"}


def test_rows_are_those_of_the_program(log, tmp_path):
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(log)
    frame.to_csv(tmp_path / "log.csv", index=False)
    command = f"{PROGRAM} signals log.csv --time t --position q --torque u --cutoff 10 --group run --keep load --json"
    run = subprocess.run([*command.split(), "-o", "rows.csv"], cwd=tmp_path, capture_output=True, text=True, check=True)
    made = llmt.signals(frame, **OPTIONS)
    rows = pandas.read_csv(tmp_path / "rows.csv")
    pandas.testing.assert_frame_equal(made.table, rows[list(made.table)], check_dtype=False, rtol=1e-12)
    for name, noise in made.noise.items():
        assert (rows["noise_" + name] == noise).all()
    assert (rows["cutoff_hz"] == made.cutoff).all()
    said, program = made.to_dict(), json.loads(run.stdout)
    for key in ("rows", "every", "noise", "noise_in_log", "standstill", "columns"):
        assert said[key] == program[key]
    assert [stretch["first_row"] for stretch in said["runs"]] == [0, 2500]


def test_velocities_are_those_of_the_motion(log):
    made = llmt.signals(log, **OPTIONS)
    table = made.table
    assert list(table) == ["run", "t", "q", "dq", "ddq", "u", "load"]
    assert np.abs(table["dq"] - 3.0 * np.cos(3.0 * table["t"])).max() < 5.0 * made.noise["dq"]
    assert np.std(table["dq"] - 3.0 * np.cos(3.0 * table["t"])) == pytest.approx(made.noise["dq"], rel=0.2)
    assert list(made.inputs) == ["q", "dq", "ddq", "load"] and list(made.torques) == ["u"]
    assert (made.time == table["t"]).all() and (made.groups == table["run"]).all()
    assert "low pass of 10" in str(made) and "noise in the log" in str(made)
    assert (np.asarray(log["run"])[made.rows] == table["run"]).all()


@pytest.mark.parametrize("kind", ["pandas", "polars", "pyarrow"])
def test_a_table_comes_back_as_the_kind_that_was_given(log, kind):
    library = pytest.importorskip(kind)
    given = library.table(log) if kind == "pyarrow" else library.DataFrame(log)
    made = llmt.signals(given, **OPTIONS)
    assert type(made.table) is type(given) and type(made.inputs) is type(given)
    plain = llmt.signals(log, **OPTIONS)
    np.testing.assert_array_equal(np.asarray(made.table["ddq"], dtype=float), plain.table["ddq"])


def test_rows_of_independent_noise_have_no_reversals(log):
    made = llmt.signals(log, **OPTIONS, independent=True)
    assert made.cutoff is None and np.abs(made.table["dq"]).min() > 0.1
    assert len(made.time) < len(llmt.signals(log, **OPTIONS).time) / 6


def test_what_cannot_be_used_is_refused_with_its_row(log):
    def refused(words, change=None, **options):
        with pytest.raises(ValueError, match=words):
            llmt.signals({**log, **(change or {})}, **{**OPTIONS, **options})

    refused("either time", time="")
    refused("either time", rate=500.0)
    refused("no column 'x'", torque="x")
    refused("log, row 2500: time is 0 after 4.998", group="")
    refused("cutoff", cutoff=0.0)
    refused("quarter of the sampling rate", cutoff=126.0)
    refused("every", every=0)
    refused("standstill", standstill=-1.0)
    refused('would be called "dq"', {"dq": log["u"]}, torque="dq")
    broken = log["q"].copy()
    broken[7] = np.nan
    refused("log, row 7: column 'q' is nan", {"q": broken})


def test_a_target_among_the_inputs_is_named():
    rng = np.random.default_rng(0)
    v, u = rng.normal(size=(2, 200))
    with pytest.raises(ValueError, match='the measured "tau" is u at every row'):
        llmt.find_missing({"v": v, "u": u}, np.sign(v), {"tau": u})
