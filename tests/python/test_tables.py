"""What a table, a column and labels of rows are read as, and how those that cannot be are refused."""

from __future__ import annotations

import subprocess
import sys

import numpy as np
import pytest

from llmt.tables import read_column, read_table, read_targets, row_labels
from llmt.tables.named import columns_of

pd = pytest.importorskip("pandas")
FRAME = pd.DataFrame({"x": [1.0, 2.5, np.nan], "k": [10, 9, 10], "w": ["ä", "b", None]})


def test_float64_is_not_copied():
    for values in (np.ones((5, 3)), np.ones((5, 3), order="F"), np.ones((5, 6))[:, ::2]):
        assert np.shares_memory(read_table(values).values, values)
        assert np.shares_memory(read_table(values, levels=[[]] * 3).values, values)


def test_nothing_given_is_changed():
    values = np.array([[2.0, 7.0], [1.0, 5.0]])
    frame = pd.DataFrame({"a": [2.0, 1.0]})
    read = read_table(values, categorical=[0])
    assert read.levels == [["1", "2"], []]
    np.testing.assert_array_equal(read.values, [[1, 7], [0, 5]])
    np.testing.assert_array_equal(read_table(values, levels=[["2"], []]).values, [[0, 7], [-1, 5]])
    np.testing.assert_array_equal(values, [[2, 7], [1, 5]])
    assert read_table(frame, categorical="a").levels == [["1", "2"]]
    assert frame["a"].tolist() == [2.0, 1.0]


@pytest.mark.parametrize("values", [np.zeros(3, dtype=[("a", "i4"), ("b", "f8")])["b"], np.zeros((3, 2), ">f8")[:, 0]])
def test_layouts_that_the_core_cannot_take_are_copied(values):
    read = read_table(values.reshape(-1, 1))
    assert read.values.dtype == np.float64 and read.values.flags.aligned
    assert all(stride % 8 == 0 for stride in read.values.strides)


def test_table():
    read = read_table(FRAME)
    assert read.names == ["x", "k", "w"]
    assert read.levels == [[], [], ["b", "ä"]]
    assert read.values.flags.f_contiguous
    np.testing.assert_array_equal(read.values, [[1, 10, 1], [2.5, 9, 0], [np.nan, 10, np.nan]])


def test_lists_keep_the_types_of_their_cells():
    read = read_table([[1, "b"], [None, "a"], [True, "b"]])
    assert (read.names, read.levels) == (None, [[], ["a", "b"]])
    np.testing.assert_array_equal(read.values, [[1, 1], [np.nan, 0], [1, 1]])


@pytest.mark.parametrize("kind", ["category", "Int64", "float64", object])
def test_categories_that_are_numbers_are_sorted_as_texts(kind):
    read = read_table(FRAME[["k"]].astype(kind), categorical=["k"])
    assert read.levels == [["10", "9"]]
    np.testing.assert_array_equal(read.values[:, 0], [0, 1, 0])


def test_texts_of_numbers():
    numbers = [0.1, -0.0, 1e15, 1e-7, -2.5, 1 / 3]
    read = read_table(np.array(numbers).reshape(-1, 1), categorical=[0])
    assert read.levels == [sorted(["0.1", "0", "1000000000000000", "1e-07", "-2.5", "0.3333333333333333"])]
    assert [float(read.levels[0][int(k)]) for k in read.values[:, 0]] == numbers


def test_a_column_without_values_is_numbers_unless_it_is_declared():
    nothing = pd.DataFrame({"a": pd.Series([None, None], dtype="str"), "b": [np.nan, np.nan]})
    assert read_table(nothing).levels == [[], []]
    assert read_table(nothing, categorical=["a", "b"]).levels == [["(none)"], ["(none)"]]


def test_levels_that_are_given():
    levels = [[], ["10", "8", "9.0"], ["b", "c"]]
    read = read_table(FRAME.assign(w=["c", "", "d"]), levels=levels)
    assert (read.levels, read.unknown) == (levels, [0, 0, 1])
    np.testing.assert_array_equal(read.values, [[1, 0, 1], [2.5, 2, np.nan], [np.nan, 0, -1]])
    other_codes = FRAME.assign(w=pd.Categorical(["c", "b", "b"], categories=["c", "b"]))
    np.testing.assert_array_equal(read_table(other_codes, levels=levels).values[:, 2], [1, 0, 0])
    as_text = read_table(FRAME.astype({"k": str}), levels=[[], ["10", "9"], ["b"]])
    np.testing.assert_array_equal(as_text.values[:, 1], [0, 1, 0])
    assert as_text.unknown == [0, 0, 1]
    assert read_table([[3.0]], levels=[["3.0", "3"]]).values[0, 0] == 1


