"""No Arrow data end the process: they are read, or are an error that says what is broken, and all is released once."""

from __future__ import annotations

import pytest
from broken_cases import BROKEN
from children import outcomes

STAYS = {"capsule of something else": {"schema": 1}}  # the capsule keeps what was not asked for


@pytest.fixture(scope="module")
def found():
    return outcomes("broken_cases")


@pytest.mark.parametrize("name", BROKEN)
def test_broken(found, name):
    expected = BROKEN[name][1]
    assert found[name][0] == "value", found[name]
    outcome, made, released = found[name][1]
    assert outcome[0] == expected[0], outcome
    if expected[0].endswith("Error"):
        for words in expected[1:]:
            assert words in outcome[1]
    else:
        assert outcome[1:] == list(expected[1:])
    assert released.pop("of a part") == 0
    assert {what: count - STAYS.get(name, {}).get(what, 0) for what, count in made.items()} == released
