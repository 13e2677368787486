"""What a newcomer does wrong, and what is said of it: the parameter's name and what to do."""

import re
import warnings
from pathlib import Path

import numpy as np
import pytest

import llmt
from llmt import LocalLinearTreeRegressor, Model

pandas = pytest.importorskip("pandas")
SAMPLES = Path(__file__).parents[2] / "docs" / "samples"


@pytest.fixture(scope="module")
def table():
    read = pandas.read_csv(SAMPLES / "heat_pump.csv")
    return read.drop(columns="cop"), read["cop"]


@pytest.fixture(scope="module")
def readable(table):
    return LocalLinearTreeRegressor(readable=True).fit(*table)


def said(call):
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        call()
    return " | ".join(str(warning.message) for warning in caught)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"cv": 1}, "cv is 1; it must be 2 folds or more, or 0"),
        ({"cv": "5"}, "cv is '5'; it must be a whole number, a splitter or a list"),
        ({"validity": "smooth"}, "validity is 'smooth'; it must be one of auto, crisp, blend, gaussian"),
        ({"categorical_features": ["town"]}, 'categorical_features has "town"'),
    ],
)
def test_a_parameter_is_named_as_it_was_given(table, options, words):
    with pytest.raises(ValueError, match=re.escape(words)):
        LocalLinearTreeRegressor(**options).fit(*table)


def test_coverage_is_a_share(table, readable):
    with pytest.raises(ValueError, match="coverage is 90; it must lie between 0 and 1: 0.9 for 90 %"):
        readable.predict_interval(table[0], coverage=90)


def test_without_held_out_rows_intervals_say_what_to_do(table):
    with pytest.raises(ValueError, match="fit it with cv=5"):
        LocalLinearTreeRegressor(cv=0, max_leaves=2).fit(*table).predict_interval(table[0])


def test_intervals_outside_of_the_training_ranges_are_warned_of(table, readable):
    X = table[0].head(4).copy()
    assert said(lambda: readable.predict_interval(X)) == ""
    X.loc[2, "outdoor_C"] = 1000.0
    assert "1 of 4 rows lie outside of the training ranges, the first is row 2" in said(
        lambda: readable.predict_interval(X)
    )


@pytest.mark.parametrize("beyond", [1e-6, 0.01, 0.5, 0.99, 1.0, 1.01])
def test_intervals_just_outside_of_the_training_ranges_are_warned_of(table, readable, beyond):
    """`beyond`: by this share of the range."""
    ranges = table[0]["outdoor_C"].min(), table[0]["outdoor_C"].max()
    for end, other in (ranges, ranges[::-1]):
        X = table[0].head(4).copy()
        X.loc[1, "outdoor_C"] = end
        assert said(lambda: readable.predict_interval(X)) == ""
        X.loc[1, "outdoor_C"] = end + beyond * (end - other)
        assert "1 of 4 rows lie outside of the training ranges, the first is row 1" in said(
            lambda: readable.predict_interval(X)
        )


def test_few_rows_are_warned_of(table):
    X, y = table
    assert "X has 3 rows: below 10" in said(lambda: LocalLinearTreeRegressor().fit(X[:3], y[:3]))
    assert "below 10" not in said(lambda: LocalLinearTreeRegressor().fit(X[:10], y[:10]))


@pytest.mark.parametrize(
    ("comma", "hint"), [(False, 'X["flow_C"].astype(float)'), (True, 'X["flow_C"].str.replace(",", ".").astype(float)')]
)
def test_inputs_that_are_numbers_as_text(table, comma, hint):
    X, y = (part.head(200) for part in table)
    text = X["flow_C"].astype(str)
    text = text.str.replace(".", ",") if comma else text
    message = said(lambda: LocalLinearTreeRegressor(cv=2, max_leaves=2).fit(X.assign(flow_C=text), y))
    assert "has words that read as numbers" in message and hint in message
    assert "categorical_features" not in message


def test_targets_that_are_numbers_as_text(table):
    X, y = table
    with pytest.raises(TypeError, match=re.escape("convert them: y.astype(float)")):
        LocalLinearTreeRegressor().fit(X, y.astype(str))
    with pytest.raises(TypeError, match=r"\('Thu' in row 0\); numbers are needed$"):
        LocalLinearTreeRegressor().fit(X, pandas.Series(["Thu"] * len(X)))


def test_a_file_that_is_no_model_is_named():
    with pytest.raises(ValueError, match="heat_pump.csv: model: not JSON"):
        Model.load(SAMPLES / "heat_pump.csv")


def test_one_row_and_rows_as_dicts(table, readable):
    with pytest.raises(ValueError, match=re.escape("X.iloc[[0]]")):
        readable.predict(table[0].iloc[0])
    with pytest.raises(TypeError, match=re.escape("X is a list of dicts; make a table of it: pandas.DataFrame(X)")):
        readable.predict(table[0].head(2).to_dict("records"))


