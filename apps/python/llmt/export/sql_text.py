"""Pieces of the text of SQL."""


def number(value: float) -> str:
    """A literal that all dialects read as exactly this double."""
    text = repr(value)
    if "e" not in text:
        text += "e0"
    return f"({text})" if text.startswith("-") else text


def name_of(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


def string(text: str) -> str:
    return "'" + text.replace("'", "''") + "'"


def sum_of(parts: list[str]) -> str:
    """The sum as a balanced tree: databases limit the depth of an expression."""
    if len(parts) < 16:
        return "+".join(parts) or "0e0"
    half = len(parts) // 2
    return f"({sum_of(parts[:half])})+({sum_of(parts[half:])})"


def smooth_clamp(x: str, low: float, high: float) -> str:
    """The function (B.1) of a column or an expression in brackets; NULL where it is NULL."""
    r = 0.1 * (high - low)
    if r == 0.0:
        return f"CASE WHEN {x} IS NOT NULL THEN {number(low)} END"
    p = number(0.5 / r)
    above, below = f"({x}-{number(high)})", f"({x}-{number(low)})"
    return (
        f"CASE WHEN {x}>={number(low)} THEN CASE WHEN {x}<={number(high)} THEN {x}"
        f" WHEN {x}<{number(high + r)} THEN {x}-{p}*{above}*{above} ELSE {number(high + 0.5 * r)} END"
        f" WHEN {x}>{number(low - r)} THEN {x}+{p}*{below}*{below}"
        f" WHEN {x}<={number(low - r)} THEN {number(low - 0.5 * r)} END"
    )
