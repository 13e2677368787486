"""A tree as one sum over its nodes, for engines without loops.

The validity V_A of a node A is the product of the gates on its path, and the validity of its parent is V_left +
V_right. So the sum of the guarded local models (M.2, B.2) over the leaves, each with the slopes of its ancestors,
telescopes into

    F(x) = sum over all nodes A of V_A(x) (value_A + sum_k slope_Ak c_Ak(d_k))

with c_Ak the deviation d_k held to the range of node A, and with the value and slopes of A taken as differences from
those of its parent. Where d_k is missing, slope_Ak c_Ak is the difference of slope times mean. The first term, that of
the root, is the root's model. The text of an export is then proportional to nodes times regressors.
"""

from dataclasses import dataclass

from .model import MOST_ANCESTORS, Floats, Partition


@dataclass(frozen=True)
class Terms:
    """What a node adds for one output, beside what its parent says."""

    value: float
    slope: Floats  # per regressor
    missing: Floats  # per regressor: in place of slope * held deviation where it is missing


def terms(partition: Partition, output: int) -> list[Terms]:
    """The terms of all nodes for one output (its position in the partition).

    Raises ValueError if a leaf has so many ancestors that the guard leaves some of them out.
    """
    result: list[Terms] = []
    for i, node in enumerate(partition.nodes):
        slope = node.slope[output]
        missing = [s * m for s, m in zip(slope, node.mean)]
        if node.parent < 0:
            result.append(Terms(node.value[output], slope, tuple(missing)))
            continue
        if len(partition.path(i)) > MOST_ANCESTORS + 1:
            raise ValueError(
                f"the tree is more than {MOST_ANCESTORS + 1} splits deep, which this export cannot express exactly; "
                "fit with fewer leaves (max_leaves), or export C or Python source"
            )
        parent = partition.nodes[node.parent]
        result.append(
            Terms(
                node.value[output] - parent.value[output],
                tuple(s - p for s, p in zip(slope, parent.slope[output])),
                tuple(m - s * p for m, s, p in zip(missing, parent.slope[output], parent.mean)),
            )
        )
    return result