def test_the_model_in_use_is_the_chosen_one(table, readable):
    candidates = readable.candidates_
    assert candidates.loc[candidates["chosen"], "model"].tolist() == ["readable tree"]
    assert not candidates.duplicated().any()
    default = LocalLinearTreeRegressor().fit(*table).candidates_
    assert default["chosen"].sum() == 1 and "readable tree" not in set(default["model"])


def test_both_errors_are_drawn(readable):
    pytest.importorskip("matplotlib").use("agg")
    labels = [text.get_text() for text in readable.plot_error().get_legend().get_texts()]
    assert "this model, readable: 0.09946" in labels
    assert "most accurate, with the spread of folds: 0.09045" in labels


def test_a_printed_readable_tree_has_its_equations(readable):
    text = re.sub(r"[\s|]+", " ", str(readable))
    for equation in readable.rules_["then"]:
        assert equation in text


def test_a_drawn_readable_tree_has_its_equations_and_thresholds(readable):
    pytest.importorskip("matplotlib").use("agg")
    axes = readable.plot()
    drawn = " ".join(text.get_text() for text in axes.texts).replace("\N{MINUS SIGN}", "-")
    page = readable._repr_html_().replace("\N{MINUS SIGN}", "-")
    for shown in (" ".join(drawn.split()), page):
        for equation in readable.rules_["then"]:
            assert all(term in shown for term in re.split(" (?=[+-] )", equation.partition(" = ")[2])), equation
        assert "rounded" not in shown
    for node in readable.model_.to_dict()["partitions"][0]["nodes"]:
        if "split" in node:
            assert str(node["split"]["threshold"]).removesuffix(".0") in drawn


def test_a_drawing_that_rounds_says_so(table):
    pytest.importorskip("matplotlib").use("agg")
    model = LocalLinearTreeRegressor(validity="crisp", max_leaves=3).fit(*table)
    assert any("rounded" in text.get_text() for text in model.plot().texts)
    assert "rounded" in model._repr_html_() and "rounded" in str(model)


def test_one_category_is_named_alike_everywhere():
    rng = np.random.default_rng(1)
    town = np.array(["Brno", "Plzen", "Prague"])[rng.integers(0, 3, 400)]
    X = pandas.DataFrame({"x": rng.uniform(0, 1, 400), "town": town})
    y = np.where(town == "Prague", 5.0 * X["x"], 20.0 - X["x"]) + 0.1 * rng.normal(size=400)
    model = LocalLinearTreeRegressor(validity="crisp", max_leaves=2).fit(X, y)
    for words in (*model.rules_["if"], *model.leaves_["where"]):
        assert words in ("town = Prague", "town not in {Prague}")
        assert words in str(model)


def test_the_cost_of_reading_is_printed(table, readable):
    text = " ".join(str(readable).split())
    errors = {kind: readable.summary_[kind][0]["cv_rmse"] for kind in ("readable", "partitions")}
    assert f"Reading costs {100 * (errors['readable'] / errors['partitions'] - 1):.0f} % more error (over the folds" in text
    assert "Reading costs" not in str(LocalLinearTreeRegressor(validity="crisp").fit(*table))


def test_a_fit_judged_by_given_rows_has_no_spread(table):
    X, y = table
    model = LocalLinearTreeRegressor().fit(X[:400], y[:400], eval_set=(X[400:], y[400:]))
    assert "spread" not in str(model) and "+- 0" not in str(model)


def test_a_curve_is_drawn_at_the_commonest_label():
    pytest.importorskip("matplotlib").use("agg")
    rng = np.random.default_rng(1)
    town = np.array(["P", "B", "P"], dtype=object)[rng.integers(0, 3, 400)]
    x = rng.uniform(0, 1, 400)
    y = np.where(town == "P", 5.0 * x, 20.0 - x) + 0.1 * rng.normal(size=400)
    town[rng.random(400) < 0.03] = None
    model = LocalLinearTreeRegressor().fit(pandas.DataFrame({"x": x, "town": town}), y)
    axes, at = model.plot_curve("x"), model.plot_curve("x", at={"town": "P"})
    assert axes.get_title() == "Prediction along x, town = P, others at their means"
    assert (axes.lines[0].get_ydata() == at.lines[0].get_ydata()).all()
    assert (axes.collections[0].get_paths()[0].vertices == at.collections[0].get_paths()[0].vertices).all()


def test_dir_has_the_public_names_once():
    names = [name for name in dir(llmt) if not name.startswith("__")]
    assert names == sorted(name for name in llmt.__all__ if not name.startswith("__"))


robotics = pytest.importorskip("llmt.robotics")
JOINTS = [f"q{k}_rad" for k in range(1, 7)]
POINT = ["x_mm", "y_mm", "z_mm"]


@pytest.fixture(scope="module")
def arm():
    return robotics.robot(SAMPLES / "arm.yaml")


@pytest.fixture(scope="module")
def measured():
    return pandas.read_csv(SAMPLES / "arm_measured.csv")


