"""Pieces of the text of SQL."""


def number(value: float) -> str:
    """A literal that all dialects read as exactly this double."""
    text = repr(value)
    if "e" not in text:
        text += "e0"
    return f"({text})" if text.startswith("-") else text


def name_of(text: str) -> str:
    return '"' + text.replace('"', '""') + '"'


def column_of(text: str) -> str:
    """A column of the table that is called t. Without the table SQLite takes a column that is not there for a text."""
    return "t." + name_of(text)


SQLITE_BLANKS = "' '||CHAR(9,13)"
_LARGEST = "1.7976931348623157e308"
_NO_VALUE = "'','na','n/a','nan','null','?'"  # as in a CSV file


def _is_number_of_text(column: str) -> str:
    """Whether text of SQLite is a number. Compared with a number, text that looks like one becomes one, as a whole."""
    text = f"TRIM({column},{SQLITE_BLANKS})"
    return f"CAST({text} AS NUMERIC)={text} AND ABS(CAST({text} AS REAL))<={_LARGEST}"


def sqlite_number(column: str) -> str:
    """The number of a cell; NULL where it is missing or no number."""
    of_text = f"CAST(TRIM({column},{SQLITE_BLANKS}) AS REAL)"
    return (
        f"CASE TYPEOF({column}) WHEN 'text' THEN CASE WHEN {_is_number_of_text(column)} THEN {of_text} END"
        f" WHEN 'blob' THEN NULL ELSE CAST({column} AS REAL) END"
    )


def is_no_sqlite_number(column: str) -> str:
    """Whether a cell is neither a finite number nor missing."""
    is_missing = f"LOWER(TRIM({column},{SQLITE_BLANKS})) IN ({_NO_VALUE})"
    return (
        f"CASE TYPEOF({column}) WHEN 'text' THEN NOT ({_is_number_of_text(column)}) AND NOT {is_missing}"
        f" WHEN 'blob' THEN 1 ELSE ABS(CAST({column} AS REAL))>{_LARGEST} END"
    )


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
