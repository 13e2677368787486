"""Explanations and pictures."""

import pickle
import sys
from xml.etree import ElementTree

import numpy as np
import pytest
from conftest import HOSTILE, Fitted, stepped
from llmt._explanation import Explanation, explanation_of
from llmt._layout import items_of
from llmt._tree import Tree


@pytest.mark.parametrize("name", ["crisp", "hostile", "smooth"])
def test_contributions_add_up(name, request):
    of = request.getfixturevalue(name)
    explanation = explanation_of(of.handle, of.X[:50])
    total = explanation.values.sum(axis=1) + explanation.base_values
    np.testing.assert_allclose(total, of.handle.predict(of.X[:50])[:, 0], rtol=0, atol=1e-9)


def test_an_explanation_has_labels_names_and_indices(hostile):
    explanation = explanation_of(hostile.handle, hostile.X[:20])
    assert explanation.feature_names == HOSTILE[:3]
    assert explanation.data[0, 1] == [HOSTILE[0], HOSTILE[2], "green"][int(hostile.X[0, 1])]
    assert explanation[3].values.shape == (3,) and explanation[2:5].data.shape == (3, 3)
    assert explanation[:, HOSTILE[1]].values.tolist() == explanation.values[:, 1].tolist()
    assert "prediction" in repr(explanation[0]) and "<script" not in explanation[0]._repr_html_()
    ElementTree.fromstring(explanation[:1]._repr_html_())
    again = pickle.loads(pickle.dumps(explanation))
    assert isinstance(again, Explanation) and (again.values == explanation.values).all()


def test_an_explanation_of_several_targets():
    X, y = stepped(200)
    of = Fitted(X, np.column_stack([y, X[:, 0]]), outputs=["force", "way"])
    explanation = explanation_of(of.handle, X[:7])
    assert explanation.values.shape == (7, 3, 2) and explanation.base_values.shape == (7, 2)
    one = explanation[..., "way"]
    np.testing.assert_allclose(one.values.sum(axis=1) + one.base_values, of.handle.predict(X[:7])[:, 1], atol=1e-9)
    assert "force" in repr(explanation[2]) and one.output_names == ["way"]


@pytest.mark.parametrize("plot", ["waterfall", "beeswarm", "bar", "scatter"])
@pytest.mark.parametrize("converted", [False, True])
def test_shap_plots_explanations(plot, converted, hostile):
    pytest.importorskip("matplotlib").use("agg")
    shap = pytest.importorskip("shap")
    explanation = explanation_of(hostile.handle, hostile.X[:30])
    taken = explanation.to_shap() if converted else explanation
    taken = {"waterfall": lambda: taken[0], "scatter": lambda: taken[:, 0]}.get(plot, lambda: taken)()
    getattr(shap.plots, plot)(taken, show=False)
    import matplotlib.pyplot

    assert matplotlib.pyplot.gcf().axes
    matplotlib.pyplot.close("all")


def test_pictures_come_out(hostile, smooth, large, tmp_path):
    matplotlib = pytest.importorskip("matplotlib")
    matplotlib.use("agg")
    from llmt import _plots

    def drawn(axes):
        figure = axes.figure
        figure.savefig(tmp_path / "picture.png", dpi=20)
        matplotlib.pyplot.close("all")
        return axes

    for of in (hostile, smooth, large):
        axes = drawn(_plots.plot_tree(of.model, of.summary))
        texts = [text.get_text() for text in axes.texts]
        assert sum("RMSE" in text for text in texts) == sum(item.leaf is not None for item in items_of(Tree(of.model)))
        drawn(_plots.plot_error_over_leaves(of.summary))
    bars = drawn(_plots.plot_importance(HOSTILE[:3], hostile.handle.importance(hostile.X)))
    assert sum(bar.get_width() for bar in bars.patches) == pytest.approx(100.0)
    drawn(_plots.plot_predicted(smooth.y, smooth.handle.predict(smooth.X), name=HOSTILE[4]))
    curve = drawn(_plots.plot_curve(smooth.handle, "x0", at={"x1": 0.5}))
    x, y = curve.lines[0].get_data()
    np.testing.assert_allclose(smooth.handle.predict(np.column_stack([x, np.full(len(x), 0.5)]))[:, 0], y)
    drawn(_plots.plot_curve(hostile.handle, HOSTILE[1]))
    drawn(_plots.plot_curve(hostile.handle, HOSTILE[0], at={HOSTILE[1]: "green"}))
    drawn(_plots.plot_waterfall(explanation_of(hostile.handle, hostile.X[:3])))
    four = _plots.plot_all(
        smooth.model, smooth.summary, ["x0", "x1"], [[0.4, 0.6]], smooth.y, smooth.handle.predict(smooth.X)
    )
    assert len(four) == 4
    drawn(four[0])
    with pytest.raises(ValueError, match="there is no input 'z'; there are x0, x1"):
        _plots.plot_curve(smooth.handle, "z")
    axes = matplotlib.pyplot.subplots()[1]
    assert _plots.plot_tree(smooth.model, ax=axes) is axes
    matplotlib.pyplot.close("all")


def test_what_is_not_installed_is_named(crisp, monkeypatch):
    from llmt import _plots

    monkeypatch.setitem(sys.modules, "matplotlib.pyplot", None)
    with pytest.raises(ImportError, match="pip install matplotlib"):
        _plots.plot_error_over_leaves(crisp.summary)
    monkeypatch.setitem(sys.modules, "shap", None)
    with pytest.raises(ImportError, match="pip install shap"):
        explanation_of(crisp.handle, crisp.X[:2]).to_shap()
