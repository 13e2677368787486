"""llmt.robotics against llmt-robot: the same inputs give the same JSON, and tables in memory those of files."""

import csv
import json
import re
import math
import os
import pickle
import subprocess
from pathlib import Path

import numpy as np
import pytest

robotics = pytest.importorskip("llmt.robotics")
pandas = pytest.importorskip("pandas")

ROOT = Path(__file__).parents[2]
SAMPLES = ROOT / "docs" / "samples"
PROGRAM = os.environ.get("LLMT_ROBOT", str(ROOT / "build" / "release" / "bin" / "llmt-robot"))
JOINTS = [f"q{k}_rad" for k in range(1, 7)]
POINT = ["x_mm", "y_mm", "z_mm"]


def command(*arguments):
    if not os.path.exists(PROGRAM):
        pytest.skip("llmt-robot is not built; LLMT_ROBOT names it")
    done = subprocess.run([PROGRAM, *map(str, arguments)], capture_output=True, text=True, cwd=SAMPLES, check=True)
    return done.stdout


@pytest.fixture(scope="module")
def arm():
    return robotics.robot(SAMPLES / "arm.yaml")


@pytest.fixture(scope="module")
def measured():
    with open(SAMPLES / "arm_measured.csv", newline="") as file:
        return pandas.DataFrame(list(csv.DictReader(file))).astype(float)  # exact in every version of pandas


@pytest.fixture(scope="module")
def found(arm, measured):
    return robotics.discover(arm, measured)


@pytest.fixture(scope="module")
def calibrated(arm, measured):
    return robotics.calibrate(arm, measured, folds=2)


def without_files(result):
    record = ("robot", "data", "output", "made_from")  # of files, which tables in memory are not
    return {key: value for key, value in result.items() if key not in record}


def without_record(description):
    return re.sub(r"^  made_from:\n(    .*\n)+", "", description, flags=re.MULTILINE)


def test_discover_and_its_improved_robot_are_those_of_the_command(found, tmp_path):
    printed = command("discover", "arm.yaml", "arm_measured.csv", "--json", "-o", tmp_path / "improved.yaml")
    assert without_files(found.to_dict()) == without_files(json.loads(printed))
    found.save(tmp_path / "saved.yaml")
    improved, saved = ((tmp_path / name).read_text() for name in ("improved.yaml", "saved.yaml"))
    assert without_record(improved) != improved
    assert without_record(saved) == without_record(improved)


def test_discover_prints_the_page_of_the_command(found):
    page = command("discover", "arm.yaml", "arm_measured.csv")
    assert str(found).replace("measured:", "arm_measured.csv:", 1) == page


def test_the_record_says_what_a_result_was_made_from(tmp_path, monkeypatch):
    monkeypatch.setenv("SOURCE_DATE_EPOCH", "1767225600")
    files = SAMPLES / "arm.yaml", SAMPLES / "arm_measured.csv"
    of_command = json.loads(command("calibrate", *files, "--folds", "2", "--instrument", "AT960", "--json"))["made_from"]
    made = robotics.calibrate(*files, folds=2, threads=1, instrument="AT960", serial_number="R 7")
    record = made.to_dict()["made_from"]
    assert record["files"] == of_command["files"] and record["date"] == of_command["date"] == "2026-01-01"
    assert record["program"].startswith("llmt.robotics ") and record["options"] == ["folds=2"]
    assert (record["instrument"], record["serial_number"]) == ("AT960", "R 7")
    made.save(tmp_path / "saved.yaml")
    assert "serial_number: R 7" in (tmp_path / "saved.yaml").read_text()
    assert robotics.robot(tmp_path / "saved.yaml").to_dict()["calibration"]["made_from"]["date"] == "2026-01-01"


def test_tables_in_memory_are_recorded_by_their_text(arm, measured, found):
    again = robotics.discover(arm, measured, held_out=0.1)
    first, second = found.to_dict()["made_from"], again.to_dict()["made_from"]
    assert [of["role"] for of in first["files"]] == ["description", "measurements"]
    assert first["files"] == second["files"]
    assert (first["options"], second["options"]) == ([], ["held_out=0.1"])
    changed = robotics.calibrate(arm, measured.assign(x_mm=measured["x_mm"] + 1e-9), folds=0).to_dict()["made_from"]
    assert changed["files"][0] == first["files"][0] and changed["files"][1] != first["files"][1]