def in_metres(arm):
    description = arm.to_dict()
    for joint in description["joints"]:
        joint.update({key: joint[key] / 1000 for key in ("a_mm", "d_mm") if key in joint})
    for frame in ("base", "tool"):
        description[frame]["xyz_mm"] = [value / 1000 for value in description[frame]["xyz_mm"]]
    return description


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda arm, of: (arm, of.assign(**np.degrees(of[JOINTS]))), "the angles of the table are degrees, not radians"),
        (lambda arm, of: (arm, of.assign(**{n: of[n] / 1e3 for n in POINT})), "the measured positions are metres"),
        (lambda arm, of: (arm, of.assign(q2_rad=-of["q2_rad"])), "joint2 counts in the other direction"),
        (lambda arm, of: (arm, of.assign(q2_rad=of["q3_rad"], q3_rad=of["q2_rad"])), "joint2 and joint3 are exchanged"),
        (lambda arm, of: (in_metres(arm), of), "the lengths of the description are metres, not millimetres"),
    ],
)
@pytest.mark.parametrize("task", ["calibrate", "discover"])
def test_likely_causes_are_named(arm, measured, change, words, task):
    robot, table = change(arm, measured)
    options = {"folds": 0} if task == "calibrate" else {}
    with pytest.raises(ValueError, match=rf"\n- most likely .*{re.escape(words)}"):
        getattr(robotics, task)(robot, table, **options)


def test_a_name_in_the_wrong_case_is_an_error(arm, measured):
    with pytest.raises(ValueError, match='column "Y_mm": did you mean "y_mm"'):
        robotics.calibrate(arm, measured.rename(columns={"y_mm": "Y_mm"}))


def test_a_missing_coordinate_is_warned_of(arm, measured):
    with pytest.warns(robotics.RobotWarning, match="measured: there is no y_mm; only x and z"):
        robotics.calibrate(arm, measured.drop(columns="y_mm"), folds=0)


def test_what_the_page_warns_of_is_a_warning(arm, measured):
    with pytest.warns(robotics.RobotWarning, match="15 measured coordinates"):
        few = robotics.calibrate(arm, measured.head(5), folds=0)
    assert len(few.warnings) == 1 and "15 measured coordinates" in few.warnings[0]
    wrong = measured.copy()
    wrong.loc[9, "x_mm"] += 500
    with pytest.warns(robotics.RobotWarning):
        far = robotics.calibrate(arm, wrong)
    assert any("(row 9): robust=True leaves such readings out" in sentence for sentence in far.warnings)
    assert any("no better than the described one" in sentence for sentence in far.warnings)


def test_a_common_scale_is_warned_of(arm, measured):
    scaled = measured.assign(**{name: measured[name] * 1.016 for name in ("x_mm", "y_mm", "z_mm")})
    with pytest.warns(robotics.RobotWarning, match="all identified lengths are 1.01[567][0-9]* times those described"):
        robotics.calibrate(arm, scaled, folds=0)
    assert robotics.calibrate(arm, measured, folds=0).warnings == []


def test_a_urdf_says_what_it_does_not_hold(measured, tmp_path):
    made = robotics.calibrate(robotics.robot(SAMPLES / "arm.urdf"), measured, folds=0)
    with pytest.warns(robotics.RobotWarning, match="arm.urdf holds the geometry only; .*base: in .*arm.yaml, load that"):
        names = made.save(tmp_path / "arm.urdf")
    assert sorted(Path(name).name for name in names) == ["arm.urdf", "arm.yaml"]
    assert said(lambda: made.save(tmp_path / "arm.yaml")) == ""


def test_arguments_that_are_missing_or_too_many(arm, measured):
    with pytest.raises(ValueError, match=re.escape("export(robot, 'deltas', nominal=arm)")):
        robotics.export(arm, "deltas")
    with pytest.raises(ValueError, match="leave nominal out"):
        robotics.export(arm, "c", nominal=arm)
    with pytest.raises(TypeError, match="a robot is a Robot, .* not DataFrame; the robot is the first argument"):
        robotics.calibrate(measured, arm)
    with pytest.raises(ValueError, match="calibrate it first"):
        robotics.check(arm, measured)
    with pytest.raises(ValueError) as refused:
        robotics.check(robotics.calibrate(arm, measured).robot, measured.assign(x_mm="word"))
    assert "calibrate it first" not in str(refused.value)
    with pytest.warns(robotics.RobotWarning, match="the targets are poses: nominal is not read"):
        robotics.compensate(arm, measured[["x_mm", "y_mm", "z_mm"]].head(2), nominal=arm)


@pytest.mark.parametrize("call", [lambda arm: robotics.robot("no.yaml"), lambda arm: robotics.calibrate(arm, "no.csv")])
def test_a_file_that_is_not_there(arm, call):
    with pytest.raises(FileNotFoundError, match="no[.](yaml|csv)"):
        call(arm)