def test_words_where_training_had_numbers():
    with pytest.raises(TypeError, match=r"column \"w\" holds words \('b' in row 1\); in training it held numbers"):
        read_table(FRAME.assign(w=[None, "b", "c"]), levels=[[], [], []])
    assert np.isnan(read_table(FRAME.assign(w=["", None, "NA"]), levels=[[], [], []]).values[:, 2]).all()


@pytest.mark.parametrize(
    ("categorical", "error", "words"),
    [
        (["q"], ValueError, r"\"q\", which is not among the columns: the columns are x, k, w"),
        ([3], ValueError, "positions of the columns are 0 to 2"),
        ([-1], ValueError, "positions of the columns are 0 to 2"),
        ([True, False, True], TypeError, "not True"),
        ([2.0], TypeError, "not 2.0"),
    ],
)
def test_categorical_that_is_not_there(categorical, error, words):
    with pytest.raises(error, match=words):
        read_table(FRAME, categorical=categorical)


@pytest.mark.parametrize("blanks", [" ", "\t", "\r", " \t\r\t "])
def test_outer_blanks_are_no_part_of_a_word(blanks):
    cells = [f"{blanks}red", f"red{blanks}", f"{blanks}red{blanks}", "red", f"r{blanks}ed"]
    read = read_table(pd.DataFrame({"w": cells}))
    assert read.levels == [sorted(["red", f"r{blanks}ed"])]
    assert read.values[:4, 0].tolist() == [float(read.levels[0].index("red"))] * 4
    assert read_table(pd.DataFrame({"w": cells}), levels=[["red"]]).unknown == [1]


def test_words_that_stand_for_no_value():
    missing = ["", " ", "\t\r"]
    words = ["NA", "na", "N/A", "n/a", "NaN", "nan", "null", "NULL", "?", "none", "n.a.", "-"]
    read = read_table(pd.DataFrame({"w": missing + words}))
    assert read.levels == [sorted(words)]
    assert np.isnan(read.values[: len(missing), 0]).all() and not np.isnan(read.values[len(missing) :, 0]).any()
    given = read_table(pd.DataFrame({"w": missing + words}), levels=[["none"]])
    assert given.unknown == [len(words) - 1]
    assert np.isnan(given.values[: len(missing), 0]).all() and set(given.values[len(missing) :, 0]) == {-1.0, 0.0}


def test_ten_thousand_categories_are_taken():
    read = read_table(pd.DataFrame({"id": [f"w{i}" for i in range(10000)]}))
    assert [len(levels) for levels in read.levels] == [10000]
    assert read.values[:, 0].tolist() == [float(k) for k in np.argsort(np.argsort([f"w{i}" for i in range(10000)]))]


def test_categories_that_cannot_be():
    with pytest.raises(ValueError, match=r"column \"id\" has 10001 categories; at most 10000"):
        read_table(pd.DataFrame({"id": [f"w{i}" for i in range(10001)]}))
    with pytest.raises(ValueError, match='column "id": 9007199254740992 in row 1 has too many digits'):
        read_table(pd.DataFrame({"id": [1, 2**53 + 1]}), categorical=["id"])
    with pytest.raises(ValueError, match="column 0 is no Unicode"):
        read_table(np.array([["\ud800"]]))
    with pytest.raises(ValueError, match="the name of column '.ud800' is no Unicode"):
        read_table(pd.DataFrame([[1.0]], columns=pd.Index(["\ud800"], dtype=object)))
    for y in (pd.Series([1.0], name="\ud800"), pd.DataFrame([[1.0]], columns=pd.Index(["\ud800"], dtype=object))):
        with pytest.raises(ValueError, match="the name of column '.ud800' is no Unicode"):
            read_targets(y)
    for cells in ([1.0, 2.0], ["a", "b"]):
        with pytest.raises(ValueError, match="measured: the name of column 'q.ud800' is no Unicode"):
            columns_of({"a": [1.0, 2.0], "q\ud800": cells}, "measured")
    with pytest.raises(ValueError, match="measured: '.ud800' in column 'kind' is no Unicode"):
        columns_of({"kind": ["a", "\ud800"]}, "measured")


