"""What a summary says of a fit, in the words that the pictures, the notebook and the terminal share."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np

from ._frames import kind_of
from ._tree import Tree, decimal, number


@dataclass
class Facts:
    """The facts of one partition."""

    heading: str  # "y: 13 leaves with smooth transitions"
    validity: str  # how leaves share the space, a sentence
    errors: list[tuple[str, float, float]]  # name, held-out RMSE, its spread over the folds; the model comes first
    how: str  # how the errors came to be
    coverage: str  # of the prediction intervals; empty: not known
    reading: dict[str, Any] | None = None  # the readable tree of the summary, if it is the model


def facts_of(
    model: dict[str, Any],
    tree: Tree,
    summary: dict[str, Any] | None,
    position: int,
    coverage: Any = None,
    mean: Any = None,
    readable: bool = False,
) -> Facts:
    """`tree`: the partition at `position`. `coverage`: (level, share of held-out rows within the intervals, for each
    target of the model or for all of them); None: `coverage_of(model)`. `mean`: what `mean_baseline` returned, for all
    targets of the model. `readable`: the model is the readable tree of the summary."""
    names = ", ".join(tree.targets)
    count = len(tree.leaves)
    heading = f"{names}: {count} {'leaf' if count == 1 else 'leaves'}"
    if count > 1:
        heading += " with smooth transitions" if tree.is_smooth else ", crisp"
    facts = Facts(heading, _validity(tree), [], "", "")
    outputs = tree.partition["outputs"]
    if summary and position < len(summary.get("partitions", [])):  # streams and files have no comparison
        of = summary["partitions"][position]
        trees = [r for r in summary.get("readable", []) if r["targets"] == of["targets"]]
        _errors(facts, of, trees, readable)
        facts.reading = trees[0] if readable and trees else None
        if mean is not None and len(outputs) == 1 and facts.errors:
            rmse, spread = (float(np.ravel(values)[outputs[0]]) for values in mean)
            facts.errors.append(("mean of the rows", rmse, spread))
    coverage = coverage_of(model) if coverage is None else coverage
    if coverage is not None:
        level, shares = coverage
        shares = np.broadcast_to(np.ravel(shares), len(outputs)) if np.size(shares) == 1 else np.ravel(shares)[outputs]
        inside = ", ".join(f"{100.0 * share:.1f} %" for share in (shares if len(set(shares)) > 1 else shares[:1]))
        facts.coverage = f"{100.0 * level:g} % prediction intervals hold {inside} of held-out rows"
    return facts


def coverage_of(model: dict[str, Any], level: float = 0.9) -> tuple[float, np.ndarray] | None:
    """About how many held-out rows the prediction intervals hold, for each target; None if the model does not say.

    A row of a fold counts as held if the residual of its fold's model is at most the m-th smallest of the residuals of
    all other folds, m = ceil(level (N + 1)) of N: the folds are judged by one another, so the share may be below the
    level. (I.2) also has the differences between the folds' models, and is therefore rather wider. Residuals are those
    of the file, divided by the spread of the errors; a single fold has parts, which stand for folds.
    """
    folds = [part for fold in model.get("intervals") or [] for part in fold.get("parts", [fold])]
    shares = []
    for o in range(len(model["outputs"])):
        of_folds = [
            np.array(fold["residuals"][o] + fold.get("residuals_incomplete", [[]] * (o + 1))[o]) for fold in folds
        ]
        held = 0
        for k, own in enumerate(of_folds):
            others = np.sort(np.concatenate([[], *of_folds[:k], *of_folds[k + 1 :]]))
            rank = math.ceil(level * (len(others) + 1))
            if not 1 <= rank <= len(others):
                return None
            held += int((own <= others[rank - 1]).sum())
        count = sum(map(len, of_folds))
        if count == 0:
            return None
        shares.append(held / count)
    return level, np.array(shares)


def _errors(facts: Facts, of: dict[str, Any], readable: list[dict[str, Any]], is_readable: bool) -> None:
    chosen = of["chosen"]
    if of["cv_rmse"] is None:
        errors = ", ".join(number(rmse) for rmse in of["train_rmse"])
        facts.how = (
            f"No rows were held out, so nothing says how well the tree predicts new ones. RMSE in training: {errors}"
        )
        return
    facts.errors.append((kind_of(chosen), of["cv_rmse"], chosen["spread"] or 0.0))
    for simple in readable:
        facts.errors.insert(0 if is_readable else 1, ("readable tree", simple["cv_rmse"], simple["spread"]))
    name, rmse, spread = facts.errors[0]
    facts.errors[0] = (f"this model: {name}", rmse, spread)
    least_squares = of["compared"][0] if of["compared"] else None
    if least_squares and least_squares != chosen and of["cv_rmse_least_squares"] is not None:
        facts.errors.append(("least squares", of["cv_rmse_least_squares"], least_squares["spread"] or 0.0))
    folds = of["cv_folds"]
    many = "" if len(of["targets"]) == 1 else ", in standard deviations of the targets"
    facts.how = (f"{folds} folds" if folds > 1 else "rows held out once") + many


def _validity(tree: Tree) -> str:
    validity = tree.partition["validity"]
    if len(tree.leaves) == 1:
        return "One equation holds everywhere."
    if validity["kind"] == "crisp":
        return "Each prediction is the equation of one leaf."
    text = "Transitions are smooth: near a threshold a prediction is a mean of the equations on both sides."
    jumps = []
    for node in range(len(tree.nodes)):
        split = tree.nodes[node].get("split")
        if split and validity["kind"] == "blend" and split.get("half_width") == 0.0 and "direction" not in split:
            if split["threshold"] < float(np.finfo(float).max):
                jumps.append(f"{tree.inputs[split['column']]['name']} = {decimal(split['threshold'])}")
    jumps = list(dict.fromkeys(jumps))
    if jumps:
        rest = f" and {len(jumps) - 5} more" if len(jumps) > 5 else ""
        text += f" It jumps at {', '.join(jumps[:5])}{rest}."
    return text
