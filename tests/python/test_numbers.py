"""Every number that an estimator takes, set to what nobody means: finite predictions, or an exception that says why.

Each estimator is walked in a process of its own, so that one that dies is one failure and no lost test run.
"""

import subprocess
import sys
import textwrap

import numpy as np
import pytest

import llmt

WALK = textwrap.dedent("""
    import inspect, itertools, math, os, sys, warnings
    import numpy as np
    import llmt
    from llmt import distributed

    warnings.simplefilter("ignore")
    NUMBERS = [0, -1, 1, 5e-324, -5e-324, 1e-200, 0.5, 1e16, 1e150, 1.0000000000000002e150, 1e307, 1e308, -1e308,
               math.inf, -math.inf, math.nan, 2**31, 2**63, 2**64, -(2**63)]
    if "LLMT_STUDIES" not in os.environ:  # see study.py
        NUMBERS = NUMBERS[1::2]
    Estimator = getattr(llmt, sys.argv[1])
    random = np.random.default_rng(3)
    X = random.uniform(0, 1, (60, 2))
    y = X[:, 0] + (X[:, 1] > 0.5)
    is_sum = sys.argv[1].startswith("Boosted")
    few = {"max_iter": 10} if is_sum else {"cv": 2}
    calls = wrong = 0


    def expect(what, call):
        global calls, wrong
        calls += 1
        try:
            found = call()
        except (ValueError, TypeError, OverflowError):
            return
        except BaseException as error:
            print(what, "raises", repr(error))
            wrong += 1
            return
        if not np.isfinite(np.asarray(found, dtype=float)).all():
            print(what, "is not finite")
            wrong += 1


    def changed(values, place, number):
        copied = np.array(values, dtype=float)
        copied[place] = number
        return copied


    parameters = [name for name in inspect.signature(Estimator.__init__).parameters if name != "self"]
    for name, number in itertools.product(parameters, NUMBERS):
        expect(f"{name}={number}", lambda: Estimator(**{**few, name: number}).fit(X, y).predict(X))
        if not is_sum:
            expect(f"{name}={number}, partial_fit", lambda: Estimator(**{name: number}).partial_fit(X, y).predict(X))
            start = lambda: distributed.start(["a"], "y", estimator=Estimator(**{name: number}))
            expect(f"{name}={number}, start", lambda: len(start()))

    usual = Estimator(**few)
    learn = [usual.fit] + ([] if is_sum else [Estimator().partial_fit, Estimator(loss="tukey", **few).fit])
    for number, fit in itertools.product(NUMBERS, learn):
        ones = np.ones(len(y))
        for what, arguments in {
            "a cell": (changed(X, (3, 1), number), y),
            "a column": (changed(X, np.s_[:, 1], number), y),
            "a target": (X, changed(y, 3, number)),
            "all targets": (X, changed(y, np.s_[:], number)),
            "a weight": (X, y, changed(ones, 3, number)),
            "all weights": (X, y, changed(ones, np.s_[:], number)),
            "half of the weights": (X, y, changed(0.25 * ones, np.s_[:30], number)),
        }.items():
            if fit.__name__ == "partial_fit":
                fit = Estimator().partial_fit
            expect(f"{fit.__name__}: {what} is {number}", lambda: fit(*arguments).predict(X))
        if fit.__name__ == "fit":
            expect(f"a group is {number}", lambda: fit(X, y, groups=changed(np.arange(60), 3, number)).predict(X))
            expect(f"an eval_set has {number}",
                   lambda: fit(X, y, eval_set=(changed(X[:9], (0, 0), number), y[:9])).predict(X))
            expect(f"a target of eval_set is {number}",
                   lambda: fit(X, y, eval_set=(X[:9], changed(y[:9], 0, number))).predict(X))

    model = Estimator(**few).fit(X, y)
    for number in NUMBERS:
        row = changed(X[:5], (2, 1), number)
        expect(f"predict of {number}", lambda: model.predict(row))
        expect(f"explain of {number}", lambda: model.explain(row).values)
        expect(f"interval of {number}", lambda: model.predict_interval(row))
        expect(f"coverage {number}", lambda: model.predict_interval(X, coverage=number))
    print(calls, "calls,", wrong, "wrong")
""")


@pytest.mark.parametrize("estimator", ["LocalLinearTreeRegressor", "BoostedLocalLinearTreeRegressor"])
def test_every_number_is_taken_or_refused(estimator):
    done = subprocess.run([sys.executable, "-c", WALK, estimator], capture_output=True, text=True)
    assert done.returncode == 0, f"exit code {done.returncode}: {done.stdout[-1000:]} {done.stderr[-1000:]}"
    assert done.stdout.endswith(" calls, 0 wrong\n"), done.stdout


def test_weights_that_are_alike_are_weights_of_one():
    X = np.random.default_rng(1).uniform(0, 1, (60, 2))
    y = X[:, 0] + (X[:, 1] > 0.5)
    for estimator in (llmt.LocalLinearTreeRegressor, lambda: llmt.BoostedLocalLinearTreeRegressor(max_iter=50)):
        expected = estimator().fit(X, y, sample_weight=[0.5] * 60).predict(X)
        for weight in (1e150, 1e100, 1e-100, 5e-324):
            found = estimator().fit(X, y, sample_weight=[weight] * 60).predict(X)
            np.testing.assert_allclose(found, expected, rtol=1e-9)
        for weight in (1.0000000000000002e150, 1e307, -1.0, -5e-324):
            with pytest.raises(ValueError, match="sample_weight of row 7 is .*, it must be from 0 to 1e\\+150"):
                estimator().fit(X, y, sample_weight=[1.0] * 7 + [weight] * 53)
        for weight in (float("inf"), float("nan")):
            with pytest.raises(ValueError, match="The first is .* row 7 of sample_weight"):
                estimator().fit(X, y, sample_weight=[1.0] * 7 + [weight] * 53)
