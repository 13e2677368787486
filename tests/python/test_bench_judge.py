"""The machines that a seed draws have the truth that they state, and their judge knows right from wrong."""

import dataclasses
import os
import pathlib
import subprocess
import sys
import types

import numpy as np
import pytest
from study import sampled

pytest.importorskip("scipy")
from scipy import integrate  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
PROGRAM = os.environ.get("LLMT_PROGRAM") or str(ROOT / "build/release/bin/llmt")
sys.path.insert(0, str(ROOT / "bench/logs"))

import generate  # noqa: E402
import rates  # noqa: E402
import verdicts  # noqa: E402
import way  # noqa: E402
from generate import draw, hidden, references, states, structure, terms  # noqa: E402

needs_program = pytest.mark.skipif(not pathlib.Path(PROGRAM).exists(), reason="the program llmt is not built")


def rms(x):
    return float(np.sqrt(np.mean(np.square(x))))


def test_a_seed_gives_the_same_log_again_and_another_seed_another():
    for seed in sampled((3, 12, 40), (3, 12)):
        first, again = (generate.run(generate.case(seed), 1) for _ in range(2))
        assert all(np.array_equal(first.log[name], again.log[name]) for name in first.log)
    assert not np.array_equal(generate.run(generate.case(8), 1).log["u"][:100], generate.run(generate.case(16), 1).log["u"][:100])


def test_the_kinds_share_the_seeds():
    kinds = [generate.kind_of(seed) for seed in range(1000, 1080)]
    assert all(kinds.count(kind) == 10 for kind in hidden.KINDS) and set(hidden.KINDS) == set(rates.KINDS)


@pytest.mark.parametrize("kind", references.KINDS)
def test_derivatives_of_references_are_exact(kind):
    motion = references.draw(np.random.default_rng(4), kind, 1.5, 0.7, 20.0)
    t, h = np.arange(0, 20, 0.013), 1e-4
    before, now, after = motion(t - h), motion(t), motion(t + h)
    assert np.abs(now[0]).max() > 0.2
    assert np.allclose((after[0] - before[0]) / (2 * h), now[1], atol=1e-3 * np.abs(now[1]).max())
    inside = np.abs(now[2] - (after[1] - before[1]) / (2 * h)) < 2e-3 * np.abs(now[2]).max()
    assert inside.mean() > 0.98  # where a step or a move begins, a difference reaches across


def test_linear_filter_is_the_solution_of_its_differential_equation():
    t = np.arange(4000) * 1e-3
    force = lambda t: np.sin(3 * t) + 0.3 * np.sin(11 * t)
    found = states.linear_filter([1.0], [0.2, 0.3, 150.0], force(t), 1e-3)
    right = lambda s, z: [z[1], (force(s) - 0.3 * z[1] - 150 * z[0]) / 0.2]
    wanted = integrate.solve_ivp(right, (0, t[-1]), [0, 0], t_eval=t, rtol=1e-9, atol=1e-12).y[0]
    assert np.abs(found - wanted).max() < 1e-5 * np.abs(wanted).max()


