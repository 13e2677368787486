"""A model as one SELECT statement.

The statement is a chain of common table expressions: numbers and categories, deviations and gates, validities of the
nodes and deviations held to ranges, sums over the nodes (see `additive`), guards.
"""

from collections.abc import Sequence
from typing import Any

from .additive import Terms, terms
from .model import MARKS, Model, Node, Partition, read
from .sql_text import (
    SQLITE_BLANKS,
    column_of,
    is_no_sqlite_number,
    name_of,
    number,
    smooth_clamp,
    sqlite_number,
    string,
    sum_of,
)

_DIALECTS = ("duckdb", "postgresql", "sqlite")
# Every letter is a table of columns that need those of the tables before: factors of products; deviations, gates and
# exponents of Gaussians; the largest exponent; weights; their total; validities and deviations held to ranges; sums
# over the nodes; guards.
_STEPS = "edmwtvfy"
_MOST_SPLITS = 1500  # every split is a column of an intermediate table; PostgreSQL holds 1600


def _are_rules(partition: Partition) -> bool:
    """True if every row lies in one leaf, whose equation holds as it is, as in the trees of fit_readable()."""
    root = partition.nodes[0]
    return not partition.residual_range and all(
        node.low == root.low
        and node.high == root.high
        and node.per_half_width == 0.0
        and not node.direction
        and (node.is_leaf or all(share in (0.0, 1.0) for share in (*node.shares, node.missing_left)))
        for node in partition.nodes
    )