def test_found_effects_are_those_of_the_arm_that_was_measured(found):
    effects = found.effects
    assert found.verdict == "named"
    assert list(effects.location) == ["joint2", "joint3"]
    true = np.array([1.2e-6, 1.8e-6])  # of arm_true.yaml
    assert (np.abs(effects.value - true) < 3.0 * effects.standard_error).all()
    assert found.gap["after_mm"] < 0.1 * found.gap["before_mm"]


def test_a_limit_is_passed_or_failed(arm, measured):
    assert robotics.calibrate(arm, measured, folds=2, limit_mm=50.0).verdict == "pass"
    assert robotics.calibrate(arm, measured, folds=2, limit_mm=1e-4).verdict == "fail"
    assert robotics.calibrate(arm, measured, folds=0, limit_mm=1.0).verdict == "not evaluated"
    with pytest.raises(ValueError, match="limit_mm"):
        robotics.calibrate(arm, measured, limit_mm=-1.0)


def test_geometry_for_a_controller_is_fitted_alone(found, arm):
    with pytest.warns(robotics.RobotWarning, match="Without the rest the tool is 0.*mm off on average"):
        deltas = robotics.export(found.robot, "deltas", nominal=arm)
    with pytest.warns(robotics.RobotWarning, match="the zeros of the joints alone"):
        zeros = robotics.export(found.robot, "deltas", nominal=arm, zeros=True)
    assert deltas != zeros and deltas.startswith("joint,delta_theta_deg")
    with pytest.raises(ValueError, match='not calibrated with the session "x"'):
        robotics.export(found.robot, "kinematics", session="x")


def test_calibrate_is_that_of_the_command(calibrated):
    assert calibrated.verdict is None
    expected = json.loads(command("calibrate", "arm.yaml", "arm_measured.csv", "--folds", 2, "--json"))
    assert without_files(calibrated.to_dict()) == without_files(expected)
    assert calibrated.to_dict()["data"] == "measured"
    assert len(calibrated.parameters) == len(expected["parameters"])


@pytest.fixture(scope="module")
def chosen(arm):
    return robotics.poses(arm, count=12, seed=2)


def test_poses_are_those_of_the_command(chosen, tmp_path):
    expected = json.loads(command("poses", "arm.yaml", "--count", 12, "--seed", 2, "--json"))
    assert without_files(chosen.to_dict()) == without_files(expected)
    assert chosen.poses.shape == (12, 6)
    with pytest.raises(OSError, match="no_such_folder"):
        chosen.save(tmp_path / "no_such_folder" / "poses.csv")


def test_simulated_and_predicted_tables_are_those_of_the_command():
    made = robotics.simulate(SAMPLES / "arm_true.yaml", 7, noise_um=10.0, seed=3)
    text = command("simulate", "arm_true.yaml", "--poses", 7, "--noise-um", 10, "--seed", 3)
    rows = [[float(cell) for cell in line.split(",")] for line in text.splitlines()[1:]]
    assert text.splitlines()[0].split(",") == list(made.columns)
    assert made.to_numpy().tolist() == rows
    there = robotics.robot(SAMPLES / "arm_true.yaml").forward(made[JOINTS])
    assert np.abs(there[POINT].to_numpy() - made[POINT].to_numpy()).max() < 0.1  # noise of 10 um


def test_commands_bring_the_real_arm_to_the_targets(arm, found):
    away_from_limits = arm.to_dict()
    for joint in away_from_limits["joints"]:
        joint["limits_deg"] = [0.6 * limit for limit in joint["limits_deg"]]
    program = robotics.simulate(away_from_limits, 10, seed=3)[JOINTS]
    description = found.robot.to_dict()
    placed = {**arm.to_dict(), "base": description["base"], "tool": description["tool"]}
    done = robotics.compensate(found.robot, program, nominal=placed, nominal_frames=True)
    assert done.to_dict()["outcomes"]["reached"] == 10
    asked = robotics.predict(placed, program)
    real = robotics.robot(SAMPLES / "arm_true.yaml")

    def missed(joints):
        return np.linalg.norm(real.forward(joints)[POINT].to_numpy() - asked[POINT].to_numpy(), axis=1).mean()

    assert missed(done.commands) < 0.1 * missed(program)


