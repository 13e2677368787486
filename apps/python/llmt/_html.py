"""A fitted model in a notebook: the drawn tree with its equations, held-out error and interval coverage.

One piece of HTML with inline SVG: no script, no style sheet, nothing from the network. Text has the colour of its
surroundings and everything else a colour that is visible on white and on black, so that light and dark themes need no
rules of their own.
"""

from __future__ import annotations

import html
import unicodedata
from collections.abc import Sequence
from typing import Any

from ._facts import Facts, facts_of
from ._layout import LINE, MOST_LEAVES, Item, Layout, layout_of
from ._tree import Tree, decimal, number, shown, trees

WIDTH = 900.0  # px
_EM = 12.0  # px
_ACCENT, _OTHER = "#2f86d1", "#9a9a9a"
COLOURS = ((72, 94, 176), (39, 140, 156), (84, 170, 96), (214, 160, 44))  # from small to large predictions
_MOST_PARTITIONS = 6
_FONTS = "system-ui,'Segoe UI',Helvetica,Arial,sans-serif"
_STYLE = f"max-width:{WIDTH:.0f}px;font:13px/1.5 {_FONTS};text-align:left"


def tree_html(
    model: dict[str, Any],
    summary: dict[str, Any] | None = None,
    coverage: Any = None,
    mean: Any = None,
    readable: bool = False,
) -> str:
    """The model as HTML for `_repr_html_`: below 100 kB for any model.

    `model` and `summary`: JSON of the model file and of the fit. `coverage`: (level, share of held-out rows within the
    intervals; one number, or one for each target); None: as the model's own residuals say. `mean`: what
    `mean_baseline` returned, a bar beside least squares. `readable`: the model is the readable tree of the summary. Of
    many targets six are drawn, of a large tree the first sixteen leaves in the order of growth.
    """
    of_partitions = trees(model, _isolated)
    drawn = of_partitions[:_MOST_PARTITIONS]
    most_leaves = max(4, MOST_LEAVES // len(drawn))
    parts = []
    for position, tree in enumerate(drawn):
        facts = facts_of(model, tree, summary, position, coverage, mean, readable)
        layout = layout_of(tree, WIDTH / _EM, most_leaves)
        notes = f'<div style="opacity:.8">{" ".join(layout.notes)}</div>' if layout.notes else ""
        parts.append(_head(tree, facts, summary) + _bars(facts) + _svg(tree, layout) + notes)
    if len(of_partitions) > len(drawn):
        parts.append(
            f"<div>\N{HORIZONTAL ELLIPSIS} and the trees of {len(of_partitions) - len(drawn)} further targets</div>"
        )
    return f'<div class="llmt-tree" dir="ltr" style="{_STYLE}">' + "".join(parts) + "</div>"


def bar_rows(title: str, rows: Sequence[tuple[str, float]], signed: bool = False) -> str:
    """Names with bars and numbers, the first 20 of them: HTML for the contributions of inputs."""
    most = 20
    name_width, bar_width, row, top = 300.0, 400.0, 20.0, 4.0
    largest = max((abs(value) for _, value in rows), default=0.0) or 1.0
    has_negative = any(value < 0.0 for _, value in rows)
    zero = name_width + (bar_width / 2 + 80 if has_negative else 0.0)
    scale = (bar_width / 2 if has_negative else bar_width) / largest
    parts = []
    for k, (name, value) in enumerate(rows[:most]):
        y = top + row * k
        length = max(1.0, abs(value) * scale)
        begin = zero - length if value < 0.0 else zero
        colour = _ACCENT if value >= 0.0 else "#d2603a"
        parts.append(_text(name_width - 8, y + 13, name, anchor="end"))
        parts.append(f'<rect x="{begin:.1f}" y="{y + 3:.0f}" width="{length:.1f}" height="13" rx="2" fill="{colour}"/>')
        text = f"{'+' if signed and value >= 0.0 else ''}{number(value)}".replace("-", "\N{MINUS SIGN}", 1)
        at = begin - 6 if value < 0.0 else zero + length + 6
        parts.append(_text(at, y + 13, text, anchor="end" if value < 0.0 else "start"))
    if has_negative:
        parts.append(_line(zero, top, zero, top + row * len(rows[:most]), 1.0, 0.4))
    more = f"<div>\N{HORIZONTAL ELLIPSIS} and {len(rows) - most} smaller ones</div>" if len(rows) > most else ""
    picture = _picture(parts, WIDTH, top + row * len(rows[:most]) + 4, title)
    return f'<div dir="ltr" style="{_STYLE}"><div style="font-weight:600">{_safe(title)}</div>{picture}{more}</div>'


def _isolated(name: str) -> str:
    """A name as it is shown: one that is written from right to left does not turn what stands beside it."""
    clean = shown(name, 24)
    if any(unicodedata.bidirectional(letter) in ("R", "AL", "AN") for letter in clean):
        return f"\N{FIRST STRONG ISOLATE}{clean}\N{POP DIRECTIONAL ISOLATE}"
    return clean


def _head(tree: Tree, facts: Facts, summary: dict[str, Any] | None) -> str:
    lines = [f'<div style="font-size:15px;font-weight:600;margin-top:6px">{_safe(facts.heading)}</div>']
    text = facts.validity
    if facts.coverage:
        text += f" {facts.coverage}."
    if summary and "rows" in summary:
        rows, inputs = summary["rows"], len(tree.inputs)
        text += f" Learnt from {rows} rows with {inputs} input{'' if inputs == 1 else 's'}."
    if facts.how and not facts.errors:
        text += f" {facts.how}."
    return "".join(lines) + f'<div style="opacity:.8;margin-bottom:4px">{_safe(text)}</div>'


def _bars(facts: Facts) -> str:
    """The held-out errors of the model and of others, as bars."""
    if not facts.errors:
        return ""
    name_width, bar_width, row, top = 190.0, 420.0, 20.0, 20.0
    largest = max(rmse + spread for _, rmse, spread in facts.errors) or 1.0
    height = top + row * len(facts.errors) + 6
    parts = [_text(0, 13, f"Held-out RMSE ({facts.how}; lines: spread of the folds)", opacity=0.8)]
    for k, (name, rmse, spread) in enumerate(facts.errors):
        y = top + row * k
        length, reach = bar_width * rmse / largest, bar_width * spread / largest
        colour = _ACCENT if k == 0 else _OTHER
        parts.append(_text(name_width - 8, y + 13, name, anchor="end", weight=600 if k == 0 else 400))
        parts.append(
            f'<rect x="{name_width:.0f}" y="{y + 3:.0f}" width="{max(1.0, length):.1f}" height="13" rx="2" '
            f'fill="{colour}"/>'
        )
        begin, end = name_width + max(0.0, length - reach), name_width + length + reach
        parts.append(_line(begin, y + 9.5, end, y + 9.5, 1.5, 0.75))
        parts.append(_text(end + 8, y + 13, number(rmse), weight=600 if k == 0 else 400))
    return _picture(parts, WIDTH, height, "Held-out errors")


def _svg(tree: Tree, layout: Layout) -> str:
    parts: list[str] = []
    top = 1.6
    if len(tree.leaves) > 1:
        parts += _legend(tree, layout)
    for item in layout.items:
        parts += _branch(layout, item, top)
        parts += _split(layout, item, top) if item.is_split else _leaf(layout, item, top)
    height = (layout.height + top) * _EM + 4
    return _picture(parts, WIDTH, height, f"The tree of {', '.join(tree.targets)}")


def _legend(tree: Tree, layout: Layout) -> list[str]:
    low, high = (decimal(level, 0.01 * (layout.levels[1] - layout.levels[0])) for level in layout.levels)
    right = WIDTH - 4
    parts = [_text(right, 11, high, anchor="end", size=11, opacity=0.8)]
    right -= 8 + 7 * len(high)
    for k in range(24):
        parts.append(f'<rect x="{right - 96 + 4 * k:.0f}" y="3" width="4.3" height="9" fill="{_colour(k / 23)}"/>')
    text = f"mean prediction of {tree.targets[0]} in a leaf: {low}"
    parts.append(_text(right - 104, 11, text, anchor="end", size=11, opacity=0.8))
    return parts


def _branch(layout: Layout, item: Item, top: float) -> list[str]:
    """The line from the parent's stem to the node, with its condition; on to the texts of a leaf."""
    y = (item.middle + top) * _EM
    begin = layout.columns[item.depth - 1] * _EM if item.parent is not None else 0.0
    here = layout.columns[item.depth] * _EM
    parts = [_line(begin, y, here, y, 1.4, 0.45)] if item.parent is not None else []
    if not item.is_split and layout.columns[-1] * _EM > here:
        parts.append(_line(here, y, layout.columns[-1] * _EM, y, 1.2, 0.3, "2 4"))
    if item.parent is not None:
        parts.append(f"<g><title>{_safe(item.full_condition[:300])}</title>")
        parts.append(_text(begin + 6, y - 4, item.what, size=11.5))
        parts.append(_text(begin + 6, y + 13, item.how, size=11.5, weight=600) + "</g>")
    return parts


def _split(layout: Layout, item: Item, top: float) -> list[str]:
    position = layout.items.index(item)
    x = layout.columns[item.depth] * _EM
    of = [(child.middle + top) * _EM for child in layout.items if child.parent == position]
    dot = f'<circle cx="{x:.1f}" cy="{(item.middle + top) * _EM:.1f}" r="3" fill="currentColor" fill-opacity=".6"/>'
    return [_line(x, min(of), x, max(of), 1.4, 0.45), dot]


def _leaf(layout: Layout, item: Item, top: float) -> list[str]:
    x = layout.columns[-1] * _EM
    y = (item.middle + top) * _EM - item.height * _EM / 2
    width, height = WIDTH - x - 2, item.height * _EM + 4
    border = 'stroke-opacity=".5" stroke-dasharray="3 3"' if item.is_cut else 'stroke-opacity=".15"'
    parts = [
        f'<rect x="{x:.1f}" y="{y - 2:.1f}" width="{width:.1f}" height="{height:.1f}" rx="4" fill="currentColor" '
        f'fill-opacity=".06" stroke="currentColor" {border}/>',
        f'<rect x="{x:.1f}" y="{y - 2:.1f}" width="6" height="{height:.1f}" rx="2" fill="{_colour(item.level)}"/>',
    ]
    for k, line in enumerate(item.lines):
        indent = 1.4 * _EM if line.startswith(" ") else 0.0
        parts.append(_text(x + 13 + indent, y + (k * LINE + 0.95) * _EM, line.strip()))
    parts.append(_text(x + 13, y + (len(item.lines) * LINE + 0.9) * _EM, item.note, size=11, opacity=0.7))
    return [f"<g><title>{_safe(item.full)}</title>", *parts, "</g>"]


def _picture(parts: list[str], width: float, height: float, label: str) -> str:
    return (
        f'<svg role="img" aria-label="{_safe(label)}" viewBox="0 0 {width:.0f} {height:.0f}" width="{width:.0f}" '
        f'height="{height:.0f}" style="max-width:100%;height:auto;display:block;margin:4px 0" '
        f'font-family="{_FONTS}">' + "".join(parts) + "</svg>"
    )


def _text(
    x: float,
    y: float,
    text: str,
    anchor: str = "start",
    size: float = _EM,
    opacity: float = 1.0,
    weight: int = 400,
) -> str:
    more = "" if anchor == "start" else f' text-anchor="{anchor}"'
    more += "" if opacity == 1.0 else f' fill-opacity="{opacity}"'
    more += "" if weight == 400 else f' font-weight="{weight}"'
    return f'<text x="{x:.1f}" y="{y:.1f}" font-size="{size:g}" fill="currentColor"{more}>{_safe(text)}</text>'


def _line(x1: float, y1: float, x2: float, y2: float, width: float, opacity: float, dashes: str = "") -> str:
    more = f' stroke-dasharray="{dashes}"' if dashes else ""
    return (
        f'<line x1="{x1:.1f}" y1="{y1:.1f}" x2="{x2:.1f}" y2="{y2:.1f}" stroke="currentColor" stroke-width="{width}" '
        f'stroke-opacity="{opacity}"{more}/>'
    )


def _colour(level: float) -> str:
    at = min(max(level, 0.0), 1.0) * (len(COLOURS) - 1)
    k = min(int(at), len(COLOURS) - 2)
    return "#" + "".join(f"{round(a + (at - k) * (b - a)):02x}" for a, b in zip(COLOURS[k], COLOURS[k + 1]))


def _safe(text: str) -> str:
    return html.escape(text, quote=True)