class _Statement:
    """The common table expressions of one model."""

    def __init__(self, model: Model, dialect: str) -> None:
        self.model = model
        self.dialect = dialect
        self.columns: dict[str, list[str]] = {step: [] for step in _STEPS}
        self.names: dict[tuple[int, float, float], str] = {}  # of the columns of held deviations
        self.uses = self.count_uses()
        self.has_no_numbers = False  # whether inputs() has a column no_number: 1 where a cell is none

    def add(self, step: str, name: str, expression: str) -> str:
        self.columns[step].append(f"{expression} AS {name}")
        return name

    def inputs(self) -> list[str]:
        """Numbers as doubles, NULL where they are missing; categories as positions of their levels."""
        columns = []
        no_numbers = []
        for j, column in enumerate(self.model.inputs):
            name = column_of(column.name)
            if column.levels:
                labels = {label: i for i, label in enumerate(column.levels)}
                for value, i in column.numbers.items():  # the text of a double in DuckDB and SQLite
                    labels.setdefault(repr(value), i)
                whens = " ".join(f"WHEN {string(label)} THEN {i}" for label, i in labels.items())
                blanks = SQLITE_BLANKS if self.dialect == "sqlite" else "' '||CHR(9)||CHR(13)"
                text = f"TRIM(CAST({name} AS TEXT),{blanks})"
                if column.has_empty_level:
                    text = f"COALESCE({text},'')"
                    marks = ",".join(string(mark) for mark in MARKS)
                    whens += f" ELSE CASE WHEN LOWER({text}) IN ({marks}) THEN {column.empty_level} END"
                columns.append(f"CASE {text} {whens} END AS x{j}")
                continue
            x = f"CAST({name} AS DOUBLE PRECISION)"
            if self.dialect == "sqlite":  # a NaN is NULL; other databases refuse text that is no number
                x = sqlite_number(name)
                no_numbers.append(f"WHEN {is_no_sqlite_number(name)} THEN 1")
            else:
                x = f"NULLIF({x},CAST('NaN' AS DOUBLE PRECISION))"
            if column.codes:
                codes = column.codes
                whens = " ".join(
                    f"WHEN {number(codes[i + 1])}-{x}>={x}-{number(codes[i])} THEN {i}" for i in range(len(codes) - 1)
                )
                missing = "NULL" if column.empty_level is None else str(column.empty_level)
                x = f"CASE WHEN {x} IS NULL THEN {missing} {whens} ELSE {len(codes) - 1} END"
            columns.append(f"{x} AS x{j}")
        if no_numbers:
            columns.append(f"CASE {' '.join(no_numbers)} ELSE 0 END AS no_number")
            self.has_no_numbers = True
        return columns

    def deviations(self) -> None:
        used = {
            k
            for partition in self.model.partitions
            for slopes in (*partition.outer, *(row for node in partition.nodes for row in node.slope))
            for k, slope in enumerate(slopes)
            if slope != 0.0
        }
        factors = {j for k in used for r in [self.model.regressors[k]] if r.second >= 0 for j in (r.input, r.second)}
        for j in sorted(factors):
            column = self.model.inputs[j]
            held = smooth_clamp(
                f"(x{j}-{number(column.centre)})", column.low - column.centre, column.high - column.centre
            )
            self.add("e", f"e{j}", held)
        for k, r in enumerate(self.model.regressors):
            if k not in used:
                continue
            x = f"x{r.input}"
            if r.second >= 0:
                expression = f"e{r.input}*e{r.second}-{number(r.centre)}"
            elif r.level >= 0:
                here, elsewhere = number(1.0 - r.centre), number(0.0 - r.centre)
                expression = f"CASE WHEN {x}={r.level} THEN {here} WHEN {x} IS NOT NULL THEN {elsewhere} END"
            else:
                expression = f"{x}-{number(r.centre)}"
            self.add("d", f"d{k}", expression)

    def gate(self, node: Node, kind: str) -> str:
        """The share of the left child."""
        x, t, missing = f"x{node.input}", number(node.threshold), number(node.missing_left)
        if node.shares:
            left = ",".join(str(i) for i, share in enumerate(node.shares) if share == 1.0)
            right = ",".join(str(i) for i, share in enumerate(node.shares) if share == 0.0)
            whens = f" WHEN {x} IN ({left}) THEN 1e0" if left else ""
            whens += f" WHEN {x} IN ({right}) THEN 0e0" if right else ""
            return f"CASE{whens} ELSE {missing} END" if whens else missing
        if node.is_presence:
            return f"CASE WHEN {x} IS NOT NULL THEN 1e0 ELSE {missing} END"
        if node.direction:
            parts = [f"COALESCE({number(w)}*(x{j}-{number(c)}),0e0)" for j, w, c in node.direction]
            x = "(" + sum_of(parts) + ")"
        if node.per_half_width == 0.0:
            return f"CASE WHEN {x}<={t} THEN 1e0 WHEN {x}>{t} THEN 0e0 ELSE {missing} END"
        per, u = number(node.per_half_width), f"({x}-{t})*{number(node.per_half_width)}"
        if kind == "logistic":
            return (
                f"CASE WHEN {u}<=-37e0 THEN 1e0 WHEN {u}>=37e0 THEN 0e0"
                f" WHEN {x} IS NULL THEN {missing} ELSE 1e0/(1e0+EXP({u})) END"
            )
        v = f"(0.5e0*(({x}-{t})*{per}+1e0))"
        return (
            f"CASE WHEN {u}<=-1e0 THEN 1e0 WHEN {u}>=1e0 THEN 0e0"
            f" WHEN {x} IS NULL THEN {missing} ELSE 1e0-{v}*{v}*(3e0-2e0*{v}) END"
        )

    def gates(self, p: int, partition: Partition) -> None:
        for i, node in enumerate(partition.nodes):
            if not node.is_leaf:
                self.add("d", f"g{p}_{i}", self.gate(node, partition.kind))
        for i in range(1, len(partition.nodes)):
            factors = [f"g{p}_{a}" if is_left else f"(1e0-g{p}_{a})" for a, is_left in partition.path(i)]
            self.add("v", f"v{p}_{i}", "*".join(factors))

    def gaussians(self, p: int, partition: Partition) -> None:
        """Exponents, then weights, then the shares of the leaves; the share of a node is the sum below it."""
        most = "MAX" if self.dialect == "sqlite" else "GREATEST"
        exponents: list[str] = []
        weights: list[str] = []
        for i, of_inputs in partition.gaussians:
            squares = [
                f"COALESCE((x{j}-{number(c)})*{number(s)}*(x{j}-{number(c)})*{number(s)},0e0)"
                for j, c, s in of_inputs
                if s != 0.0
            ]
            exponents.append(self.add("d", f"z{p}_{i}", f"-0.5e0*({sum_of(squares)})"))
        largest = exponents
        while len(largest) > 1:  # a function of SQLite takes at most 100 arguments
            largest = [
                f"{most}({','.join(largest[i : i + 50])})" if len(largest) > i + 1 else largest[i]
                for i in range(0, len(largest), 50)
            ]
        self.add("m", f"m{p}", largest[0])
        for (i, _), e in zip(partition.gaussians, exponents):
            weights.append(self.add("w", f"w{p}_{i}", f"CASE WHEN {e}-m{p}>=-40e0 THEN EXP({e}-m{p}) ELSE 0e0 END"))
        self.add("t", f"t{p}", sum_of(weights))
        below: dict[int, list[str]] = {i: [] for i in range(len(partition.nodes))}
        for i, _ in partition.gaussians:
            below[i].append(f"w{p}_{i}")
            for a, _ in partition.path(i):
                below[a].append(f"w{p}_{i}")
        for i in range(1, len(partition.nodes)):
            self.add("v", f"v{p}_{i}", f"({sum_of(below[i])})/t{p}")

    def held(self, k: int, low: float, high: float) -> str:
        """The column of a deviation that is held to a range, for ranges that occur more than once."""
        key = (k, low, high)
        if self.uses[key] == 1:
            return "(" + smooth_clamp(f"d{k}", low, high) + ")"
        if key not in self.names:
            self.names[key] = self.add("v", f"c{len(self.names)}", smooth_clamp(f"d{k}", low, high))
        return self.names[key]

    def local(self, node: Node, of_node: Terms) -> str:
        """What a node adds: its local model beside that of its parent."""
        parts = [number(of_node.value)] if of_node.value != 0.0 else []
        for k, (slope, missing) in enumerate(zip(of_node.slope, of_node.missing)):
            if slope == 0.0 and missing == 0.0:
                continue
            held = self.held(k, node.low[k], node.high[k]) if slope != 0.0 else f"0e0*d{k}"
            term = f"{number(slope)}*{held}" if slope != 0.0 else held
            parts.append(f"COALESCE({term},{number(missing)})")
        return sum_of(parts)

    def count_uses(self) -> dict[tuple[int, float, float], int]:
        """How often each deviation is held to each range."""
        uses: dict[tuple[int, float, float], int] = {}
        for partition in self.model.partitions:
            for o in range(len(partition.outputs)):
                for node, of_node in zip(partition.nodes, terms(partition, o)):
                    for k, slope in enumerate(of_node.slope):
                        key = (k, node.low[k], node.high[k])
                        uses[key] = uses.get(key, 0) + (slope != 0.0)
            for k in range(len(self.model.regressors)):  # for the slopes beyond the root's range
                uses[k, partition.nodes[0].low[k], partition.nodes[0].high[k]] += 1
        return uses

    def rules(self, partition: Partition) -> None:
        """A tree whose rows lie in one leaf each, with one range for all nodes, as CASE WHEN rule THEN equation."""
        for o, column in enumerate(partition.outputs):
            whens = []
            for leaf in partition.leaves():
                node = partition.nodes[leaf]
                parts = [number(node.value[o])]
                for k, slope in enumerate(node.slope[o]):
                    if slope != 0.0:
                        parts.append(
                            f"{number(slope)}*COALESCE({self.range_column(partition, k)},{number(node.mean[k])})"
                        )
                rule = [self.side(partition.nodes[a], is_left) for a, is_left in partition.path(leaf)]
                whens.append((" AND ".join(rule), sum_of(parts)))
            *first, (_, last) = whens
            rules = "".join(f"\n  WHEN {rule} THEN {equation}" for rule, equation in first)
            self.add("f", f"s{column}", f"CASE{rules}\n  ELSE {last} END" if first else last)
            outer = self.outer(partition, o)
            self.add("y", f"y{column}", f"s{column}+{outer}" if outer != "0e0" else f"s{column}")

    def range_column(self, partition: Partition, k: int) -> str:
        root = partition.nodes[0]
        self.uses[k, root.low[k], root.high[k]] = 2
        return self.held(k, root.low[k], root.high[k])

    def side(self, node: Node, is_left: bool) -> str:
        """The condition that a row goes to a child."""
        x = f"x{node.input}"
        if node.shares:
            levels = ",".join(str(i) for i, share in enumerate(node.shares) if share == is_left)
            known = f"{x} IN ({levels})" if levels else "1=0"
        elif node.is_presence:
            known = f"{x} IS NOT NULL" if is_left else "1=0"
        else:
            known = f"{x}{'<=' if is_left else '>'}{number(node.threshold)}"
        return f"({known} OR {x} IS NULL)" if node.missing_left == is_left else known

    def outer(self, partition: Partition, o: int) -> str:
        """The slopes beyond the training extent (B.4)."""
        root = partition.nodes[0]
        parts = [
            f"COALESCE({number(slope)}*(d{k}-{self.held(k, root.low[k], root.high[k])}),0e0)"
            for k, slope in enumerate(partition.outer[o])
            if slope != 0.0
        ]
        return sum_of(parts)

    def partition(self, p: int, partition: Partition) -> None:
        for o, column in enumerate(partition.outputs):
            of_nodes = terms(partition, o)
            root, rest = partition.nodes[0], range(1, len(partition.nodes))
            parts = []
            for i in rest:
                local = self.local(partition.nodes[i], of_nodes[i])
                if local != "0e0":
                    parts.append(f"CASE WHEN v{p}_{i}<>0e0 THEN v{p}_{i}*({local}) ELSE 0e0 END")
            self.add("f", f"r{column}", self.local(root, of_nodes[0]))
            self.add("f", f"s{column}", sum_of(parts))
            self.add("f", f"o{column}", self.outer(partition, o))
            leaves = f"s{column}"
            if partition.residual_range:
                leaves = smooth_clamp(leaves, *partition.residual_range[o])
            self.add("y", f"y{column}", f"r{column}+({leaves})+o{column}")

    def results(self) -> list[str]:
        results = [""] * len(self.model.outputs)
        for partition in self.model.partitions:
            for o, column in enumerate(partition.outputs):
                y = f"y{column}"
                if ends := partition.output_range and partition.output_range[o]:
                    low, high = (number(end) for end in ends)
                    y = f"CASE WHEN {y}<{low} THEN {low} WHEN {y}>{high} THEN {high} ELSE {y} END"
                if self.has_no_numbers:
                    y = f"CASE WHEN no_number=0 THEN {y} END"
                results[column] = f"{y} AS {name_of(self.model.outputs[column] + '_pred')}"
        return results


