"""Whether a table has the columns that an estimator was fitted with, in the words of scikit-learn."""

import warnings
from typing import Any

import numpy as np

from ._tables import Table

_shown_names = 5


def remember_columns(estimator: Any, table: Table) -> None:
    """Sets n_features_in_, and feature_names_in_ where the columns have names."""
    estimator.n_features_in_ = table.values.shape[1]
    if table.names is not None:
        estimator.feature_names_in_ = np.asarray(table.names, dtype=object)
    elif hasattr(estimator, "feature_names_in_"):
        del estimator.feature_names_in_


def check_columns(estimator: Any, table: Table) -> None:
    """Raises ValueError where names, their order or the number of columns differ from those of fit."""
    who = type(estimator).__name__
    fitted = getattr(estimator, "feature_names_in_", None)
    if fitted is not None and table.names is not None:
        _check_names(list(fitted), table.names)
    elif fitted is not None:
        warnings.warn(f"X does not have valid feature names, but {who} was fitted with feature names", stacklevel=4)
    elif table.names is not None:
        warnings.warn(f"X has feature names, but {who} was fitted without feature names", stacklevel=4)
    columns = table.values.shape[1]
    if columns != estimator.n_features_in_:
        raise ValueError(
            f"X has {columns} features, but {who} is expecting {estimator.n_features_in_} features as input."
        )


def _check_names(fitted: list[str], given: list[str]) -> None:
    if fitted == given:
        return
    message = "The feature names should match those that were passed during fit.\n"
    unseen = sorted(set(given) - set(fitted))
    missing = sorted(set(fitted) - set(given))
    message += _listed("Feature names unseen at fit time:\n", unseen)
    message += _listed("Feature names seen at fit time, yet now missing:\n", missing)
    if not unseen and not missing:
        message += "Feature names must be in the same order as they were in fit.\n"
    raise ValueError(message)


def _listed(title: str, names: list[str]) -> str:
    if not names:
        return ""
    lines = [f"- {name}\n" for name in names[:_shown_names]]
    if len(names) > _shown_names:
        lines.append("- ...\n")
    return title + "".join(lines)