def test_check_names_what_moved(calibrated):
    later = robotics.simulate(calibrated.robot, 30, noise_um=20.0, seed=5)
    good = robotics.check(calibrated.robot, later)
    assert good and good.still_good
    moved = calibrated.robot.to_dict()
    moved["joints"][2]["theta_deg"] += 0.2
    bad = robotics.check(calibrated.robot, robotics.simulate(moved, 30, noise_um=20.0, seed=5))
    assert not bad
    assert "joint3.theta" in set(bad.moved["name"])


def as_polars(frame):
    return pytest.importorskip("polars").from_pandas(frame)


def as_arrow(frame):
    return pytest.importorskip("pyarrow").Table.from_pandas(frame, preserve_index=False)


@pytest.mark.parametrize(
    "table",
    [
        lambda frame: {name: frame[name].to_numpy() for name in frame},
        lambda frame: {name: list(frame[name]) for name in frame},
        lambda frame: frame.to_records(index=False),
        lambda frame: frame.to_dict("records"),
        lambda frame: frame.set_index(frame.index * 7 + 3),
        as_polars,
        as_arrow,
    ],
)
def test_every_kind_of_table_is_the_file(arm, measured, table):
    of_file = robotics.calibrate(arm, SAMPLES / "arm_measured.csv", folds=0)
    of_table = robotics.calibrate(arm, table(measured), folds=0)
    assert without_files(of_table.to_dict()) == without_files(of_file.to_dict())
    assert without_record(of_table.robot.to_yaml()) == without_record(of_file.robot.to_yaml())


def test_numbers_reach_the_reader_to_the_last_bit(arm):
    rng = np.random.default_rng(1)
    joints = {name: rng.normal(size=50) * 10.0 ** rng.integers(-8, 0, 50) for name in JOINTS}
    there = robotics.predict(arm, joints)
    for name, values in joints.items():
        assert there[name].to_list() == values.tolist()


def test_robot_is_the_same_as_yaml_dict_and_urdf(arm, tmp_path):
    again = robotics.robot(arm.to_dict())
    assert again.to_yaml() == arm.to_yaml()
    assert robotics.robot(arm.to_yaml()).to_yaml() == arm.to_yaml()
    assert robotics.robot(arm) is arm
    assert pickle.loads(pickle.dumps(arm)).to_yaml() == arm.to_yaml()
    arm.save(tmp_path / "arm.yaml")
    assert robotics.Robot.read(tmp_path / "arm.yaml").to_yaml() == arm.to_yaml()
    q = {f"q{k}_deg": 10.0 * k for k in range(1, 7)}
    urdf = robotics.robot(SAMPLES / "arm.urdf")
    text = robotics.robot((SAMPLES / "arm.urdf").read_text())
    for other in (urdf, text, pickle.loads(pickle.dumps(urdf))):
        gap = other.forward(q)[POINT].to_numpy() - arm.forward(q)[POINT].to_numpy()
        assert np.abs(gap).max() < 1e-9
    assert [joint["limits"] for joint in arm.joints][0] == (-170.0, 170.0)
    assert repr(arm).startswith("sample arm: 6 joints")


@pytest.mark.parametrize("boost", [False, True])
def test_a_correction_goes_with_its_robot(arm, measured, tmp_path, boost):
    corrected = robotics.calibrate(arm, measured, folds=0, correct=True, boost=boost).robot
    copy = pickle.loads(pickle.dumps(corrected))
    assert [Path(name).name for name in corrected.save(tmp_path / "cal.yaml")] == ["cal.correction.json", "cal.yaml"]
    expected = corrected.forward(measured[JOINTS])
    for other in (copy, robotics.robot(tmp_path / "cal.yaml")):
        assert other.forward(measured[JOINTS]).equals(expected)
    with pytest.raises(ValueError, match="cal.correction.json"):
        robotics.robot((tmp_path / "cal.yaml").read_text())


@pytest.mark.parametrize("options", [{}, {"correct": True, "max_leaves": 4}, {"correct": True, "min_leaf": 9}])
def test_boost_is_of_a_correction_and_takes_no_size_of_a_tree(arm, measured, options):
    with pytest.raises(ValueError, match="boost"):
        robotics.calibrate(arm, measured, folds=0, boost=True, **options)


def test_urdf_gets_the_identified_origins(measured, tmp_path):
    calibrated = robotics.calibrate(SAMPLES / "arm.urdf", measured, folds=0).robot
    calibrated.save(tmp_path / "arm.urdf")
    command("calibrate", "arm.urdf", "arm_measured.csv", "--folds", 0, "-o", tmp_path / "by_command.urdf")
    assert (tmp_path / "arm.urdf").read_text() == (tmp_path / "by_command.urdf").read_text()
    assert (tmp_path / "arm.yaml").exists()


