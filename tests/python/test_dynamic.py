"""Models of systems that move, beside the program and compiled C."""

import copy
import json
import pickle
import shutil
import subprocess

import numpy as np
import pytest
import sklearn.base

from llmt import DynamicLocalLinearTreeRegressor


def spring(rows: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    source = np.random.default_rng(seed)
    u = np.repeat(source.uniform(-3, 3, rows // 3 + 1), 3)[:rows]
    y = np.zeros(rows)
    for t in range(2, rows):
        y[t] = 1.4 * y[t - 1] - 0.64 * y[t - 2] + 0.5 * u[t - 1] - 0.02 * y[t - 1] ** 3
    return u, y + 0.01 * source.standard_normal(rows)


def test_a_generated_silverbox_is_learned_and_run() -> None:
    u, y = spring(600, 1)
    model = DynamicLocalLinearTreeRegressor(lags="y:1-2,u:1").fit(u, y, dt=0.05)
    other_u, other_y = spring(600, 2)
    run = model.simulate(other_u, other_y[:2])[:, 0]
    assert np.sqrt(np.mean((run - other_y) ** 2)) < 0.02
    assert model.summary_["held_out"]["fit_per_cent"][0] > 98
    assert model.sample_time_ == 0.05
    assert model.is_stable_
    assert all(abs(z) < 1 for poles in model.poles().values() for z in poles)
    next_rows = model.predict(other_u, other_y)[:, 0]
    assert np.isnan(next_rows[:2]).all()
    assert np.sqrt(np.mean((next_rows[2:] - other_y[2:]) ** 2)) < 0.04
    assert "Poles" in str(model) or "poles" in str(model) or "Local dynamics" in str(model)


def test_files_and_c_run_to_the_same_bytes(tmp_path) -> None:
    u, y = spring(300, 3)
    model = DynamicLocalLinearTreeRegressor(lags="y:1-2,u:1", rest="hilomot").fit(u, y)
    model.save(tmp_path / "m.json")
    run = model.simulate(u, y[:2])
    assert (DynamicLocalLinearTreeRegressor.load(tmp_path / "m.json").simulate(u, y[:2]) == run).all()
    if shutil.which("cc") is None:
        pytest.skip("no C compiler")
    source, header = model.to_c("drive")
    (tmp_path / "drive.c").write_text(source)
    (tmp_path / "drive.h").write_text(header)
    (tmp_path / "main.c").write_text(
        """#include <stdio.h>
#include "drive.h"
int main(void) {
  struct drive_state state;
  double u[2], y[2], now, out;
  int k;
  for (k = 0; k < 2; ++k) if (scanf("%lf %lf", u + k, y + k) != 2) return 1;
  drive_start(&state, 2, u, y);
  while (scanf("%lf", &now) == 1) {
    if (drive_step(&state, &now, &out) != 0) return 2;
    printf("%.17g\\n", out);
  }
  return 0;
}
"""
    )
    subprocess.run("cc -std=c99 drive.c main.c -o drive -lm", shell=True, cwd=tmp_path, check=True)
    given = "".join(f"{u[k]!r} {y[k]!r}\n" for k in range(2)) + "".join(f"{value!r}\n" for value in u[2:].tolist())
    given = given.replace("np.float64(", "").replace(")", "")
    done = subprocess.run([tmp_path / "drive"], input=given, capture_output=True, text=True, check=True)
    assert (np.array([float(line) for line in done.stdout.split()]) == run[2:, 0]).all()


def test_frames_give_names_and_the_step_of_time() -> None:
    pandas = pytest.importorskip("pandas")
    u, y = spring(300, 4)
    index = pandas.date_range("2024-01-01", periods=300, freq="20ms")
    frame = pandas.DataFrame({"force": u, "place": y}, index=index)
    model = DynamicLocalLinearTreeRegressor(lags="place:1-2,force:1", rest="none").fit(frame[["force"]], frame["place"])
    assert model.sample_time_ == pytest.approx(0.02)
    assert model.lags_ == "place:1-2,force:1"
    assert json.dumps(model.summary_["outputs"]) == '["place"]'
    with pytest.raises(ValueError, match="row 10"):
        DynamicLocalLinearTreeRegressor().fit(frame[["force"]].drop(index[10]), frame["place"].drop(index[10]))


def test_what_does_not_fit_is_refused_by_name() -> None:
    u, y = spring(100, 5)
    with pytest.raises(ValueError, match="not fitted"):
        DynamicLocalLinearTreeRegressor().simulate(u, y[:2])
    with pytest.raises(ValueError, match="purpose"):
        DynamicLocalLinearTreeRegressor(purpose="fun").fit(u, y)
    with pytest.raises(ValueError, match="z:1"):
        DynamicLocalLinearTreeRegressor(lags="z:1").fit(u, y)
    with pytest.raises(ValueError, match="records has 3"):
        DynamicLocalLinearTreeRegressor().fit(u, y, records=[1, 2, 3])
    model = DynamicLocalLinearTreeRegressor(lags="y:1,u:1", rest="none").fit(u, y)
    with pytest.raises(ValueError, match="to_onnx"):
        model.to_onnx()
    with pytest.raises(ValueError, match="to_sql"):
        model.to_sql()


def test_nine_of_ten_measured_values_of_a_fresh_run_lie_in_the_band(tmp_path) -> None:
    u, y = spring(500, 6)
    model = DynamicLocalLinearTreeRegressor(lags="y:1-2,u:1").fit(u, y)
    fresh_u, fresh_y = spring(900, 7)
    band = model.simulate_interval(fresh_u, fresh_y[:2], coverage=0.9)
    assert band.shape == (900, 2, 1)
    run = model.simulate(fresh_u, fresh_y[:2])
    assert (band[:, 0] <= run).all() and (run <= band[:, 1]).all()
    assert (band[:2, 0] == band[:2, 1]).all()
    inside = (band[2:, 0, 0] <= fresh_y[2:]) & (fresh_y[2:] <= band[2:, 1, 0])
    assert inside.mean() == pytest.approx(0.9, abs=0.06)
    wide = model.simulate_interval(fresh_u, fresh_y[:2], coverage=0.98)
    assert (wide[2:, 1] > band[2:, 1]).all()
    with pytest.raises(ValueError, match="coverage"):
        model.simulate_interval(fresh_u, fresh_y[:2], coverage=90)
    model.save(tmp_path / "m.json")
    assert (DynamicLocalLinearTreeRegressor.load(tmp_path / "m.json").simulate_interval(fresh_u, fresh_y[:2]) == band).all()
    old = json.loads((tmp_path / "m.json").read_text())
    del old["held_out_errors"]
    (tmp_path / "old.json").write_text(json.dumps(old))
    with pytest.raises(ValueError, match="no errors of held-out runs"):
        DynamicLocalLinearTreeRegressor.load(tmp_path / "old.json").simulate_interval(fresh_u, fresh_y[:2])
    held = model.held_out_[:, 0]
    assert np.isnan(held).sum() == 4 * 2
    assert np.sqrt(np.nanmean((held - y) ** 2)) == pytest.approx(model.summary_["held_out"]["rmse"][0], rel=0.3)


def test_local_models_and_states_of_rest_are_arrays() -> None:
    u, y = spring(500, 8)
    model = DynamicLocalLinearTreeRegressor(lags="y:1-2,u:1", rest="none").fit(u, y, dt=0.05)
    for local in model.local_models():
        response = local["step_response"]
        assert response.shape[:2] == (1, 1)
        assert response[0, 0, -1] == pytest.approx(local["steady_gain"][0, 0], rel=0.03)
        assert len(local["poles"]) == 2 and local["stable"] and 0 < local["settling_time"] < 5
    curve = model.static_curve("u", points=7)
    assert len(curve["input"]) == 7 and curve["stable"].all() and len(curve["none"]) == 0
    # Where the model rests a long run ends.
    for value, rest in zip(curve["input"], curve["outputs"][:, 0], strict=True):
        assert model.simulate(np.full(600, value), [0.0])[-1, 0] == pytest.approx(rest, abs=1e-6)
    with pytest.raises(ValueError, match="no input 'w'"):
        model.static_curve("w")


def test_a_dead_time_is_found() -> None:
    source = np.random.default_rng(9)
    u = np.repeat(source.uniform(-1, 1, 100), 4)
    y = np.zeros(400)
    for t in range(1, 400):
        y[t] = 0.8 * y[t - 1] + (0.5 * u[t - 6] if t >= 6 else 0.0)
    y += 0.01 * source.standard_normal(400)
    model = DynamicLocalLinearTreeRegressor(lags="y:1,u:1", delay="auto", rest="none").fit(u, y)
    assert model.lags_ == "y:1,u:6" and model.summary_["delays"] == [5]
    with pytest.raises(ValueError, match="delay"):
        DynamicLocalLinearTreeRegressor(lags="y:1,u:1", delay="u").fit(u, y)


def test_dead_times_are_texts_and_shown() -> None:
    model = DynamicLocalLinearTreeRegressor(lags="y:1,u:1", delay="u:3")
    assert repr(model) == (
        "DynamicLocalLinearTreeRegressor(lags='y:1,u:1', delay='u:3', purpose='simulation', rest='auto')"
    )
    with pytest.raises(TypeError, match="delay is 3, it must be a text such as 'u:3', 'auto', or None"):
        DynamicLocalLinearTreeRegressor(delay=3).fit(np.arange(50.0), np.arange(50.0))


def test_copies_are_the_same_model() -> None:
    u, y = spring(300, 10)
    model = DynamicLocalLinearTreeRegressor(lags="y:1-2,u:1", rest="none").fit(u, y, dt=0.05)
    for copied in (pickle.loads(pickle.dumps(model)), copy.deepcopy(model)):
        np.testing.assert_array_equal(copied.simulate(u, y[:2]), model.simulate(u, y[:2]))
        assert str(copied) == str(model) and copied.summary_ == model.summary_ and copied.lags_ == "y:1-2,u:1"
    fresh = sklearn.base.clone(model)
    assert fresh.get_params() == model.get_params()
    with pytest.raises(ValueError, match="not fitted"):
        fresh.simulate(u, y[:2])
    assert fresh.set_params(rest="auto", n_jobs=1).rest == "auto"
    with pytest.raises(ValueError, match="no parameter 'leaves'; there are lags, delay"):
        fresh.set_params(leaves=3)