def to_sql(
    model: dict[str, Any], table: str | Sequence[str], dialect: str = "postgresql", keep: Sequence[str] = ()
) -> str:
    """A SELECT statement that gives the predictions of the rows of a table, one column TARGET_pred for each output.

    It says what `llmt predict` says, guards and missing values included, but for the rounding of sums. NULL, and NaN
    where the database has it, is a missing value; a category is compared by its label, without blanks at the ends. Where
    a missing value is a level of its own, NA, N/A, NaN, null and ? that are no labels are missing, too. An infinite value, which `llmt predict` refuses, is taken, but in SQLite.

    `model` is what `json.loads` makes of the text of a model file. `table` is the name of the table, or a sequence of
    names: ("schema", "table"). `dialect` is "postgresql", "duckdb" or "sqlite" (3.35 or later). `keep` names columns of
    the table that the result has too, such as its key: SQL does not promise an order of the rows. Gaussian and logistic
    validities need the function EXP, which SQLite has if it was built with its mathematical functions.

    A table without one of the inputs is an error in every database. Text that is no number is an error but in SQLite,
    whose columns hold anything: there it is read as `llmt predict` reads a cell. Text of a number is that number, an
    empty text, NA, N/A, NaN, null and ? are missing values, and where `llmt predict` refuses the cell, the predictions
    of the row are NULL.

    Raises ValueError for another dialect, a name with a NUL character, and trees of more than 1500 splits or 65 levels.
    """
    if dialect not in _DIALECTS:
        raise ValueError(f"dialect is {dialect!r}, it must be one of {', '.join(_DIALECTS)}")
    tree = read(model)
    splits = sum(len(partition.nodes) // 2 for partition in tree.partitions)
    if splits > _MOST_SPLITS:
        raise ValueError(
            f"the model has {splits} splits; SQL is written of at most {_MOST_SPLITS}, because databases limit the "
            "columns of a table. Fit with fewer leaves (max_leaves), or the readable tree"
        )
    statement = _Statement(tree, dialect)
    statement.deviations()
    for p, partition in enumerate(tree.partitions):
        if partition.kind == "crisp" and _are_rules(partition):
            statement.rules(partition)
            continue
        if partition.kind == "gaussian":
            statement.gaussians(p, partition)
        else:
            statement.gates(p, partition)
        statement.partition(p, partition)
    names = [table] if isinstance(table, str) else list(table)
    kept = [f"{column_of(column)} AS k{i}" for i, column in enumerate(keep)]
    text = "WITH llmt_x AS (SELECT\n " + ",\n ".join(kept + statement.inputs())
    text += "\n FROM " + ".".join(name_of(part) for part in names) + " AS t)"
    fence = "" if dialect == "duckdb" else "MATERIALIZED "
    last = "llmt_x"
    for step, columns in statement.columns.items():
        if columns:
            text += f",\nllmt_{step} AS {fence}(SELECT {last}.*,\n " + ",\n ".join(columns) + f"\n FROM {last})"
            last = f"llmt_{step}"
    results = [f"k{i} AS {name_of(column)}" for i, column in enumerate(keep)] + statement.results()
    text += "\nSELECT\n " + ",\n ".join(results) + f"\nFROM {last}"
    if "\0" in text:
        raise ValueError("a name or label of the model has a NUL character, which SQL cannot hold")
    return text
