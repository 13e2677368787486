"""Local models and rules as people write them: constants times inputs, without the guards."""

import math
from dataclasses import dataclass

from .model import Model, Node


@dataclass(frozen=True)
class Term:
    slope: float
    regressor: int


def equation(model: Model, node: Node, output: int) -> tuple[float, list[Term]]:
    """The local model of a node for one output: its constant, and the terms whose slope is not 0.

    A number stands for itself in the terms, an indicator for 0 or 1, a product for the product of the deviations of its
    factors from their centres.
    """
    slopes = [Term(slope, k) for k, slope in enumerate(node.slope[output]) if slope != 0.0]
    return math.fsum([node.value[output]] + [-t.slope * model.regressors[t.regressor].centre for t in slopes]), slopes