@pytest.mark.parametrize(
    ("table", "error", "words"),
    [
        (
            np.ones(3),
            ValueError,
            r"Expected 2D array, got 1D array instead:\narray=\[1. 1. 1.\].\nReshape your data either",
        ),
        ([1.0, 2.0], ValueError, "Expected 2D array, got 1D array instead"),
        (FRAME["x"], ValueError, "Expected a 2-dimensional container but got <class 'pandas.*Series'> instead"),
        (np.ones((2, 2, 2)), ValueError, "Found array with dim 3"),
        (5.0, ValueError, "Expected 2D array, got scalar array instead"),
        ("data.csv", TypeError, "X must be a table, such as an array or a DataFrame, not 'str'"),
        (object(), TypeError, "must be a table, such as an array or a DataFrame, not 'object'"),
        ({"a": [1]}, TypeError, r"is a dict: make a table of it first, such as pandas.DataFrame\(X\)"),
        ([[1.0, 2.0], [3.0]], ValueError, "its rows have different lengths"),
        (np.ones((0, 3)), ValueError, r"0 sample\(s\) \(shape=\(0, 3\)\) while a minimum of 1 is required by"),
        (np.ones((3, 0)), ValueError, r"0 feature\(s\) \(shape=\(3, 0\)\) while a minimum of 1 is required"),
        (FRAME[[]], ValueError, r"0 feature\(s\) \(shape=\(3, 0\)\)"),
        (
            np.array([[1.0, 2.0], [3.0, -np.inf]]),
            ValueError,
            r"too large for dtype\('float64'\).\nThe first is -inf in row 1 of column 1",
        ),
        (FRAME.assign(k=[1, np.inf, 2]), ValueError, r"The first is inf in row 1 of column \"k\""),
        ([[10**400]], ValueError, "Input X contains infinity"),
        (np.array([[1j]]), ValueError, "Complex data not supported"),
        (np.array([[1j]], dtype=object), ValueError, "Complex data not supported"),
        (pd.concat([FRAME, FRAME[["x"]]], axis=1), ValueError, 'column "x" occurs more than once'),
        (FRAME.rename(columns={"x": 0}), TypeError, r"Feature names are only supported if all .* has \['int', 'str'\]"),
        (
            pd.DataFrame({"c": ["a", 1]}, dtype=object),
            TypeError,
            r"column \"c\" mixes words and numbers: 'a' in row 0, 1 in row 1",
        ),
        (
            pd.DataFrame({"c": [1, {}]}),
            TypeError,
            r"column \"c\", row 1: argument must be a string or a number, not 'dict'",
        ),
    ],
)
def test_tables_that_cannot_be_read(table, error, words):
    with pytest.raises(error, match=words):
        read_table(table)


def test_sparse():
    sparse = pytest.importorskip("scipy.sparse")
    with pytest.raises(TypeError, match=r"Sparse data was passed for X, .*\.toarray\(\)"):
        read_table(sparse.eye(3).tocsr())


def test_lazy():
    pl = pytest.importorskip("polars")
    with pytest.raises(TypeError, match=r"LazyFrame, which has no values yet: collect\(\) it first"):
        read_table(pl.LazyFrame({"a": [1]}))


def test_columns_without_text_as_names():
    assert read_table(pd.DataFrame(np.ones((2, 3)))).names is None
    tuples = pd.MultiIndex.from_tuples([("a", 1), ("b", 2)])
    assert read_table(pd.DataFrame(np.ones((2, 2)), columns=tuples)).names is None
    with pytest.raises(TypeError, match=r"column \('b', 2\) holds dates"):
        read_table(pd.DataFrame([[1, pd.Timestamp(0)]], columns=tuples))
    assert read_table(pd.DataFrame({"größe <m>": [1], '"q", {d}:': [2]})).names == ["größe <m>", '"q", {d}:']


