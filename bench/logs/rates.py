"""Tables of judged runs: rates with their intervals of 95 % (Wilson 1927)."""

import statistics

import numpy as np
from scipy import special

KINDS = ("complete", "parameters", "effect", "both", "two", "inner", "outside", "regime")
MISSING = ("effect", "both", "two", "inner", "outside", "regime")
NAMES = ("effect", "both", "two")


def wilson(count, n, level=0.95):
    """Interval of a rate of `count` in `n`."""
    z = special.ndtri(0.5 + level / 2)
    middle = (count + z * z / 2) / (n + z * z)
    half = z / (n + z * z) * np.sqrt(count * (n - count) / n + z * z / 4)
    return middle - half, middle + half


def rate(results, test):
    """count/n, per cent and interval of the runs for which `test` holds; those for which it is None do not count."""
    values = [test(r) for r in results]
    values = [bool(v) for v in values if v is not None]
    if not values:
        return "-"
    low, high = wilson(sum(values), len(values))
    return f"{sum(values)}/{len(values)} {100 * sum(values) / len(values):.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def answered(r):
    return "verdict" in r


def is_cleared(r, which):
    return answered(r) and r["cleared"] and r["verdict"].startswith(which)


def forgiven(r):
    """An all-clear that is right because even the true model gains nothing on the second run."""
    which = "nothing" if r["verdict"].startswith("nothing") else "parameters only"
    return r["allowed"][which]


def in_vain(r):
    """The truth gains nothing: the run says little about names."""
    return answered(r) and r["allowed"]["parameters only"]


def named_right(r):
    """None where nothing could be gained and nothing wrong was said."""
    if not answered(r):
        return False
    if r["alone"] or r["group"]:
        return True
    return None if in_vain(r) and (r["cleared"] or r["undecided"]) else False


def named_or_same(r):
    """Also where other names say the same, as sign and Stribeck's friction for both in one term: within 2 %."""
    right = named_right(r)
    if right is not False or not answered(r) or not r["effects"] or r["unknown"] or r["inner"]:
        return right
    return r["function_error"] is not None and r["function_error"] <= 0.02


def recognised(r, key):
    if not answered(r):
        return False
    return True if r[key] else None if in_vain(r) and (r["cleared"] or r["undecided"]) else False


def worse(r):
    return answered(r) and r["gain"] is not None and r["gain"] > 1.05


def demands():
    """The list of what is to be shown: name, kinds, test."""
    nothing = lambda r: is_cleared(r, "nothing")
    yield "complete: cleared", ("complete",), nothing
    yield "complete: cleared, or parameters only", ("complete",), lambda r: answered(r) and r["cleared"]
    yield "complete: alarm (terms, a state or unknown)", ("complete",), lambda r: answered(r) and not (
        r["cleared"] or r["undecided"] or r["failed"])
    yield "parameters off: parameters only", ("parameters",), lambda r: is_cleared(r, "parameters") or None if (
        answered(r) and nothing(r) and forgiven(r)) else is_cleared(r, "parameters")
    yield "something missing: cleared, not forgiven", MISSING, lambda r: answered(r) and r["cleared"] and not forgiven(r)
    yield "  of these inner and outside", ("inner", "outside"), lambda r: answered(r) and r["cleared"] and not forgiven(r)
    for kind in KINDS:
        yield f"wrong and confirmed by function: {kind}", (kind,), lambda r: answered(r) and r["wrong"]
    yield "wrong and confirmed by name: all", KINDS, lambda r: answered(r) and r["wrong_name"]
    yield "confirmed and more than 10 % off: all but complete", KINDS[1:], lambda r: answered(r) and r["off_confirmed"]
    yield "library effects: alone, or a group within 10 %", NAMES, named_right
    yield "  effect", ("effect",), named_right
    yield "  both", ("both",), named_right
    yield "  two", ("two",), named_right
    yield "  or other names of the same function", NAMES, named_or_same
    yield "  alone", NAMES, lambda r: r["alone"] if answered(r) else False
    yield "  listed among others", NAMES, lambda r: r["listed"] if answered(r) else False
    yield "inner states: recognised", ("inner",), lambda r: recognised(r, "inner")
    yield "  with the right kind of state", ("inner",), lambda r: recognised(r, "state_named")
    yield "  or undecided or unknown", ("inner",), lambda r: answered(r) and (
        r["inner"] or r["undecided"] or r["unknown"] or r["right"])
    yield "regime: named with its threshold", ("regime",), lambda r: recognised(r, "regime_named")
    yield "outside: unknown, undecided or within 10 %", ("outside",), lambda r: answered(r) and r["right"]
    yield "second run worse by more than 5 %", KINDS, worse
    yield "no answer", KINDS, lambda r: not answered(r)
    yield "failed on held-out rows", KINDS, lambda r: answered(r) and r["failed"]
    yield "right as a whole", KINDS, lambda r: answered(r) and r["right"]
    in_loop = lambda r: r["structure"]["loop"]
    yield "  where the motion is prescribed", KINDS, lambda r: None if in_loop(r) else answered(r) and r["right"]
    yield "  in a loop with friction that sticks", KINDS, lambda r: answered(r) and r["right"] if in_loop(r) else None


