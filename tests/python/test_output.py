"""What people see of a model: tables, text and HTML."""

import re
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import HOSTILE, Fitted, stepped
from llmt._facts import coverage_of
from llmt._frames import Table, candidates_frame, curves, leaves_frame, mean_baseline, rules_frame
from llmt._html import tree_html
from llmt._layout import fitted, items_of, layout_of
from llmt._text import tree_text
from llmt._tree import Tree, decimal


def column(table, name):
    return list(table[name])


# Tables


def test_standard_errors_of_a_leaf_are_those_of_least_squares():
    X, y = stepped(300)
    of = Fitted(X, y, folds=0)
    table = leaves_frame(of.model, of.handle)
    leaf_of = of.handle.leaf_of(X)[:, 0]
    assert len(table) == 2
    for k in range(2):
        A = np.column_stack([np.ones((leaf_of == k).sum()), X[leaf_of == k]])
        coefficients, rss = np.linalg.lstsq(A, y[leaf_of == k], rcond=None)[:2]
        errors = np.sqrt(rss[0] / (len(A) - 4) * np.diag(np.linalg.inv(A.T @ A)))
        names = ["intercept", "coef(x0)", "coef(x1)", "coef(x2)"]
        se = ["intercept_se", "se(x0)", "se(x1)", "se(x2)"]
        assert column(table, "rows")[k] == len(A)
        np.testing.assert_allclose([column(table, name)[k] for name in names], coefficients, rtol=1e-6, atol=1e-8)
        # The residuals of the model are those of its guarded predictions, which may differ at the outermost rows.
        np.testing.assert_allclose([column(table, name)[k] for name in se], errors, rtol=1e-2)


def test_a_coefficient_that_the_rows_of_a_leaf_do_not_determine_has_no_standard_error():
    rng = np.random.default_rng(7)
    X = np.column_stack([np.repeat([0.0, 1.0], 100), rng.normal(size=200)])
    y = np.where(X[:, 0] > 0.5, 3 + X[:, 1], -2 * X[:, 1]) + 0.1 * rng.normal(size=200)
    of = Fitted(X, y, folds=0, max_leaves=2, rule="rd")
    table = leaves_frame(of.model)
    assert len(table) == 2
    assert np.isnan(column(table, "se(x0)")).all()
    assert np.isnan(column(table, "intercept_se")).all()  # the value at x0 = 0 goes with it
    assert np.isfinite(column(table, "se(x1)")).all()


@pytest.mark.parametrize("name", ["crisp", "hostile", "large"])
def test_rules_are_those_of_the_library(name, request):
    of = request.getfixturevalue(name)
    text = re.sub(r"\n {4,}", " ", of.handle.rules_text("model", 100))
    rules = rules_frame(of.model, of.handle)
    for k in range(len(rules)):
        number, conditions = column(rules, "rule")[k], column(rules, "if")[k]
        assert f"Rule {number} ({column(rules, 'rows')[k]} rows," in text
        assert f": if {conditions}\n  {column(rules, 'then')[k]}\n" in text


def test_rules_of_a_smooth_model_are_refused(smooth):
    with pytest.raises(ValueError, match="blended"):
        rules_frame(smooth.model)


def test_candidates_name_least_squares_the_mean_and_one_choice(crisp):
    mean = mean_baseline(crisp.y, crisp.fit.held_out())
    table = candidates_frame(crisp.summary, mean)
    partition = crisp.summary["partitions"][0]
    errors = dict(zip(column(table, "model"), column(table, "rmse")))
    assert errors["least squares"] == partition["cv_rmse_least_squares"]
    assert errors["mean"] == mean[0][0] > errors["least squares"]
    assert [error for error, chosen in zip(column(table, "rmse"), column(table, "chosen")) if chosen] == [
        partition["cv_rmse"]
    ]
    assert column(table, "rmse") == sorted(column(table, "rmse"))


def test_the_mean_is_that_of_the_other_folds():
    rmse, spread = mean_baseline([0.0, 0.0, 6.0], [[0, 1], [2]], weights=[1, 1, 2])
    # 6 predicted for the rows 0 and 1, 0 for row 2, which counts twice.
    assert rmse == pytest.approx([6.0]) and spread == pytest.approx([0.0])
    assert np.isnan(mean_baseline([1.0, 2.0], [])[0]).all()


def test_curves_are_the_errors_of_the_summary(crisp):
    of = curves(crisp.summary)["force"]
    assert of["rmse_by_leaves"][0] == crisp.summary["partitions"][0]["cv_rmse_least_squares"]
    assert of["leaves"].tolist() == list(range(1, len(of["rmse_by_leaves"]) + 1))


def test_tables_without_pandas(crisp, monkeypatch):
    monkeypatch.setitem(sys.modules, "pandas", None)
    table = leaves_frame(crisp.model)
    assert isinstance(table, Table)
    assert table["leaf"] == [row["leaf"] for row in table]
    assert repr(table).splitlines()[0].split()[:3] == ["target", "leaf", "where"]


def test_coverage_is_judged_by_the_other_folds():
    folds = [{"residuals": [[1.0, 2.0, 3.0, 10.0]]}, {"residuals": [[1.0, 2.0, 3.0, 4.0]]}]
    # Level 0.6 of 4 others: their third smallest, 3.
    level, shares = coverage_of({"intervals": folds, "outputs": [{}]}, 0.6)
    assert (level, shares.tolist()) == (0.6, [0.75])
    assert coverage_of({"intervals": folds, "outputs": [{}]}, 0.99) is None
    assert coverage_of({"outputs": [{}]}) is None


