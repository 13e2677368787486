"""The samples of the package: those of the documentation, and made as they say."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor, samples

DOCS = Path(__file__).parents[2] / "docs" / "samples"


@pytest.mark.parametrize("name", ["arm.urdf", "arm.yaml", "arm_measured.csv", "arm_true.yaml", "heat_pump.csv"])
def test_they_are_the_files_of_the_documentation(name):
    assert samples.path(name).read_bytes() == (DOCS / name).read_bytes()


def test_a_sample_that_is_not_there():
    with pytest.raises(FileNotFoundError, match="no sample 'arm'; there are arm.urdf, arm.yaml, .*heat_pump.csv"):
        samples.path("arm")


def test_the_heat_pump_is_what_its_program_writes():
    made = subprocess.run([sys.executable, DOCS / "heat_pump.py"], check=True, capture_output=True)
    assert made.stdout == samples.path("heat_pump.csv").read_bytes()


def test_the_tank_is_what_its_program_writes():
    for name, arguments in {"tank.csv": [], "tank_new.csv": ["new"]}.items():
        made = subprocess.run([sys.executable, DOCS / "tank.py", *arguments], check=True, capture_output=True)
        assert made.stdout == (DOCS / name).read_bytes()


def test_the_heat_pump_with_and_without_pandas(monkeypatch):
    pandas = pytest.importorskip("pandas")
    X, y = samples.heat_pump()
    table = pandas.read_csv(DOCS / "heat_pump.csv")
    pandas.testing.assert_frame_equal(X, table.drop(columns="cop"), check_dtype=False)
    assert y.name == "cop" and (y == table["cop"]).all()
    predicted = LocalLinearTreeRegressor(cv=0, max_leaves=4).fit(X, y).predict(X)
    monkeypatch.setitem(sys.modules, "pandas", None)
    X, y = samples.heat_pump()
    assert isinstance(X, np.ndarray) and X.shape == (600, 5)
    np.testing.assert_array_equal(LocalLinearTreeRegressor(cv=0, max_leaves=4).fit(X, y).predict(X), predicted)


def test_the_arm_was_measured_as_its_description_says():
    robotics = pytest.importorskip("llmt.robotics")
    made, kept = robotics.simulate(samples.arm_true(), 150, noise_um=20.0, seed=1), samples.arm_measured()
    assert list(made) == list(kept)
    for name in kept:
        np.testing.assert_array_equal(np.asarray(made[name]), np.asarray(kept[name]))
    assert samples.arm().joints == robotics.robot(DOCS / "arm.yaml").joints
