"""Where the parts of a drawn tree stand. Lengths are in em, the size of the letters.

The tree lies on its side: the root on the left, a row for each leaf on the right, with its equation. A branch has what
is compared above it and the value below.
"""

from __future__ import annotations

import unicodedata
from dataclasses import dataclass, field

from ._tree import Leaf, Tree, number

MOST_LEAVES = 32
MOST_DEPTH = 9
LINE = 1.25  # height of a line of text
GAP = 1.0  # between leaves
ROUNDED_NOTE = "Numbers are rounded to some 0.1 % of the ranges; leaves_ has all their digits."
CUT_NOTE = (
    "Only the first splits are drawn. A dashed box has the equation of all rows that reach it; the tree goes on there."
)
_ELLIPSIS = "\N{HORIZONTAL ELLIPSIS}"
_NARROW, _WIDE = frozenset("il.,;:|'!jtfr()[]{} I\"-"), frozenset("mwMW@%_")


@dataclass
class Item:
    """A drawn node: a split, a leaf with its texts, or the first node of a part that is left out (`is_cut`)."""

    node: int
    parent: int | None  # position in Layout.items
    depth: int
    what: str = ""  # the condition on the branch that leads here
    how: str = ""
    full_condition: str = ""
    lines: list[str] = field(default_factory=list)  # a leaf's equations
    note: str = ""  # rows, error, and what is left out
    full: str = ""  # all that the lines shorten
    leaf: Leaf | None = None
    level: float = 0.5  # of a leaf: the mean prediction of its first target, from 0, the smallest, to 1
    is_cut: bool = False
    middle: float = 0.0  # from above
    height: float = 0.0

    @property
    def is_split(self) -> bool:
        return self.leaf is None


@dataclass
class Layout:
    items: list[Item]  # parents before children
    columns: list[float]  # where the nodes of each depth stand; the leaves' texts stand at the last
    width: float
    height: float
    levels: tuple[float, float]  # the mean predictions that Item.level 0 and 1 stand for
    notes: list[str]  # sentences that belong below the picture


def em(text: str) -> float:
    """About the width of a text, rather too large."""
    width = 0.0
    for letter in text:
        if unicodedata.combining(letter) or unicodedata.category(letter) == "Cf":
            continue
        if unicodedata.east_asian_width(letter) in "WF":
            width += 1.0
        else:
            width += 0.36 if letter in _NARROW else 0.95 if letter in _WIDE else 0.7 if letter.isupper() else 0.6
    return 1.03 * width


def fitted(text: str, width: float) -> str:
    """The text, with an ellipsis where it is cut to the width."""
    text = text[:400]
    if em(text) <= width:
        return text
    while text and em(text) + 0.8 > width:
        text = text[:-1]
    return text.rstrip() + _ELLIPSIS


def layout_of(tree: Tree, width: float, most_leaves: int = MOST_LEAVES, most_depth: int = MOST_DEPTH) -> Layout:
    """The drawing of a tree. Of one with more than `most_leaves` the first splits are drawn, about half as many; a
    branch that goes on has the equation of all rows there, and says how many leaves are left out."""
    items = items_of(tree, most_leaves, most_depth)
    columns = _columns(items, width)
    leaf_width = width - columns[-1] - 2.2
    predictions = [tree.mean_prediction(item.leaf) for item in items if item.leaf]
    low, high = min(predictions), max(predictions)
    at = GAP / 2
    for item in items:  # they go down the left side first, so leaves come from above
        if item.leaf is None:
            continue
        _describe(tree, item, leaf_width)
        item.level = (tree.mean_prediction(item.leaf) - low) / (high - low) if high > low else 0.5
        item.height = (len(item.lines) + 1) * LINE
        item.middle = at + item.height / 2
        at += item.height + GAP
    for position in reversed(range(len(items))):
        if items[position].is_split:
            of = [item.middle for item in items[position + 1 :] if item.parent == position]
            items[position].middle = sum(of) / len(of)
    return Layout(items, columns, width, at - GAP / 2, (low, high), notes_of(tree, items))


def notes_of(tree: Tree, items: list[Item]) -> list[str]:
    """What a drawing leaves out: digits, and parts of the tree."""
    return ([] if tree.is_short else [ROUNDED_NOTE]) + ([CUT_NOTE] if any(item.is_cut for item in items) else [])