def test_an_elastic_joint_obeys_its_equations_of_motion():
    case = generate.case(3)
    assert case.machine.family == "gravity" and len(case.machine.axes) == 1
    fine, p = draw.fine_run(case, 1), case.parameters
    constants = {"share": 0.6, "zeta": 0.3}
    compliance = states.strength_of("elastic", fine, constants, 0.05 * rms(fine.target))
    inertia = constants["share"] * p["J"]
    damping = 2 * constants["zeta"] * np.sqrt(inertia / compliance)
    many = fine.t < fine.t[-1] / 3
    t, q, dq, ddq = fine.t[many], *(fine.signals[name][many] for name in ("q", "dq", "ddq"))

    def link(time, z):  # position and speed of the link
        torque = (np.interp(time, t, q) - z[0]) / compliance + damping * (np.interp(time, t, dq) - z[1])
        return [z[1], (torque - p["G"] * np.cos(z[0])) / inertia]

    start = [q[0] - compliance * p["G"] * np.cos(q[0]), dq[0]]
    z = integrate.solve_ivp(link, (0, t[-1]), start, t_eval=t, rtol=1e-9, atol=1e-12).y
    torque = (q - z[0]) / compliance + damping * (dq - z[1])
    missing = states.missing("elastic", fine, compliance, constants)[many]
    late = slice(len(t) // 2, None)  # when the ringing of the starts, which differ, has died out
    assert rms((torque - inertia * ddq - p["G"] * np.cos(q) - missing)[late]) < 0.02 * rms(missing[late])


@pytest.mark.parametrize("seed", [1, 2, 5, 6, 7, 10, 11, 21, 22, 23])
def test_what_is_hidden_is_what_the_nominal_model_lacks(seed):
    case = generate.case(seed)
    run = generate.run(case, 2)
    if case.hidden.function and way.by_past(case):
        pytest.skip("depends on the past")
    wanted = case.hidden.force(run.signals, run.simulated) + way.parameter_part(case, run.signals)
    own = "d" + case.machine.coordinates[case.machine.target_axis]
    moving = np.abs(run.signals[own]) > 0.05 * np.abs(run.signals[own]).max()
    assert np.median(np.abs(run.missing - wanted)[moving]) < 0.05 * case.chain.noise
    assert rms(wanted) > 0.1 * case.chain.noise


IN_LOOPS = (3, 19, 54, 71, 111)  # one and two axes, with and without dry friction


def test_a_loop_obeys_the_equation_of_motion_and_follows_its_reference():
    for case in map(generate.case, sampled(IN_LOOPS, IN_LOOPS[:2])):
        run = generate.run(case, 1)
        assert run.in_loop
        model = structure.output(case.machine, run.signals, case.parameters) + case.hidden.force(run.signals, run.simulated)
        own = case.machine.coordinates[case.machine.target_axis]
        speed = np.abs(run.signals["d" + own])
        moving = speed > 0.05 * np.quantile(speed, 0.95)
        assert np.median(np.abs(run.target - model)[moving]) < 0.1 * case.chain.noise
        wanted = draw.prescribed(case, 1, run.t)[own]
        assert rms(run.signals[own] - wanted) < 0.2 * rms(wanted - wanted.mean())
        # Positions are the integral of speeds, and these of accelerations.
        for name, rate in ((own, "d" + own), ("d" + own, "dd" + own)):
            change = np.cumsum(run.signals[rate]) / case.rate
            drift = (run.signals[name] - run.signals[name][0]) - (change - change[0])
            assert rms(drift - drift.mean()) < 0.05 * np.std(run.signals[name])


def test_half_the_step_of_integration_gives_the_same_signals():
    for case in map(generate.case, sampled((4, 12, 20, 28, 60, 76, *IN_LOOPS[:2]), (4, 28, IN_LOOPS[0]))):
        coarse, fine = generate.run(case, 1), generate.run(case, 1, 2 * draw.FINER)
        for name in case.machine.coordinates:
            # In a loop steps of the encoder fall otherwise.
            near = 3 * case.chain.resolutions[name] if case.in_loop else 1e-9
            assert rms(coarse.signals[name] - fine.signals[name]) < near
        if not case.in_loop:
            assert np.median(np.abs(coarse.target - fine.target)) < 0.05 * case.chain.noise


@needs_program
@pytest.mark.parametrize("seed", [0, 16, 24, 32, 40, 48, 56, 64])
def test_a_complete_machine_lacks_nothing_but_noise_where_model_and_log_go_through_one_filter(seed, tmp_path):
    case = generate.case(seed)
    run = generate.run(case, 2)
    assert not run.in_loop  # where it sticks, the model has no torque
    model = structure.output(case.machine, run.signals | draw.holding(case, run.signals), case.parameters)
    way.write(tmp_path / "log.csv", run.log | {"s": model})
    names = ",".join(case.machine.coordinates)
    words = [PROGRAM, "signals", tmp_path / "log.csv", "--time", "t", "--position", names, "--torque", "u,s"]
    subprocess.run([*words, "--cutoff", str(case.cutoff), "-o", tmp_path / "rows.csv"], check=True, capture_output=True)
    rows = way.read(tmp_path / "rows.csv")
    noise = generate.draw.measure.filtered_noise(case.chain, 1 / case.rate, case.cutoff)
    assert rms(rows["u"] - rows["s"]) < 2 * noise


@pytest.mark.parametrize("family", ["linear", "hinge", "stribeck", "hill", "wave", "sign_product"])
def test_terms_are_the_functions_of_the_documentation(family):
    x, y = np.linspace(0.1, 2, 50), np.linspace(-3, 3, 50)
    known = {
        "linear": (terms.Term("linear", ("y",), (), (2.0,)), 2 * y),
        "hinge": (terms.Term("hinge", ("y",), (("c", 1.0),), (3.0,)), 3 * np.where(y > 1, y - 1, 0)),
        "stribeck": (terms.Term("stribeck", ("y",), (("c", 0.5),)), np.sign(y) * np.exp(-4 * y**2)),
        "hill": (terms.Term("hill", ("x",), (("c", 0.7), ("n", 3.0))), x**3 / (0.7**3 + x**3)),
        "wave": (terms.Term("wave", ("y",), (("P", 2.0),), (1.0, 2.0)), np.cos(np.pi * y) + 2 * np.sin(np.pi * y)),
        "sign_product": (terms.Term("sign_product", ("y", "x")), np.sign(y) * x),
    }
    term, wanted = known[family]
    assert np.allclose(terms.value(term, {"x": x, "y": y}, x), wanted)


def effect(name, location, confirmed=True, rivals=(), **more):
    return {"name": name, "location": location, "confirmed": confirmed, "parameters": [], "rivals": list(rivals)} | more


def answer(*effects, verdict="named", unknown=None):
    return {"verdict": verdict, "effects": list(effects), "unknown": unknown, "parameters": []}


def a_case(*labels, regime=None, kind="effect"):
    case = generate.case(2)
    truth = tuple(terms.Term(family, place) for family, place in labels)
    return dataclasses.replace(case, kind=kind, hidden=hidden.Hidden(terms=truth, regime=regime))


def test_a_name_is_right_alone_or_in_a_group_of_twins():
    case = a_case(("tanh", ("dx",)))
    right = lambda said, error: verdicts.names_right(case, said, error, False)
    assert right(answer(effect("tanh", "dx")), 0.05)["alone"]
    assert not right(answer(effect("tanh", "dx")), 0.4)["alone"]  # its size is wrong
    assert not right(answer(effect("tanh", "x")), 0.05)["alone"]
    assert not right(answer(effect("tanh", "dx"), effect("sign", "x")), 0.05)["alone"]
    assert right(answer(effect("tanh", "dx"), effect("sign", "x")), 0.05)["listed"]
    twin = answer(effect("asinh", "dx", rivals=["tanh dx (c = 0.1)"]))
    assert right(twin, 0.05)["group"] and not right(twin, 0.2)["group"]
    assert not right(answer(effect("asinh", "dx", rivals=["tanh x (c = 0.1)"])), 0.05)["group"]
    two = a_case(("product", ("dx", "x")), ("sign", ("dx",)))
    both = answer(effect("product", "x,dx"), effect("sign", "dx"))
    assert verdicts.names_right(two, both, 0.01, False)["alone"]
    assert not verdicts.names_right(two, answer(effect("sign", "dx")), 0.01, False)["group"]


def test_a_regime_is_right_with_its_input_and_its_threshold():
    case = a_case(("linear", ("x",)), regime=("dx", 0.2), kind="regime")
    run = generate.run(case, 1)
    far = float(np.quantile(run.signals["dx"], 0.98))
    rows = types.SimpleNamespace(run=run, noise={"dx": 0.0})
    said = lambda **more: verdicts.regime_right(case, answer(effect("linear", "x", **more)), rows)
    assert said(regime={"input": "dx", "threshold": 0.2}) and said(regime="dx > 0.2")
    assert not said(regime={"input": "x", "threshold": 0.2}) and not said()
    assert not said(regime=f"dx > {far}")
    rows.noise["dx"] = 0.35 * (far - 0.2)
    assert said(regime=f"dx > {far}")
    rows.noise["dx"] = 0.3 * (far - 0.2)
    assert not said(regime=f"dx > {far}")


def test_an_inner_state_is_recognised_by_verdict_or_effect():
    assert verdicts.said_inner(answer(verdict="an inner state"))
    assert verdicts.said_inner(answer(effect("delay", "")))
    assert verdicts.said_inner(answer(verdict="unknown effect", unknown={"kind": "remembers for about 40"}))
    assert not verdicts.said_inner(answer(effect("linear", "x"), unknown={"kind": "smooth"}))


@needs_program
@pytest.mark.parametrize("seed", [0, 1, 10, 4])  # complete, parameters, effect, inner
def test_a_calibrated_simulation_lacks_the_same_beside_other_parameters(seed, tmp_path):
    case = generate.case(seed)
    rows = [way.signals(PROGRAM, case, number, tmp_path)[0] for number in (1, 2)]
    true = [part.simulated + way.true_gap(case, part) for part in rows]
    after = way.calibrated(case, *rows)
    columns = np.column_stack([rows[0].derivatives[name] for name in case.free])
    assert np.abs(columns.T @ (rows[0].table["u"] - rows[0].simulated)).max() < 1e-6 * np.abs(columns.T @ true[0]).max()
    assert after.kind == ("parameters" if case.kind == "complete" else case.kind)
    for part, whole in zip(rows, true):
        assert np.allclose(part.simulated + way.true_gap(after, part), whole, atol=0.02 * rms(whole))


def test_wilson_is_the_interval_of_his_paper():
    low, high = rates.wilson(8, 10)  # Newcombe 1998, method 3
    assert abs(low - 0.4902) < 1e-4 and abs(high - 0.9433) < 1e-4
    assert rates.wilson(0, 20)[0] == pytest.approx(0.0, abs=1e-12)


@needs_program
def test_the_way_of_a_user_leads_to_a_judged_line(tmp_path):
    import argparse

    import judge

    options = argparse.Namespace(program=PROGRAM, words=[], tell_noise=False, through_filter=False, calibrated=False, limit=60)
    result = judge.run(options, 1, str(tmp_path))
    assert result["kind"] == "parameters" and result["verdict"] and len(result["rests"]) == 4
    nominal, alone, true, after = result["rests"]
    assert true < nominal and alone < nominal and after is not None
    assert "parameters" in rates.line(result) and any("parameters" in text for text in rates.tables([result]))
