"""Pictures with matplotlib. Every function takes `ax=None` and returns the axes that it drew on."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np

from ._explanation import Explanation
from ._facts import facts_of
from ._frames import curves
from ._layout import MOST_LEAVES, layout_of
from ._tree import Tree, level_names, number, shown, trees
from .tables import UNKNOWN

_BLUE, _ORANGE, _GREY = "#2f86d1", "#d2603a", "#8c8c8c"
_WIDTH = 9.0  # inches
_EM = 8.0  # points
_MINUS = "\N{MINUS SIGN}"
_MOST_POINTS = 5000


def pyplot_of() -> Any:
    try:
        import matplotlib.pyplot as pyplot
    except ImportError as error:
        raise ImportError("pictures need matplotlib: pip install matplotlib") from error
    return pyplot


def _axes(ax: Any, size: tuple[float, float] = (6.0, 4.0)) -> Any:
    return ax if ax is not None else pyplot_of().subplots(figsize=size, layout="constrained")[1]


def plot_tree(
    model: dict[str, Any],
    summary: dict[str, Any] | None = None,
    ax: Any = None,
    target: str | int = 0,
    most_leaves: int = MOST_LEAVES,
    readable: bool = False,
) -> Any:
    """The tree with the conditions on its branches and the equations in its leaves.

    The numbers of a readable tree stand as they are. Others have the digits that a prediction to 0.1 % of the target's
    range needs, which is said below the picture; `leaves_frame` has them all. Of a tree with more than `most_leaves`
    only the first splits are drawn. `target`: name or position of a target.
    """
    tree = _tree_of(model, target)
    wide = _WIDTH * 72.0 / _EM
    layout = layout_of(tree, wide, most_leaves)
    if ax is None:
        height = (layout.height + 3.5) * _EM / 72.0
        ax = pyplot_of().subplots(figsize=(_WIDTH, height), layout="constrained")[1]
    box = ax.get_window_extent().transformed(ax.figure.dpi_scale_trans.inverted())
    size = min(_EM * 1.25, box.width * 72.0 / wide, box.height * 72.0 / (layout.height + 0.5))
    layout = layout_of(tree, max(wide, box.width * 72.0 / size), most_leaves)
    ax.set_xlim(0.0, layout.width)
    ax.set_ylim(max(layout.height, box.height * 72.0 / size - 0.5), -0.5)
    ax.set_axis_off()
    from ._draw_tree import draw  # matplotlib is imported by now

    draw(ax, layout, size)
    facts = facts_of(model, tree, summary, _partition_of(model, target), readable=readable)
    title = facts.heading
    if facts.errors:
        title += "; held-out RMSE " + ", ".join(f"{number(rmse)} ({name})" for name, rmse, _ in facts.errors)
    ax.set_title(title, loc="left", fontsize=size * 1.15, parse_math=False)
    for line, note in enumerate(layout.notes):
        ax.text(0.0, layout.height + 0.6 + 1.3 * line, note, fontsize=size * 0.9, va="top", alpha=0.7)
    return ax


def plot_predicted(
    observed: Any, predicted: Any, ax: Any = None, name: str = "y", rows: str = "rows held out", weights: Any = None
) -> Any:
    """Predictions against observations, with the line where they agree; `rows` says which they are of. Of more than
    5000 rows every k-th is drawn; the errors in the title are those of all."""
    y, f = np.ravel(np.asarray(observed, dtype=float)), np.ravel(np.asarray(predicted, dtype=float))
    w = np.ones(len(y)) if weights is None else np.asarray(weights, dtype=float)
    ax = _axes(ax, (4.6, 4.4))
    rmse = math.sqrt(np.average((f - y) ** 2, weights=w))
    about = np.average((y - np.average(y, weights=w)) ** 2, weights=w)
    step = -(-len(y) // _MOST_POINTS)
    ends = [min(y.min(), f.min()), max(y.max(), f.max())]
    ax.axline((ends[0], ends[0]), slope=1.0, color=_GREY, lw=1.0, zorder=1)
    size = float(np.clip(3000.0 / max(len(y), 1), 4.0, 22.0))
    ax.scatter(f[::step], y[::step], s=size, color=_BLUE, alpha=0.45, linewidths=0, zorder=2)
    _label(ax, f"predicted {shown(name)}", f"observed {shown(name)}")
    r2 = f", R² {1.0 - rmse**2 / about:.3f}" if about > 0.0 else ""
    ax.set_title(f"{len(y)} {rows}: RMSE {number(rmse)}{r2}", fontsize="medium", parse_math=False)
    return ax


def plot_curve(
    handle: Any,
    name: str,
    ax: Any = None,
    at: Mapping[str, Any] | None = None,
    target: str | int = 0,
    coverage: float | None = 0.9,
    places: int = 200,
    sample: Any = None,
) -> Any:
    """The prediction along one input, from its smallest to its largest value in training, or at each of its categories.

    The other inputs have their means, categories their commonest value in `sample` (rows of training); without rows
    categories are missing. `at` gives other values or labels by name. `coverage`:
    level of the band of prediction intervals; None: no band. Bands are there if the model has intervals.
    """
    columns = handle.inputs()
    names = [column["name"] for column in columns]
    if name not in names:
        raise ValueError(f"there is no input {name!r}; there are {', '.join(names)}")
    point = np.array([_no_category(column) if level_names(column) else column["centre"] for column in columns])
    common = {} if sample is None or len(sample) < 2 else _commonest(
        columns, np.asarray(sample), {name, *(at or {})} | {of for of, is_used in zip(names, handle.used_inputs()) if not is_used}
    )
    for other, code in common.items():
        point[names.index(other)] = code
    for other, value in (at or {}).items():
        if other not in names:
            raise ValueError(f"at: there is no input {other!r}; there are {', '.join(names)}")
        point[names.index(other)] = _code(columns[names.index(other)], value)
    position = names.index(name)
    levels = level_names(columns[position])
    codes = columns[position]["codes"]
    xs = np.array([*codes, math.nan][: len(levels)]) if len(codes) else np.arange(len(levels), dtype=float)
    if not levels:
        xs = np.linspace(columns[position]["low"], columns[position]["high"], places)
    rows = np.tile(point, (len(xs), 1))
    rows[:, position] = xs
    output = _output_of(handle.outputs(), target)
    predicted = handle.predict(rows)[:, output]
    ax = _axes(ax)
    band = None
    level = 0.0 if coverage is None else coverage
    if level and handle.has_intervals:
        try:
            band = [bound[:, output] for bound in handle.intervals(rows, level)[:2]]
        except ValueError:
            band = None  # too few held-out rows for this level
    if levels:
        xs = np.arange(len(levels), dtype=float)
        if band:
            ax.vlines(xs, band[0], band[1], color=_BLUE, alpha=0.35, lw=6, label=f"{100 * level:g} % interval")
        ax.plot(xs, predicted, "o", color=_BLUE)
        ax.margins(x=0.08, y=0.2)
        ax.set_xticks(xs, [shown(level, 20) for level in levels], parse_math=False)
        if sum(len(shown(level, 20)) + 2 for level in levels) > 60:
            ax.tick_params("x", rotation=90 if len(levels) > 12 else 30)
    else:
        if band:
            ax.fill_between(xs, *band, color=_BLUE, alpha=0.18, lw=0, label=f"{100 * level:g} % interval")
        ax.plot(xs, predicted, color=_BLUE, lw=1.8)
    if band:
        ax.legend(frameon=False, fontsize="small")
    _label(ax, shown(name), shown(handle.outputs()[output]))
    held = {other: _label_of(columns[names.index(other)], code) for other, code in common.items()} | dict(at or {})
    others = ", ".join([*(f"{shown(key)} = {value}" for key, value in held.items()), "others at their means"])
    ax.set_title(f"Prediction along {shown(name)}, {others}", fontsize="medium", parse_math=False)
    return ax


def _commonest(columns: Any, sample: np.ndarray, without: set[str]) -> dict[str, float]:
    """The commonest value of each category in the rows."""
    result = {}
    for j, column in enumerate(columns):
        present = sample[~np.isnan(sample[:, j]), j]
        if level_names(column) and column["name"] not in without and len(present):
            values, counts = np.unique(present, return_counts=True)
            result[column["name"]] = float(values[counts.argmax()])
    return result


def _label_of(column: Mapping[str, Any], code: float) -> str:
    return number(code) if len(column["codes"]) else str(shown(level_names(dict(column))[int(code)], 20))


def plot_importance(names: Sequence[str], importance: Any, ax: Any = None, most: int = 20) -> Any:
    """Bars of the inputs' shares of what the model adds up, the largest on top.

    `importance`: what `_core.Model.importance(rows)` returned (the mean size of the contributions as shares of 1) for
    one target, or several targets x inputs, of which the mean is shown.
    """
    shares = np.asarray(importance, dtype=float).reshape(-1, len(names)).mean(axis=0)
    order = np.argsort(-shares, kind="stable")
    rest = order[most:]
    order = order[:most]
    ax = _axes(ax, (6.0, 0.9 + 0.27 * len(order)))
    at = np.arange(len(order))
    ax.barh(at, 100.0 * shares[order], color=_BLUE, height=0.7)
    ax.set_yticks(at, [shown(names[k], 28) for k in order], parse_math=False)
    ax.invert_yaxis()
    for k, share in zip(at, shares[order]):
        ax.annotate(
            f"{100 * share:.1f}",
            (100.0 * share, k),
            xytext=(3, 0),
            textcoords="offset points",
            va="center",
            fontsize="small",
        )
    ax.margins(x=0.12)
    ax.set_xlabel("share of the contributions, %")
    ax.set_title("Importance" + (f", without {len(rest)} smaller ones" if len(rest) else ""), fontsize="medium")
    _clear(ax)
    return ax


def plot_error_over_leaves(
    summary: dict[str, Any], ax: Any = None, target: str | int = 0, readable: bool = False
) -> Any:
    """Held-out RMSE of crisp trees by their number of leaves, with least squares, the most accurate model and, if that
    is the model (`readable`), the readable tree."""
    partition = _summary_of(summary, target)
    name = ", ".join(partition["targets"])
    curve = curves({"partitions": [partition]})[name]
    ax = _axes(ax)
    ax.set_xlabel("leaves")
    ax.set_ylabel("RMSE on rows held out")
    ax.set_title(f"Error over the number of leaves, {shown(name)}", fontsize="medium", parse_math=False)
    _clear(ax)
    if partition["cv_rmse"] is None:
        ax.text(0.5, 0.5, "no rows were held out", transform=ax.transAxes, ha="center")
        return ax
    if len(curve["leaves"]) > 1:
        ax.plot(curve["leaves"], curve["rmse_by_leaves"], color=_GREY, lw=1.4, label="crisp trees")
    chosen = partition["chosen"]
    least_squares = partition["cv_rmse_least_squares"]
    if least_squares is not None and math.isfinite(least_squares):
        ax.axhline(least_squares, color=_ORANGE, lw=1.0, ls="--", label=f"least squares: {number(least_squares)}")
    ax.errorbar(
        chosen["leaves"], chosen["cv_rmse"], yerr=chosen["spread"] or 0.0, fmt="o", color=_BLUE, capsize=3, zorder=3,
        label=f"{'most accurate' if readable else 'this model'}, with the spread of folds: {number(chosen['cv_rmse'])}",
    )  # fmt: skip
    for simple in summary.get("readable", []) if readable else []:
        if simple["targets"] == partition["targets"]:
            ax.errorbar(
                simple["leaves"], simple["cv_rmse"], yerr=simple["spread"] or 0.0, fmt="s", color=_ORANGE, capsize=3,
                zorder=3, label=f"this model, readable: {number(simple['cv_rmse'])}",
            )  # fmt: skip
    ax.set_ylim(bottom=0.0)
    ax.set_xscale("log")
    ax.xaxis.set_major_formatter("{x:g}")
    ax.xaxis.set_minor_formatter("")
    ax.legend(frameon=False, fontsize="small")
    return ax


def plot_waterfall(
    explanation: Explanation, ax: Any = None, row: int = 0, target: str | int = 0, most: int = 12
) -> Any:
    """How the contributions of the inputs lead from the base value to the prediction of one row."""
    one = explanation[row] if np.ndim(explanation.data) == 2 else explanation
    if np.ndim(one.values) == 2:
        one = one[:, target]
    values, names = np.asarray(one.values, dtype=float), list(one.feature_names)
    order = np.argsort(-np.abs(values), kind="stable")
    labels = [f"{shown(names[k], 24)} = {_value(one.data[k])}" for k in order[:most]]
    steps = values[order[:most]].tolist()
    if len(order) > most:
        labels.append(f"{len(order) - most} others")
        steps.append(float(values[order[most:]].sum()))
    base = float(one.base_values)
    ends = base + np.cumsum([0.0, *steps])
    ax = _axes(ax, (7.0, 1.2 + 0.3 * len(steps)))
    for k, step in enumerate(steps):
        ax.barh(k, step, left=ends[k], color=_BLUE if step >= 0.0 else _ORANGE, height=0.62)
        ax.plot([ends[k + 1]] * 2, [k - 0.31, min(k + 1.31, len(steps) - 0.69)], color=_GREY, lw=0.8)
        text = f"{'+' if step >= 0 else _MINUS}{number(abs(step), 3)}"
        ax.annotate(
            text,
            (max(ends[k], ends[k + 1]), k),
            xytext=(5, 0),
            textcoords="offset points",
            va="center",
            fontsize="small",
        )
    ax.axvline(base, color=_GREY, lw=0.8, ls=":")
    ax.set_yticks(np.arange(len(steps)), labels, parse_math=False)
    ax.invert_yaxis()
    ax.use_sticky_edges = False
    ax.margins(x=0.15)
    output = shown(one.output_names[0])
    ax.set_xlabel(
        f"{output}, from the base value {number(base)} (dotted) to the prediction {number(float(ends[-1]))}",
        parse_math=False,
    )
    ax.set_title(f"Contributions to {output} = {number(float(ends[-1]))}", fontsize="medium", parse_math=False)
    _clear(ax)
    return ax


def plot_increase(
    names: Sequence[str], increase: Any, errors: Any, ax: Any = None, most: int = 20, name: str = "the target"
) -> Any:
    """Bars of how much the error grows without each input, with whiskers of two standard errors, the largest on top.
    Grey: within them."""
    increase, errors = (np.asarray(values, dtype=float) for values in (increase, errors))
    order = np.argsort(-increase, kind="stable")
    rest = order[most:]
    order = order[:most]
    ax = _axes(ax, (6.0, 0.9 + 0.27 * len(order)))
    at = np.arange(len(order))
    beyond = increase[order] > 2.0 * errors[order]
    colours = [_BLUE if is_beyond else "#b8c0c8" for is_beyond in beyond]
    ax.barh(at, increase[order], xerr=2.0 * errors[order], color=colours, ecolor="#5b6875", height=0.7)
    ax.set_yticks(at, [shown(names[k], 28) for k in order], parse_math=False)
    ax.invert_yaxis()
    ax.set_xlabel(f"RMSE of {shown(name, 28)} grows by", parse_math=False)
    ax.set_title("What matters" + (f", without {len(rest)} smaller ones" if len(rest) else ""), fontsize="medium")
    _clear(ax)
    return ax


def plot_all(
    model: dict[str, Any],
    summary: dict[str, Any],
    names: Sequence[str],
    importance: Any,
    observed: Any,
    predicted: Any,
    target: str | int = 0,
    rows: str = "rows held out",
    readable: bool = False,
) -> Any:
    """A figure of four: the tree, predicted against observed, the error over the number of leaves, and importances.
    Returns the axes in this order."""
    pyplot = pyplot_of()
    tree = _tree_of(model, target)
    layout = layout_of(tree, 11.0 * 72.0 / _EM, 16)
    tree_height = max(1.5, (layout.height + 4.0) * _EM / 72.0 * 0.95)
    figure = pyplot.figure(figsize=(11.0, tree_height + 3.9), layout="constrained")
    grid = figure.add_gridspec(2, 3, height_ratios=[tree_height, 3.9])
    above = figure.add_subplot(grid[0, :])
    below = [figure.add_subplot(grid[1, k]) for k in range(3)]
    plot_predicted(observed, predicted, below[0], tree.targets[0], rows)
    plot_error_over_leaves(summary, below[1], target, readable)
    if isinstance(importance, tuple):
        inputs, increase, errors = importance
        plot_increase(inputs, increase, errors, below[2], 12, tree.targets[0])
    else:
        plot_importance(names, importance, below[2], 12)
    figure.draw_without_rendering()  # the tree's letters follow the size of its axes
    plot_tree(model, summary, above, target, 16, readable)
    return [above, *below]


def _no_category(column: Mapping[str, Any]) -> float:
    """What stands for no category: a missing value, or, where that is a level, a position that is none."""
    has_empty_level = not len(column["codes"]) and column["levels"][-1] == ""
    return UNKNOWN if has_empty_level else math.nan


def _label(ax: Any, x: str, y: str) -> None:
    ax.set_xlabel(x, parse_math=False)
    ax.set_ylabel(y, parse_math=False)
    _clear(ax)


def _clear(ax: Any) -> None:
    for side in ("top", "right"):
        ax.spines[side].set_visible(False)


def _value(value: Any) -> str:
    if value is None or (not isinstance(value, str) and math.isnan(float(value))):
        return "missing"
    return shown(value, 20) if isinstance(value, str) else number(float(value))


def _code(column: Mapping[str, Any], value: Any) -> float:
    levels = level_names(dict(column))
    if not levels or len(column["codes"]):
        return float(value)
    if str(value) not in levels:
        raise ValueError(f"at: {column['name']} has no value {value!r}; it has {', '.join(levels[:10])}")
    return float(levels.index(str(value)))


def _output_of(names: Sequence[str], target: str | int) -> int:
    if isinstance(target, str) and target not in names:
        raise ValueError(f"there is no target {target!r}; there are {', '.join(names)}")
    return names.index(target) if isinstance(target, str) else target


def _summary_of(summary: dict[str, Any], target: str | int) -> dict[str, Any]:
    names = [name for partition in summary["partitions"] for name in partition["targets"]]
    wanted = names[_output_of(names, target)]
    return next(partition for partition in summary["partitions"] if wanted in partition["targets"])


def _partition_of(model: dict[str, Any], target: str | int) -> int:
    output = _output_of([of["name"] for of in model["outputs"]], target)
    return next(p for p, of in enumerate(model["partitions"]) if output in of["outputs"])


def _tree_of(model: dict[str, Any], target: str | int) -> Tree:
    return trees(model, lambda name: shown(name, 24))[_partition_of(model, target)]
