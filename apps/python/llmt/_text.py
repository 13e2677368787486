"""A fitted model on a terminal: what `tree_html` shows, in letters."""

from __future__ import annotations

import textwrap
from typing import Any

from ._facts import facts_of
from ._layout import MOST_LEAVES, Item, items_of, notes_of
from ._tree import Tree, number, shown, trees


def tree_text(
    model: dict[str, Any],
    summary: dict[str, Any] | None = None,
    coverage: Any = None,
    mean: Any = None,
    readable: bool = False,
    width: int = 80,
    most_leaves: int = MOST_LEAVES,
) -> str:
    """The model as text in lines of about `width` letters; the other arguments are those of `tree_html`.

    Coefficients and thresholds have the digits that the pictures have: those of a readable tree as they are, others
    rounded; `rules_frame` has them all.
    """
    parts = []
    for position, tree in enumerate(trees(model, lambda name: shown(name, 40))):
        facts = facts_of(model, tree, summary, position, coverage, mean, readable)
        lines = [facts.heading]
        sentences = [facts.validity, f"{facts.coverage}." if facts.coverage else ""]
        if facts.how and not facts.errors:
            sentences.append(f"{facts.how}.")
        lines += textwrap.wrap(" ".join(filter(None, sentences)), width)
        if facts.errors:
            has_spread = any(spread > 0.0 for _, _, spread in facts.errors)
            lines.append(f"Held-out RMSE ({facts.how}{'; +- the spread of the folds' if has_spread else ''}):")
            for name, rmse, spread in facts.errors:
                beside = f" +- {number(spread, 2):<8}" if has_spread else ""
                lines.append(f"  {number(rmse):>9}{beside} {name}")
        if facts.reading:
            lines += _steps(facts.reading["path"], facts.reading["taken"])
            for sentence in facts.reading["sentences"]:
                lines += textwrap.wrap(sentence, width)
        items = items_of(tree, most_leaves)
        lines += ["", *_tree_lines(tree, items, width)]
        if notes := " ".join(notes_of(tree, items)):
            notes = notes.replace("drawn", "shown").replace("A dashed box", 'What begins with "..."')
            lines += ["", *textwrap.wrap(notes, width)]
        parts.append("\n".join(lines))
    return "\n\n".join(parts)


# Rules that a person reads.
_MOST_READ_RULES = 12


def _steps(path: list[dict[str, Any]], taken: int) -> list[str]:
    """The readable trees that can be had, a line each, as `llmt fit --readable` prints them."""
    lines = ["  rules  terms per rule  size  RMSE held-out  above the model"]
    for k, step in enumerate(path):
        if step["leaves"] > _MOST_READ_RULES and k not in (taken, len(path) - 1):
            continue
        above = "" if step["above_model"] is None else f"{round(100.0 * step['above_model'])} %"
        line = f"  {step['leaves']:>5}  {step['most_terms']:>14}  {step['size']:>4}  {number(step['cv_rmse']):>13}  {above:>15}"
        lines.append(line.rstrip() + ("  taken" if k == taken else ""))
    return lines


def _tree_lines(tree: Tree, items: list[Item], width: int) -> list[str]:
    lines = []
    for item in items:
        indent = "|  " * max(0, item.depth - 1)
        condition = shown(f"{item.what} {item.how}", max(20, width - len(indent))).replace(
            "\N{LESS-THAN OR EQUAL TO}", "<="
        )
        head = indent + condition if item.depth else "everywhere" if item.leaf else ""
        if item.leaf is None:
            lines += [head] if head else []
            continue
        leaf = item.leaf
        errors = ", ".join(number(rmse, 3) for rmse in leaf.rmse)
        note = f"{leaf.rows} rows, RMSE {errors}"
        note = f"... {tree.leaves_below(item.node)} leaves, {note}" if item.is_cut else f"leaf {leaf.number}, {note}"
        lines += [f"{head}: {note}"] if len(head) + len(note) + 2 <= width else [f"{head}:", f"{indent}   {note}"]
        for o, target in enumerate(tree.targets):
            terms, left_out = tree.short_equation(leaf, o)
            if left_out:
                terms.append(f"+ {left_out} smaller term" + ("s" if left_out > 1 else ""))
            lines += _wrapped(f"{indent}   {target} = ", terms, f"{indent}       ", width)
    return lines


def _wrapped(line: str, terms: list[str], indent: str, width: int) -> list[str]:
    lines = []
    line += terms[0]
    for term in terms[1:]:
        if len(line) + 1 + len(term) > width:
            lines.append(line)
            line = indent + term
        else:
            line += " " + term
    return [*lines, line]