def items_of(tree: Tree, most_leaves: int = MOST_LEAVES, most_depth: int = MOST_DEPTH) -> list[Item]:
    """The nodes that are drawn, with their conditions; those of leaves come from left to right."""
    if len(tree.leaves) > most_leaves:
        most_leaves = (most_leaves + 1) // 2
    drawn_nodes = 2 * most_leaves - 1  # nodes are in the order of growth: these are the tree with so many leaves
    tolerances = None if tree.is_short else tree.threshold_tolerances(drawn_nodes)
    leaf_at = {leaf.node: leaf for leaf in tree.leaves}
    items: list[Item] = []
    waiting: list[Item] = [Item(0, None, 0)]
    while waiting:
        item = waiting.pop()
        position = len(items)
        items.append(item)
        item.leaf = leaf_at.get(item.node)
        if item.leaf:
            continue
        split = tree.nodes[item.node]["split"]
        if max(split["left"], split["right"]) >= drawn_nodes or item.depth >= most_depth:
            item.leaf, item.is_cut = tree.as_leaf(item.node), True
            continue
        for left in (False, True):
            what, how = tree.condition(item.node, left, tolerances)
            full = str(tree.condition(item.node, left))
            child = split["left"] if left else split["right"]
            waiting.append(
                Item(child, position, item.depth + 1, what, how.replace("<=", "\N{LESS-THAN OR EQUAL TO}"), full)
            )
    return items


def _columns(items: list[Item], width: float) -> list[float]:
    depth = max(item.depth for item in items)
    wanted = [
        max(min(11.0, max(em(item.what), 1.08 * em(item.how))) for item in items if item.depth == d) + 1.6
        for d in range(1, depth + 1)
    ]
    widest = _widest(wanted, 0.5 * width)
    columns = [0.6]
    for column in wanted:
        columns.append(columns[-1] + min(column, widest))
    for item in items:
        if item.parent is not None:
            space = columns[item.depth] - columns[item.depth - 1] - 0.9
            item.what, item.how = fitted(item.what, space), fitted(item.how, space / 1.08)  # how it compares is bold
    return columns


def _widest(wanted: list[float], room: float) -> float:
    """The width that columns are cut to, so that they fit into the room and narrow ones keep theirs."""
    left = room
    for k, column in enumerate(sorted(wanted)):
        share = left / (len(wanted) - k)
        if column > share:
            return share
        left -= column
    return max(wanted, default=0.0)


def _describe(tree: Tree, item: Item, width: float) -> None:
    leaf = item.leaf
    assert leaf is not None
    most_targets = 4
    most_lines = 8 if tree.is_short else 3 if len(tree.targets) == 1 else 2
    left_out = 0
    for o, target in enumerate(tree.targets[:most_targets]):
        terms, smaller = tree.short_equation(leaf, o)
        lines, cut = _wrapped(f"{fitted(target, 9.0)} = ", terms, width, most_lines)
        item.lines += lines
        left_out = max(left_out, smaller + cut)
    if len(tree.targets) > most_targets:
        item.lines.append(f"{_ELLIPSIS} {len(tree.targets) - most_targets} more targets")
    errors = ", ".join(number(rmse, 3) for rmse in leaf.rmse[:most_targets])
    item.note = f"{leaf.number}: {_count(leaf.rows, 'row')}, RMSE {errors}"
    if item.is_cut:
        item.note = (
            f"{_ELLIPSIS} {_count(leaf.rows, 'row')}, RMSE {errors}; goes on to {tree.leaves_below(item.node)} leaves"
        )
    if left_out:
        item.note += f"; {_count(left_out, 'smaller term')} not shown"
    item.note = fitted(item.note, width / 0.92)  # in smaller letters
    where = f"Leaf {leaf.number}: {' and '.join(leaf.conditions) or 'everywhere'}"
    item.full = "\n".join(
        ["The equation of all rows here" if item.is_cut else fitted(where, 150.0)]
        + [
            f"{target} = {' '.join(tree.equation(leaf, o))}"[:500]
            for o, target in enumerate(tree.targets[:most_targets])
        ]
    )


def _wrapped(head: str, terms: list[str], width: float, most_lines: int) -> tuple[list[str], int]:
    """The terms in lines of a width, and how many do not fit."""
    lines, line = [], head + terms[0]
    for k, term in enumerate(terms[1:], start=1):
        if em(line) + 0.36 + em(term) > width:
            lines.append(line)
            if len(lines) == most_lines:
                return [_minus(line, width) for line in lines], len(terms) - k
            line = "    " + term
        else:
            line += " " + term
    return [_minus(line, width) for line in [*lines, line]], 0


def _minus(line: str, width: float) -> str:
    line = fitted(line, width)
    for before in (" ", "    "):
        line = line.replace(f"{before}- ", f"{before}\N{MINUS SIGN} ")
    return line.replace("= -", "= \N{MINUS SIGN}", 1)


def _count(count: int, what: str) -> str:
    return f"{count} {what}" if count == 1 else f"{count} {what}s"
