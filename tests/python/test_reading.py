"""The path of the readable tree and what matters, from Python."""

import numpy as np
import pytest

from llmt import LocalLinearTreeRegressor


@pytest.fixture(scope="module")
def waves():
    random = np.random.default_rng(5)
    X = random.uniform(-1, 1, (500, 4))
    y = 3 * np.sin(4 * X[:, 0]) + X[:, 1] + 0.2 * random.normal(size=500)
    return X, y


@pytest.fixture(scope="module")
def usual(waves):
    return LocalLinearTreeRegressor(readable=True).fit(*waves)


def test_steps_are_the_same_in_the_table_and_in_print(usual):
    steps = usual.steps_
    assert list(steps["rules"]) == sorted(set(steps["rules"]))
    taken = steps[steps["taken"]]
    assert len(taken) == 1 and taken["rules"].iloc[0] == len(usual.leaves_)
    text = str(usual)
    assert "rules  terms per rule  size  RMSE held-out  above the model" in text
    for sentence in usual.summary_["readable"][0]["sentences"]:
        assert sentence in " ".join(text.split())
        assert sentence in " ".join(usual.summary(width=400).split())
    cost = 100 * (taken["rmse"].iloc[0] / usual.summary_["partitions"][0]["cv_rmse"] - 1)
    assert any(s.startswith(f"Reading costs {cost:.0f} % more error") for s in usual.summary_["readable"][0]["sentences"])


def test_a_step_is_taken_by_its_rules(waves, usual):
    rules = int(usual.steps_["rules"].iloc[1])
    model = LocalLinearTreeRegressor(readable_rules=rules).fit(*waves)
    assert len(model.leaves_) == rules
    assert model.steps_["taken"].iloc[1]
    assert "as asked" in str(model)


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"readable": 7}, "readable is 7; it must be True, False or a share of error from 0 to 2: 0.07 for 7 %"),
        ({"readable": "yes"}, "readable is 'yes'; it must be True, False or a share"),
        ({"readable_rules": 0}, "readable_rules is 0; it must be a whole number of 1 or more, or None"),
        ({"readable_rules": True}, "readable_rules is True"),
        ({"n_jobs": 0}, "n_jobs is 0; it must be a number of threads of 1 or more"),
    ],
)
def test_parameters_that_mean_nothing_are_refused(waves, parameters, message):
    with pytest.raises(ValueError, match=message.replace("(", r"\(")):
        LocalLinearTreeRegressor(**parameters).fit(*waves)


def test_a_wrong_name_of_a_parameter_does_not_print_the_tree(usual):
    with pytest.raises(ValueError, match="Invalid parameter 'nonsense' for estimator LocalLinearTreeRegressor") as caught:
        usual.set_params(nonsense=3)
    assert "rules  terms" not in str(caught.value)


def test_importance_is_the_rise_of_the_error_without_an_input(waves, usual):
    frame = usual.importance_
    assert list(frame["input"])[:2] == ["x0", "x1"]
    assert frame["increase"].iloc[0] > 2 * frame["standard_error"].iloc[0] > 0
    noise = frame[frame["input"].isin(["x2", "x3"])]
    assert (noise["increase"].abs() < 0.1).all()


def test_importance_on_given_rows_is_that_of_brute_force(waves, usual):
    X, y = waves
    X, y = X[:200], y[:200]
    found = usual.permutation_importance(X, y, n_repeats=30).set_index("input")
    random = np.random.default_rng(0)
    before = np.mean((usual.predict(X) - y) ** 2)
    for j in range(4):
        squares = []
        for _ in range(30):
            other = X.copy()
            other[:, j] = random.permutation(other[:, j])
            squares.append(np.mean((usual.predict(other) - y) ** 2))
        rise = np.sqrt(np.mean(squares)) - np.sqrt(before)
        row = found.loc[f"x{j}"]
        assert abs(row["increase"] - rise) < 0.05 * rise + 3 * row["standard_error"] / np.sqrt(30) + 1e-12


def test_importance_is_drawn_with_its_whiskers(usual):
    pytest.importorskip("matplotlib").use("Agg")
    axes = usual.plot_importance()
    assert axes.get_xlabel() == "RMSE of y grows by"
    assert len(axes.patches) == 4


def test_a_sum_of_trees_refuses_exports_with_a_reason():
    from llmt import BoostedLocalLinearTreeRegressor

    random = np.random.default_rng(1)
    X = random.normal(size=(60, 2))
    model = BoostedLocalLinearTreeRegressor().fit(X, X[:, 0])
    for export in (model.to_sql, model.to_onnx):
        with pytest.raises(ValueError):
            export("t", keep=["id"])
