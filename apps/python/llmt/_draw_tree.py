"""The drawing of a tree on axes of matplotlib."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from matplotlib.colors import LinearSegmentedColormap
from matplotlib.patches import Rectangle

from ._html import COLOURS
from ._layout import LINE, Layout


def draw(ax: Any, layout: Layout, size: float) -> None:
    """Draws in em, with letters of `size` points."""

    colour = ax.yaxis.label.get_color()
    scale = LinearSegmentedColormap.from_list("llmt", [[part / 255.0 for part in rgb] for rgb in COLOURS])
    right = layout.columns[-1]

    def line(x: Sequence[float], y: Sequence[float], alpha: float = 0.5, style: Any = "-") -> None:
        ax.plot(x, y, color=colour, alpha=alpha, lw=0.11 * size, ls=style, solid_capstyle="butt")

    def text(
        x: float,
        y: float,
        words: str,
        share: float = 1.0,
        alpha: float = 1.0,
        weight: str = "normal",
        va: str = "baseline",
    ) -> None:
        ax.text(
            x, y, words, fontsize=size * share, color=colour, alpha=alpha, fontweight=weight, va=va, parse_math=False
        )

    for position, item in enumerate(layout.items):
        here = layout.columns[item.depth]
        if item.parent is not None:
            begin = layout.columns[item.depth - 1]
            line([begin, here], [item.middle] * 2)
            text(begin + 0.5, item.middle - 0.3, item.what, 0.95)
            text(begin + 0.5, item.middle + 0.25, item.how, 0.95, weight="bold", va="top")
        if item.is_split:
            of = [child.middle for child in layout.items if child.parent == position]
            line([here, here], [min(of), max(of)])
            ax.plot([here], [item.middle], "o", color=colour, alpha=0.6, ms=0.45 * size)
            continue
        if right > here:
            line([here, right], [item.middle] * 2, 0.35, (0, (1, 3)))
        top = item.middle - item.height / 2
        border = {"edgecolor": colour, "linewidth": 0.8, "linestyle": (0, (3, 2)), "alpha": 0.6} if item.is_cut else {}
        box = (right, top - 0.15), layout.width - right - 0.2, item.height + 0.3
        ax.add_patch(Rectangle(*box, facecolor=colour, alpha=0.07, linewidth=0))
        if border:
            ax.add_patch(Rectangle(*box, fill=False, **border))
        ax.add_patch(Rectangle(box[0], 0.5, box[2], facecolor=scale(item.level), linewidth=0))
        for k, words in enumerate(item.lines):
            text(right + (2.4 if words.startswith(" ") else 1.0), top + k * LINE + 0.95, words.strip())
        text(right + 1.0, top + len(item.lines) * LINE + 0.9, item.note, 0.9, 0.7)