def test_names_are_checked_before_the_columns():
    levels = [[], [], ["b"]]
    with pytest.raises(ValueError, match="Feature names must be in the same order as they were in fit.\n$"):
        read_table(FRAME[["w", "k", "x"]], levels=levels, fitted_names=["x", "k", "w"])
    with pytest.raises(
        ValueError, match="unseen at fit time:\n- z\nFeature names seen at fit time, yet now missing:\n- w"
    ):
        read_table(FRAME.rename(columns={"w": "z"}), levels=levels, fitted_names=["x", "k", "w"])
    with pytest.raises(ValueError, match="now missing:\n- w\n$"):
        read_table(FRAME[["x", "k"]], levels=levels, fitted_names=["x", "k", "w"])
    with pytest.raises(ValueError, match="X has 2 features, but L is expecting 3 features as input"):
        read_table(np.ones((2, 2)), levels=levels, owner="L", fitted_names=None)
    with pytest.warns(UserWarning, match="X does not have valid feature names, but L was fitted with feature names"):
        read_table([[1, 2, "b"]], levels=levels, owner="L", fitted_names=["x", "k", "w"])
    with pytest.warns(UserWarning, match="X has feature names, but L was fitted without feature names"):
        read_table(FRAME, levels=levels, owner="L", fitted_names=None)


@pytest.mark.parametrize("y", [[1, 0, 1], np.array([True, False, True]), pd.Series([1, 0, 1], dtype="Int64")])
def test_column(y):
    values, name = read_column(y, name="y")
    assert values.tolist() == [1.0, 0.0, 1.0] and values.dtype == np.float64 and name is None


def test_targets():
    values, names = read_targets(FRAME[["k"]])
    assert (values.shape, names) == ((3, 1), ["k"])
    values, names = read_targets(FRAME["k"])
    assert (values.shape, names) == ((3,), ["k"])
    values, names = read_targets(np.ones((3, 2)))
    assert (values.shape, names) == ((3, 2), None)
    pl = pytest.importorskip("polars")
    values, names = read_targets(pl.Series("y", [1, 2]))
    assert (values.tolist(), names) == ([1.0, 2.0], ["y"])


@pytest.mark.parametrize(
    ("y", "error", "words"),
    [
        ([1.0, np.nan, np.nan], ValueError, r"Input y contains NaN.\nThe first is in row 1 of y; 2 rows have one"),
        ([1.0, None], ValueError, "Input y contains NaN."),
        ([1.0, np.inf], ValueError, r"Input y contains infinity or a value too large for dtype\('float64'\)."),
        (FRAME["w"], TypeError, "y holds words \\('ä' in row 0\\); numbers are needed"),
        (FRAME[["k", "w"]], TypeError, 'column "w" holds words'),
        (pd.Series(pd.to_datetime(["2024-01-01"])), TypeError, "y holds dates"),
        ([1j], ValueError, "Complex data not supported"),
        (None, ValueError, "requires y to be passed, but the target y is None"),
    ],
)
def test_targets_that_cannot_be_read(y, error, words):
    with pytest.raises(error, match=words):
        read_targets(y)


def test_column_of_two_dimensions():
    with pytest.raises(ValueError, match=r"w should be a 1d array, got an array of shape \(3, 2\) instead"):
        read_column(np.ones((3, 2)), name="w")


@pytest.mark.parametrize(
    "groups",
    [
        [5, 3, 5],
        ["b", "a", "b"],
        np.array([2**53 + 1, 2**53, 2**53 + 1]),
        pd.Series(["b", "a", "b"], dtype="category"),
        pd.Series([2.5, 1.0, 2.5]),
        pd.Series([5, 3, 5], dtype="Int64"),
        [f"w{i % 2}" for i in range(3)],
    ],
)
def test_row_labels(groups):
    labels = row_labels(groups, 3)
    assert labels.dtype == np.float64
    assert labels[0] == labels[2] != labels[1]


def test_row_labels_that_cannot_be():
    assert len(set(row_labels([f"w{i}" for i in range(20000)], 20000))) == 20000
    with pytest.raises(ValueError, match=r"inconsistent numbers of samples: \[2, 3\]: groups"):
        row_labels([1, 2, 3], 2)
    with pytest.raises(ValueError, match="Input groups contains NaN"):
        row_labels(["a", None], 2)
    with pytest.raises(ValueError, match="groups should be a 1d array"):
        row_labels(np.ones((2, 2)), 2)


def test_no_library_is_imported():
    code = (
        "import sys, numpy, llmt.tables; llmt.tables.read_table(numpy.ones((2, 2)));"
        "llmt.tables.read_table([[1, 'a']]); print(*sys.modules)"
    )
    loaded = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout.split()
    assert {"pandas", "polars", "pyarrow", "sklearn", "scipy"} & set(loaded) == set()
