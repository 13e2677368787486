"""Results as tables: pandas DataFrames where pandas is installed, lists of dicts where it is not."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from ._tree import number, trees


class Table(list[dict[str, Any]]):
    """Rows as dicts, for those who have no pandas. `table["column"]` is a list, `table[3]` a row."""

    def __init__(self, rows: Sequence[dict[str, Any]], columns: Sequence[str]) -> None:
        super().__init__(rows)
        self.columns = list(columns)

    def __getitem__(self, key: Any) -> Any:
        return [row[key] for row in self] if isinstance(key, str) else super().__getitem__(key)

    def __repr__(self) -> str:
        cells = [self.columns] + [[_cell(row[column]) for column in self.columns] for row in self]
        widths = [min(40, max(len(line[k]) for line in cells)) for k in range(len(self.columns))]
        return "\n".join(
            "  ".join(_padded(cell, width, k, is_header) for k, (cell, width) in enumerate(zip(line, widths)))
            for is_header, line in zip([True] + [False] * len(self), cells)
        )


def _cell(value: Any) -> str:
    return number(value) if isinstance(value, float) else str(value)


def _padded(cell: str, width: int, column: int, is_header: bool) -> str:
    cell = cell if len(cell) <= width else cell[: width - 3] + "..."
    return cell.ljust(width) if column == 0 or is_header else cell.rjust(width)


def table_of(rows: Sequence[dict[str, Any]], columns: Sequence[str] = ()) -> Any:
    """The rows as a pandas DataFrame, or as a Table without pandas. By default the columns are those of the first row."""
    columns = columns or list(rows[0])
    try:
        import pandas
    except ImportError:
        return Table(rows, columns)
    return pandas.DataFrame.from_records([[row[column] for column in columns] for row in rows], columns=list(columns))


def leaves_frame(model: dict[str, Any], handle: Any = None) -> Any:
    """One row for each leaf and target of a model: where it holds, how many rows it has, how well it fits them, and its
    equation.

    Columns: `target`; `leaf`, counted from 1 from left to right, as in `rules_frame` and in the pictures; `where`, the
    conditions; `rows` and `rmse` of training; `intercept` and `intercept_se`; then `coef(NAME)` and `se(NAME)` of
    every regressor. Standard errors are those of least squares within the leaf, for a tree that is taken as given:
    they do not know that the same rows chose the splits, and are too small. In a smooth model they take the other
    leaves as given as well. NaN: the leaf's rows do not determine the coefficient; it is then that of a larger region.
    """
    rows = []
    all_trees = trees(model, handle=handle)
    names = _merged(tree.regressor_names for tree in all_trees)
    for tree in all_trees:
        for leaf in tree.leaves:
            for o, target in enumerate(tree.targets):
                intercept_se, errors = tree.standard_errors(leaf, o)
                row = {
                    "target": target,
                    "leaf": leaf.number,
                    "where": " and ".join(leaf.conditions) or "everywhere",
                    "rows": leaf.rows,
                    "rmse": leaf.rmse[o],
                    "intercept": leaf.intercept[o],
                    "intercept_se": intercept_se,
                }
                for k, name in enumerate(tree.regressor_names):
                    row[f"coef({name})"] = float(leaf.slope[o, k])
                    row[f"se({name})"] = float(errors[k])
                rows.append(row)
    columns = ["target", "leaf", "where", "rows", "rmse", "intercept", "intercept_se"]
    return table_of(rows, columns + [f"{kind}({name})" for name in names for kind in ("coef", "se")])


def rules_frame(model: dict[str, Any], handle: Any = None) -> Any:
    """The rules of a model: `rule`, `if`, `then`, `rows`, `rmse`; one row for each leaf and target.

    A prediction is the equation of the one rule whose conditions hold. Raises ValueError for a smooth model: there it
    is a mean of the equations of several leaves, so that rules would not be the model.
    """
    rows = []
    for tree in trees(model, handle=handle):
        if tree.is_smooth:
            raise ValueError(
                f"the {len(tree.leaves)} leaves of {', '.join(tree.targets)} are blended: a prediction is a mean of "
                "several equations, so rules would not be the model. readable=True and validity='crisp' fit a tree "
                "that is its rules; leaves_ lists the leaves of this one"
            )
        for leaf in tree.leaves:
            for o, target in enumerate(tree.targets):
                rows.append(
                    {
                        "rule": leaf.number,
                        "if": " and ".join(leaf.conditions) or "everywhere",
                        "then": f"{target} = {' '.join(tree.equation(leaf, o))}",
                        "rows": leaf.rows,
                        "rmse": leaf.rmse[o],
                    }
                )
    return table_of(rows, ["rule", "if", "then", "rows", "rmse"])


def mean_baseline(
    outputs: Any, held_out: Sequence[Sequence[int]], weights: Any = None
) -> tuple[np.ndarray, np.ndarray]:
    """Held-out RMSE, and its spread over the folds, of predicting the mean of the rows outside of the fold.

    `outputs`: rows x targets. `held_out`: the rows of every fold, counted from 0 (`_core.Fit.held_out()`). The error
    that any model must beat. NaN without folds.
    """
    y = np.asarray(outputs, dtype=float).reshape(len(outputs), -1)
    w = np.ones(len(y)) if weights is None else np.asarray(weights, dtype=float)
    squares, shares, of_folds = np.zeros(y.shape[1]), 0.0, []
    for fold in held_out:
        rows = np.asarray(fold, dtype=int)
        others = np.ones(len(y), dtype=bool)
        others[rows] = False
        if not w[others].sum() or not w[rows].sum():
            continue
        error = w[rows] @ (y[rows] - w[others] @ y[others] / w[others].sum()) ** 2
        squares, shares = squares + error, shares + w[rows].sum()
        of_folds.append(np.sqrt(error / w[rows].sum()))
    if not of_folds:
        return np.full(y.shape[1], math.nan), np.full(y.shape[1], math.nan)
    spread = np.std(of_folds, axis=0, ddof=1) if len(of_folds) > 1 else np.zeros(y.shape[1])
    return np.sqrt(squares / shares), spread


def kind_of(candidate: dict[str, Any]) -> str:
    """What a candidate of the summary is, in words."""
    validity = candidate["validity"]
    if validity == "crisp" and candidate["leaves"] == 1:
        kind = "ridge regression" if candidate["shrinkage"] > 0.0 else "least squares"
    elif validity == "blend":
        kind = "smooth blend" if candidate["jump"] is None else "blend that keeps jumps"
    else:
        kind = {"crisp": "crisp tree", "gaussian": "Gaussians", "logistic": "smooth gates"}[validity]
    return kind + (", sparse" if candidate["sparse"] else "")


def candidates_frame(summary: dict[str, Any], mean: Any = None, readable: bool = False) -> Any:
    """What the fit compared on held-out rows, best first, for each target or group of targets that share a tree.

    Columns: `target`; `model`, the kind in words; `validity` and `width` of the transitions; `leaves`; `rmse`, of rows
    held out, and `spread`, the standard deviation of the folds' RMSE; `chosen`: the model that predicts, with `readable` the
    readable tree. The readable tree and the mean of the
    rows (the error of a model that knows no input; `mean`: what `mean_baseline` returned) are there if they are known.
    A chosen model may be a little worse than the best: of models that chance does not tell apart the simplest is taken.
    """
    rows: list[dict[str, Any]] = []
    position = 0
    for partition in summary["partitions"]:
        target = ", ".join(partition["targets"])
        chosen = partition["chosen"]
        compared = [chosen] + [other for other in partition["compared"] if other != chosen]
        of_partition = [
            _candidate(
                target, kind_of(c), c["validity"], c["width"], c["leaves"], c["cv_rmse"], c["spread"],
                c is chosen and not readable,
            )
            for c in compared
        ]
        if "other_terms" in partition:
            c = partition["other_terms"]
            terms = "linear" if summary["local_models"] == "quadratic" else "quadratic"
            kind = f"{kind_of(c)}, {terms} local models"
            of_partition.append(
                _candidate(target, kind, c["validity"], c["width"], c["leaves"], c["cv_rmse"], c["spread"], False)
            )
        for simple in summary.get("readable", []):
            if simple["targets"] == partition["targets"]:
                of_partition.append(
                    _candidate(
                        target,
                        "readable tree",
                        "crisp",
                        0.0,
                        simple["leaves"],
                        simple["cv_rmse"],
                        simple["spread"],
                        readable,
                    )
                )
        of_partition = [row for k, row in enumerate(of_partition) if row not in of_partition[:k]]
        size = len(partition["targets"])
        if mean is not None and size == 1:
            rmse, spread = (float(np.ravel(values)[position]) for values in mean)
            of_partition.append(_candidate(target, "mean", "crisp", 0.0, 1, rmse, spread, False))
        position += size
        rows += sorted(of_partition, key=lambda row: math.inf if math.isnan(row["rmse"]) else row["rmse"])
    return table_of(rows, ["target", "model", "validity", "width", "leaves", "rmse", "spread", "chosen"])


def steps_frame(summary: dict[str, Any]) -> Any:
    """A row for each step of the readable trees."""
    if "readable" not in summary:
        raise ValueError("steps_ are those of the readable tree: fit with readable=True")
    rows = []
    for tree in summary["readable"]:
        for k, step in enumerate(tree["path"]):
            rows.append(
                {
                    "target": ", ".join(tree["targets"]),
                    "rules": step["leaves"],
                    "terms": step["most_terms"],
                    "size": step["size"],
                    "rmse": step["cv_rmse"],
                    "spread": step["spread"],
                    "above_model": math.nan if step["above_model"] is None else step["above_model"],
                    "taken": k == tree["taken"],
                }
            )
    return table_of(rows, ["target", "rules", "terms", "size", "rmse", "spread", "above_model", "taken"])


def importance_frame(summary: dict[str, Any]) -> Any:
    """A row for each target and input of the summary's importances, the largest increase first."""
    rows: list[dict[str, Any]] = []
    for partition in summary["partitions"]:
        if "importance" not in partition:
            raise ValueError("importance_ is of held-out rows, and nothing was held out in the fit (cv=0)")
        for target, of_target in zip(partition["targets"], partition["importance"], strict=True):
            ordered = sorted(of_target, key=lambda row: -row["increase"])
            rows += [{"target": target, **row} for row in ordered]
    return table_of(rows, ["target", "input", "increase", "standard_error"])