def test_export_is_that_of_the_command(arm):
    real = robotics.robot(SAMPLES / "arm_true.yaml")
    with pytest.warns(robotics.RobotWarning, match="geometry alone"):
        assert robotics.export(real, "deltas", nominal=arm) == command(
            "export", "arm_true.yaml", "--deltas", "arm.yaml"
        )
    assert robotics.export(arm, "kinematics") == command("export", "arm.yaml", "--kinematics")
    assert robotics.export(arm, "kinematics", origins=arm) == command(
        "export", "arm.yaml", "--kinematics", "--origins", "arm.yaml"
    )
    with pytest.raises(ValueError, match="leave origins out"):
        robotics.export(arm, "c", origins=arm)
    source, header = robotics.export(arm, "c", name="sample")
    assert "sample_forward" in source and "sample_forward" in header


def test_results_are_plain_and_have_pictures(found, calibrated):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    for result in (found, calibrated):
        copy = pickle.loads(pickle.dumps(result))
        assert copy.to_dict() == result.to_dict() and str(copy) == str(result)
        assert len(result.plot().lines) >= 2
    assert "<table>" in found._repr_html_() and "joint_compliance" in found._repr_html_()
    assert len(calibrated.poses) == 150


def test_points_set_aside_are_those_of_the_gap(found):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("Agg")
    gap = found.gap
    aside = found.poses[found.poses["set_aside"]]
    assert len(found.poses) == 150 and len(aside) == gap["heldout_poses"] == 30
    assert aside["before_mm"].mean() == pytest.approx(gap["before_mm"], abs=1e-9)
    assert aside["after_mm"].mean() == pytest.approx(gap["after_mm"], abs=1e-9)
    lines = {line.get_label(): line for line in found.plot().lines}
    assert (lines[f"after, set aside, mean {gap['after_mm']:.4f} mm"].get_xdata() == aside.index).all()
    assert len(lines["after, searched"].get_xdata()) == 120


def changed(frame, column, row, value):
    copy = frame.astype({column: object})
    copy.loc[row, column] = value
    return copy


@pytest.mark.parametrize(
    ("change", "error", "words"),
    [
        (lambda frame: frame.drop(columns="q3_rad"), ValueError, "q3"),
        (lambda frame: frame.drop(columns=POINT), ValueError, "x_mm"),
        (lambda frame: frame.rename(columns={"q3_rad": "q3_grad"}), ValueError, "q3"),
        (lambda frame: frame.rename(columns={"x_mm": "x"}), ValueError, "x"),
        (lambda frame: changed(frame, "y_mm", 5, math.nan), ValueError, r"measured, row 5: column \"y_mm\""),
        (lambda frame: changed(frame, "q2_rad", 7, math.inf), ValueError, r"measured, row 7: column \"q2_rad\""),
        (lambda frame: changed(frame, "q2_rad", 0, "much"), ValueError, r"measured, row 0: column \"q2_rad\""),
        (lambda frame: frame.iloc[:0], ValueError, "measured: no rows"),
        (lambda frame: frame.to_numpy(), TypeError, "measured: ndarray"),
        (lambda frame: frame.rename(columns={"x_mm": 7}), TypeError, "7"),
        (lambda frame: {**{name: list(frame[name]) for name in frame}, "z_mm": [1.0]}, ValueError, "z_mm"),
        (lambda frame: 3.0, TypeError, "measured: float"),
        (lambda frame: "no_such_file.csv", FileNotFoundError, "no_such_file.csv"),
    ],
)
def test_what_is_wrong_with_a_table_is_named(arm, measured, change, error, words):
    with pytest.raises(error, match=words):
        robotics.calibrate(arm, change(measured), folds=0)


@pytest.mark.parametrize(
    ("arguments", "error", "words"),
    [
        ({"folds": 1}, ValueError, "folds"),
        ({"folds": "many"}, TypeError, "folds"),
        ({"new_session": True}, ValueError, "new_session"),
        ({"prior": {"joint2.a": -1.0}}, ValueError, "joint2.a"),
        ({"fix": ["joint9"]}, ValueError, "joint9"),
        ({"fix": [3]}, TypeError, "fix"),
        ({"columns": {"no_such": "q3_rad"}}, ValueError, "no_such"),
        ({"orientations": True}, ValueError, "orientations"),
    ],
)
def test_what_is_wrong_with_an_argument_is_named(arm, measured, arguments, error, words):
    with pytest.raises(error, match=words):
        robotics.calibrate(arm, measured, **arguments)


