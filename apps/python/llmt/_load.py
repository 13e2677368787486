"""Model files of either kind."""

import json
import os

from ._boosted import BoostedLocalLinearTreeRegressor
from ._estimator import LocalLinearTreeRegressor


def load(path: "str | os.PathLike[str]") -> LocalLinearTreeRegressor | BoostedLocalLinearTreeRegressor:
    """The fitted estimator that a model file belongs to: one tree, or a sum of trees.

    The files are those of `save`, `llmt fit -o` and `llmt fit --boost -o`.

    >>> import tempfile
    >>> import numpy as np
    >>> from llmt import BoostedLocalLinearTreeRegressor, load
    >>> X = np.linspace(0, 1, 100).reshape(-1, 1)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     BoostedLocalLinearTreeRegressor().fit(X, X[:, 0] ** 2).save(f"{folder}/square.json")
    ...     load(f"{folder}/square.json")
    BoostedLocalLinearTreeRegressor()

    Raises
    ------
    ValueError
        If the file is no model; the message names the file and the place in it.
    """
    with open(path, encoding="utf-8") as file:
        try:
            content = json.load(file)
        except (ValueError, RecursionError) as error:
            raise ValueError(f"{os.fspath(path)}: no model, which is JSON text: {error}") from None
    is_boosted = isinstance(content, dict) and content.get("format") == "llmt-boosted-model"
    return (BoostedLocalLinearTreeRegressor if is_boosted else LocalLinearTreeRegressor).load(path)