# Numbers and drawings


def test_numbers_have_the_digits_that_they_need():
    assert [decimal(x) for x in (0.1, 1 / 3, -2.0, 1e-7, 123456.789)] == ["0.1", "0.33333", "-2", "1e-07", "123456.789"]
    assert decimal(0.7325349, 0.002) == "0.733"


def test_a_short_equation_predicts_to_its_promise(crisp):
    tree = Tree(crisp.model)
    leaf_of = crisp.handle.leaf_of(crisp.X)[:, 0]
    reach = crisp.y.max() - crisp.y.min()
    for leaf in tree.leaves:
        terms, left_out = tree.short_equation(leaf)
        said = eval(re.sub(r"(\d) ([abc])", r"\1*\2", " ".join(terms)), dict(zip("abc", crisp.X.T)))
        full = leaf.intercept[0] + crisp.X @ leaf.slope[0]
        inside = leaf_of == leaf.number - 1
        # Each coefficient may move the prediction by 0.1 %.
        assert np.abs(said - full)[inside].max() < 4e-3 * reach


def test_a_cut_tree_has_every_row_once(large):
    tree = Tree(large.model)
    items = items_of(tree, 32)
    drawn = [item for item in items if item.leaf]
    assert any(item.is_cut for item in drawn) and len(drawn) <= 16
    assert sum(item.leaf.rows for item in drawn) == len(large.X)
    assert sum(tree.leaves_below(item.node) for item in drawn) == len(tree.leaves)


@pytest.mark.parametrize("name", ["crisp", "hostile", "smooth", "large"])
def test_nothing_overlaps(name, request):
    layout = layout_of(Tree(request.getfixturevalue(name).model), 75.0)
    leaves = [item for item in layout.items if item.leaf]
    for above, below in zip(leaves, leaves[1:]):
        assert above.middle + above.height / 2 < below.middle - below.height / 2
    # Branches that end at the same depth have room for a line above and one below.
    for depth in range(1, len(layout.columns)):
        middles = sorted(item.middle for item in layout.items if item.depth == depth)
        assert all(b - a > 2.5 for a, b in zip(middles, middles[1:]))
    assert layout.columns == sorted(layout.columns) and layout.columns[-1] < 0.6 * layout.width


def test_text_is_cut_to_its_width():
    assert fitted("short", 20.0) == "short"
    assert fitted("w" * 1000, 10.0).endswith("…") and len(fitted("w" * 1000, 10.0)) < 12


# HTML and text


def elements_of(html):
    """Raises for HTML that is not well-formed."""
    root = ElementTree.fromstring(html.replace("&nbsp;", " "))
    return [element for element in root.iter()]


@pytest.mark.parametrize("name", ["crisp", "hostile", "smooth", "large"])
def test_html_shows_tree_error_and_coverage(name, request):
    of = request.getfixturevalue(name)
    html = tree_html(of.model, of.summary)
    elements = elements_of(html)
    words = " ".join(filter(None, (text for element in elements for text in (element.text, element.tail))))
    assert len(html.encode()) < 100_000
    assert {element.tag for element in elements} <= {"div", "svg", "g", "text", "title", "rect", "line", "circle"}
    assert "http" not in html and "url(" not in html
    assert "least squares" in words and "prediction intervals hold" in words
    if name == "smooth":
        assert "Transitions are smooth" in words
    if name == "crisp":
        for leaf in Tree(of.model).leaves:
            assert f"{leaf.number}: {leaf.rows} rows" in words


def test_names_are_escaped_and_do_not_turn_the_line(hostile):
    html = tree_html(hostile.model, hostile.summary)
    assert "<script" not in html and "\u202e" not in html and "\u2066" not in html
    X, y = stepped(100)
    arabic = Fitted(X, y, names=[HOSTILE[3], "b", "c"])
    assert f"\u2068{HOSTILE[3]}\u2069" in tree_html(arabic.model)


def test_many_targets_stay_small():
    rng = np.random.default_rng(8)
    X = rng.normal(size=(200, 3))
    of = Fitted(
        X, np.abs(X) @ rng.normal(size=(3, 9)), folds=0, max_leaves=20, outputs=[f"t{k}" * 40 for k in range(9)]
    )
    html = tree_html(of.model, of.summary)
    assert len(html.encode()) < 100_000 and "3 further targets" in html


@pytest.mark.parametrize("name", ["crisp", "hostile", "smooth", "large"])
def test_text_is_the_twin_of_the_html(name, request):
    of = request.getfixturevalue(name)
    text = tree_text(of.model, of.summary)
    assert all(f"{item.leaf.rows} rows" in text for item in items_of(Tree(of.model)) if item.leaf)
    assert max(map(len, text.splitlines())) <= 100
    assert ("smooth" in text) == (name == "smooth")


def test_thresholds_that_differ_are_drawn_differently():
    rng = np.random.default_rng(9)
    x = np.concatenate([rng.uniform(-1000, 1000, 300), rng.uniform(-1, 1, 300)])
    y = np.where(np.abs(x) < 1, np.sign(x) * (1 + np.abs(x)), 0.001 * x) + 0.01 * rng.normal(size=len(x))
    of = Fitted(x[:, None], y, validity="crisp")
    tree = Tree(of.model)
    thresholds = {node["split"]["threshold"] for node in tree.nodes if "split" in node}
    assert len(thresholds) > 2 and min(np.diff(sorted(thresholds))) < 0.002 * 2000
    assert len({item.how.split()[1] for item in items_of(tree) if item.how}) == len(thresholds)
