"""Every type of a column is read with the values given, or is a TypeError that names the column."""

from __future__ import annotations

import pytest
from children import outcomes
from type_cases import TYPES, pa, pl


@pytest.fixture(scope="module")
def found():
    return outcomes("type_cases")


@pytest.mark.parametrize("name", TYPES)
def test_type(found, name):
    expected = TYPES[name][1]
    outcome = found[name]
    if isinstance(expected, list):
        assert outcome == ["value", expected]
        return
    assert outcome[0] == "TypeError", outcome
    assert expected in outcome[1]
    where = "column 0" if name.startswith("numpy") else 'column "c"'
    assert where in outcome[1] or name == "numpy records", outcome


@pytest.mark.skipif(pa is None, reason="needs pyarrow")
def test_no_type_of_pyarrow_is_forgotten():
    made = {TYPES[name][0]().schema.types[0].id for name in TYPES if name.startswith("pyarrow")}
    all_types = {getattr(pa.lib, name) for name in dir(pa.lib) if name.startswith("Type_")}
    not_made = {pa.lib.Type_INTERVAL_MONTHS, pa.lib.Type_INTERVAL_DAY_TIME}  # pyarrow cannot make them
    assert all_types - not_made - made == set()


@pytest.mark.skipif(pl is None, reason="needs polars")
def test_no_type_of_polars_is_forgotten():
    concrete = {
        kind.__name__
        for kind in vars(pl.datatypes).values()
        if isinstance(kind, type) and issubclass(kind, pl.DataType) and kind.__subclasses__() == []
    }
    made = {name.split()[1].rstrip(",") for name in TYPES if name.startswith("polars")}
    assert concrete - made == {"Unknown"}