def cover(results, test):
    """How many intervals of parameters hold the true value."""
    chosen = [r for r in results if answered(r) and test(r)]
    inside, count = (sum(r["cover"][k] for r in chosen) for k in (0, 1))
    if not count:
        return "-"
    low, high = wilson(inside, count)
    return f"{inside}/{count} {100 * inside / count:.1f} % ({100 * low:.1f} to {100 * high:.1f})"


def middle(values):
    return f"{statistics.median(values):.3g}" if values else "-"


def by_kind(results):
    heads = ("runs", "right", "nothing", "par.only", "named", "inner", "unknown", "undec.", "failed", "none", "wrong",
             "worse", "error", "gain", "true", "CPU s")
    yield f"{'kind':12}" + "".join(f"{head:>9}" for head in heads)
    for kind in (*KINDS, "all"):
        of = [r for r in results if kind in ("all", r["kind"])]
        said = [r for r in of if answered(r)]
        if not of:
            continue
        count = lambda test: sum(bool(test(r)) for r in said)
        cells = [len(of), count(lambda r: r["right"]), count(lambda r: is_cleared(r, "nothing")),
                 count(lambda r: is_cleared(r, "parameters")), count(lambda r: r["verdict"].startswith("named")),
                 count(lambda r: r["inner"]), count(lambda r: r["unknown"]), count(lambda r: r["undecided"]),
                 count(lambda r: r["failed"]), len(of) - len(said), count(lambda r: r["wrong"]), count(worse),
                 middle([r["function_error"] for r in said if r["function_error"] is not None]),
                 middle([r["gain"] for r in said if r["gain"] is not None]), middle([r["true_gain"] for r in said]),
                 middle([r["seconds"].get("discover", 0.0) for r in of])]
        yield f"{kind:12}" + "".join(f"{cell:>9}" for cell in cells)


def tables(results):
    yield from by_kind(results)
    yield ""
    for name, kinds, test in demands():
        yield f"{name:52} {rate([r for r in results if r['kind'] in kinds], test)}"
    complete = lambda r: r["kind"] in ("complete", "parameters")
    yield f"{'intervals of parameters: complete, parameters off':52} {cover(results, complete)}"
    named = lambda r: complete(r) or r["alone"] or r["group"]
    yield f"{'  and where the effects are named rightly':52} {cover(results, named)}"
    gains = [r["gain"] for r in results if answered(r) and r["gain"] is not None and r["kind"] != "complete"]
    yield f"{'median gain of the second run (after/before)':52} {middle(gains)}"
    seconds = [r["seconds"].get("discover", 0.0) for r in results]
    yield f"{'CPU s of discover: all, median, largest':52} {sum(seconds):.0f}, {middle(seconds)}, {max(seconds, default=0):.1f}"


def line(r):
    """A run in a line."""
    s = r["structure"]
    head = f"{r['seed']:5} {r['kind']:10} {s['family']:9}{s['axes']} {'loop' if s['loop'] else '    '} size {s['size']:6.1f} "
    head += f"CPU {r['seconds'].get('discover', 0):5.1f} [{r['truth']}]"
    if not answered(r):
        return f"{head} NO ANSWER {r['no_answer']}"
    error = "-" if r["function_error"] is None else f"{r['function_error']:.3g}"
    gain = "-" if r["gain"] is None else f"{r['gain']:.3g}"
    mark = "ok   " if r["right"] else "WRONG" if r["wrong"] else "no   "
    return (f"{head} {mark} {r['verdict']}: {', '.join(r['effects']) or '-'}; error {error}, gain {gain} of "
            f"{r['true_gain']:.3g}, rest {r['rest_over_noise']:.1f} of {r['true_over_noise']:.1f} noise")