def importance_rows(targets: list[str], inputs: list[str], increase: Any, errors: Any) -> Any:
    """The same of arrays, targets x inputs."""
    rows = []
    for o, target in enumerate(targets):
        for j in np.argsort(-increase[o], kind="stable"):
            row = {"increase": float(increase[o][j]), "standard_error": float(errors[o][j])}
            rows.append({"target": target, "input": inputs[j], **row})
    return table_of(rows, ["target", "input", "increase", "standard_error"])


def curves(summary: dict[str, Any]) -> dict[str, dict[str, np.ndarray]]:
    """Held-out errors against size, for each target (or targets that share a tree, joined by ", ").

    `leaves` and `rmse_by_leaves`: of crisp trees with 1, 2, ... leaves. `inputs` and `rmse_by_inputs`: with fewer and
    fewer inputs, in a quick comparison. Empty where nothing was compared.
    """
    result = {}
    for partition in summary["partitions"]:
        by_leaves = np.array(partition["crisp_cv_rmse_by_leaves"], dtype=float)
        steps = partition["cv_rmse_by_inputs"]
        result[", ".join(partition["targets"])] = {
            "leaves": np.arange(1, len(by_leaves) + 1),
            "rmse_by_leaves": by_leaves,
            "inputs": np.array([step["inputs"] for step in steps], dtype=int),
            "rmse_by_inputs": np.array([step["cv_rmse"] for step in steps], dtype=float),
        }
    return result


def _candidate(
    target: str, model: str, validity: str, width: float, leaves: int, rmse: Any, spread: Any, chosen: bool
) -> dict[str, Any]:
    return {
        "target": target,
        "model": model,
        "validity": validity,
        "width": float(width),
        "leaves": int(leaves),
        "rmse": math.nan if rmse is None else float(rmse),
        "spread": math.nan if spread is None else float(spread),
        "chosen": chosen,
    }


def _merged(lists: Any) -> list[str]:
    return list(dict.fromkeys(name for names in lists for name in names))