def test_what_is_wrong_with_a_description_is_named(arm):
    with pytest.raises(ValueError, match="convention"):
        robotics.robot({**arm.to_dict(), "convention": "dhm"})
    with pytest.raises(ValueError, match="joints"):
        robotics.robot({key: value for key, value in arm.to_dict().items() if key != "joints"})
    with pytest.raises(ValueError, match="a_mm"):
        joints = arm.to_dict()["joints"]
        joints[1]["a_mm"] = math.nan
        robotics.robot({**arm.to_dict(), "joints": joints})
    with pytest.raises(ValueError, match="colour"):
        robotics.robot({**arm.to_dict(), "colour": "red"})
    with pytest.raises(ValueError, match="robot:2"):
        robotics.robot("name: arm\n  joints: [")
    with pytest.raises(ValueError, match="robot.urdf"):
        robotics.robot("<robot>")
    with pytest.raises(TypeError, match="float"):
        robotics.robot(1.0)


def test_messages_name_no_function_of_cpp(arm, measured):
    with pytest.raises(ValueError, match="was not calibrated") as refused:
        robotics.check(arm, measured)
    assert "::" not in str(refused.value) and "<" not in str(refused.value)


def test_joints_in_degrees_are_joints(arm, measured):
    degrees = measured.rename(columns={name: name.replace("_rad", "_deg") for name in JOINTS})
    for name in JOINTS:
        degrees[name.replace("_rad", "_deg")] = np.degrees(measured[name])
    result = robotics.calibrate(arm, degrees, folds=0)
    expected = robotics.calibrate(arm, measured, folds=0)
    assert np.allclose(result.parameters.value, expected.parameters.value, rtol=0, atol=1e-6)


def test_wrong_units_are_warned_of(arm, measured):
    wrong = measured.rename(columns={name: name.replace("_rad", "_deg") for name in JOINTS})
    with pytest.raises(ValueError, match="units"):
        robotics.calibrate(arm, wrong, folds=0)


def test_progress_may_stop_the_work(arm, measured):
    def stop(done, total, step):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        robotics.discover(arm, measured, progress=stop)
    with pytest.raises(KeyboardInterrupt):
        robotics.poses(arm, count=100, progress=stop)
    with pytest.raises(KeyboardInterrupt):
        robotics.compensate(arm, measured[POINT], progress=stop)


def test_targets_out_of_reach_are_warned_of(arm):
    with pytest.warns(robotics.RobotWarning, match="targets, row 1"):
        done = robotics.compensate(arm, {"x_mm": [900.0, 9000.0], "y_mm": [100.0, 0.0], "z_mm": [800.0, 0.0]})
    assert list(done.commands.outcome) == ["reached", "unreachable"]


def test_every_result_is_shown_in_a_notebook(arm, calibrated, chosen):
    later = robotics.check(calibrated.robot, robotics.simulate(calibrated.robot, 20, noise_um=20.0, seed=9))
    assert later.summary.startswith("STILL GOOD.") and later.summary in later._repr_html_()
    assert chosen._repr_html_().count("<tr>") == 2 + 13  # what is expected, and the poses
    done = robotics.compensate(calibrated.robot, chosen.poses[:2] * 0.5, nominal=arm)
    assert done._repr_html_().count("reached</td>") == 2
    assert "<table>" in arm._repr_html_() and "falls from" in calibrated._repr_html_()


def test_columns_that_nobody_needs_may_hold_anything(arm, measured):
    import datetime

    plain = robotics.calibrate(arm, measured, folds=0)
    logged = measured.assign(
        when=[datetime.datetime(2024, 1, 1, 12, 0, k % 60) for k in range(len(measured))],
        mixed=["text" if k % 2 else k for k in range(len(measured))],
        good=True,
    )
    for table in (logged, as_arrow(logged.drop(columns="mixed")), as_polars(logged.drop(columns="mixed"))):
        calibrated = robotics.calibrate(arm, table, folds=0)
        assert without_record(calibrated.robot.to_yaml()) == without_record(plain.robot.to_yaml())
