"""The study of bench/logs: its machines have the truth that its cases state, and its judge knows right from wrong."""

import copy
import dataclasses
import pathlib
import sys

import numpy as np
import pytest

pytest.importorskip("mujoco")
pytest.importorskip("scipy")

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "bench/logs"))

import fit_by_sysid  # noqa: E402
import logs  # noqa: E402
import machines  # noqa: E402
import motion  # noqa: E402
import repair  # noqa: E402
import score  # noqa: E402

CASES = logs.all_cases()


def short(name, seconds=3.0, **changes):
    return dataclasses.replace(CASES[name], seconds=60.0 if CASES[name].machine == "thermal" else seconds, **changes)


def test_same_seed_same_log_and_another_seed_another():
    for name in ("c1_all5", "gripper_all5", "thermal_fan_tau1"):
        first = logs.log_of(short(name), 1)
        logs.clean.cache_clear()
        again, other = logs.log_of(short(name), 1), logs.log_of(short(name), 2)
        assert np.array_equal(first.measured, again.measured) and np.array_equal(first.missing, again.missing)
        assert not np.array_equal(first.measured, other.measured)


# Without noise the signals of a log are the true ones.
TRUTHS = {
    "c1_tau5": lambda x: 1.5 * x["dq"] * abs(x["dq"]),
    "c2_tau5": lambda x: 12 * np.maximum(0, x["q"] - 0.25),
    "a_tau1": lambda x: np.sign(x["dq1"]) * np.exp(-((x["dq1"] / 0.15) ** 2)),
    "d_off_tau1": lambda x: 0.5 * x["ddq"] + 0.4 * x["dq"],
    "gripper_tau5": lambda x: 0.12 * x["grip"] * np.sign(x["dq"]),
    "gear_ripple_tau5": lambda x: 0.8 * np.cos(24 * x["q"]) + 0.5 * np.sin(24 * x["q"]),
    "gear_stribeck_tau5": lambda x: 1.2 * np.sign(x["dq"]) * np.exp(-((x["dq"] / 0.2) ** 2)),
    "gear_payload_tau5": lambda x: 2.5 * np.cos(x["q"]),
    "belt_hardening_tau5": lambda x: 4e9 * x["stretch"] ** 3,
    "thermal_fan_tau1": lambda x: -8 * x["fan"] ** 2,
    "thermal_radiation_tau1": lambda x: 2.8e-9 * (x["T"] ** 4 - 293.0**4),
    "pump_flow_tau5": lambda x: 2e-4 * x["w"] ** 2,
}


@pytest.mark.parametrize("name", TRUTHS)
def test_missing_torque_is_the_function_that_the_case_hides(name):
    log = logs.log_of(short(name, seconds=8.0 if name == "c2_tau5" else 3.0, noise=0.0, still=0.0), 1)
    speed = abs(log.signals.get("dq", log.signals.get("dq1", np.ones(1))))
    # A body that sticks needs less than its friction, and MuJoCo's friction is soft around standstill.
    moving = np.broadcast_to(speed > (0.005 if CASES[name].machine == "gripper" else 0.1), log.missing.shape)
    expected = TRUTHS[name](log.signals)[moving]
    assert abs(expected).max() > 0
    assert np.allclose(log.missing[moving], expected, atol=1e-6 * abs(expected).max())
    assert np.allclose(log.measured - log.simulated, log.missing)


@pytest.mark.parametrize("name", [n for n, c in CASES.items() if score.is_complete(c) and c.still and c.seconds < 100])
def test_complete_model_lacks_nothing_while_the_machine_moves(name):
    log = logs.log_of(short(name, noise=0.0, noisy="tau", preparation="plain"), 1)
    assert abs(log.missing).max() < 1e-9 * max(1.0, abs(log.measured).max())


def effect(name, location, values, errors=None, confirmed=True):
    errors = errors or [0.01] * len(values)
    parameters = [{"name": "a", "value": v, "std_error": e} for v, e in zip(values, errors)]
    return {"name": name, "location": location, "parameters": parameters, "confirmed": confirmed}


def document(*effects, verdict="named", **others):
    return {"verdict": verdict, "effects": list(effects), "unknown": None, "gap": {"before": 1.0, "after": 0.5}} | others


DRAG = effect("signed_square", "dq", [1.49], [0.01])


def test_judge_knows_the_right_term_alone_and_among_others():
    case = CASES["c1_all5"]
    alone = score.judge(document(DRAG), case)
    assert alone["alone"] and alone["listed"] and not alone["wrong"] and alone["cover"] == [1, 1]
    beside = score.judge(document(DRAG, effect("rate", "ddq", [-1.0])), case)
    assert not beside["alone"] and beside["listed"] and beside["wrong"] and not beside["tentative"]
    tentative = score.judge(document(effect("rate", "ddq", [-1.0], confirmed=False)), case)
    assert not tentative["listed"] and not tentative["wrong"] and tentative["tentative"]
    assert not score.judge(document(DRAG, unknown={"kind": "smooth"}), case)["alone"]


def test_judge_takes_a_right_rival_for_listed():
    case = CASES["c1_all5"]
    cube = effect("cube", "dq", [1.3]) | {"rivals": ["signed_square dq"]}
    verdict = score.judge(document(cube), case)
    assert verdict["listed"] and not verdict["alone"] and not verdict["wrong"]
    assert score.judge(document(cube | {"rivals": ["tanh dq"]}), case)["wrong"]


def test_judge_takes_a_wrong_coefficient_or_place_for_wrong():
    case = CASES["c1_all5"]
    for wrong in (effect("signed_square", "dq", [-1.5]), effect("signed_square", "q", [1.5]), effect("cube", "dq", [1.5])):
        verdict = score.judge(document(wrong), case)
        assert not verdict["listed"] and verdict["wrong"]
    assert score.judge(document(effect("signed_square", "dq", [1.4], [0.01])), case)["cover"] == [0, 1]


def test_judge_knows_false_alarms():
    case = CASES["d_exact_all5"]
    nothing = score.judge(document(verdict="nothing missing"), case)
    assert nothing["nothing"] and not nothing["alarm"]
    assert score.judge(document(effect("rate", "q", [1.0], confirmed=False)), case)["alarm"]
    assert score.judge(document(verdict="unknown effect"), case)["alarm"]
    assert not score.judge(document(verdict="unknown effect"), CASES["c1_all5"])["alarm"]


def test_judge_takes_derivatives_for_parameters_under_either_name():
    case = CASES["c1d_derivatives_all1"]
    as_terms = [effect("linear", "J_m", [0.5]), effect("linear", "dq", [0.39])]
    assert score.judge(document(DRAG, *as_terms), case)["parameters"]
    assert score.judge(document(DRAG, *as_terms), case)["alone"]
    as_parameters = [{"name": "m", "change": 0.5, "std_error": 0.01}, {"name": "b", "change": 0.9, "std_error": 0.01}]
    verdict = score.judge(document(DRAG, parameters=as_parameters), case)
    assert verdict["alone"] and not verdict["parameters"] and verdict["cover"] == [2, 3]


def in_words(named, expression):
    return named | {"expression": expression}


TRUE = {
    "c1d_tau1": (
        in_words(DRAG, "1.5*(dq*abs(dq))"),
        effect("linear", "ddq", [0.5]),
        effect("linear", "dq", [0.4]),
        in_words(effect("rate", "q", [1.0]), None),
    ),
    "c2_tau5": (in_words(effect("hinge", "q", [12.0, 0.25]), "12*(max(0, q - 0.25))"),),
    "a_tau1": (in_words(effect("stribeck", "dq1", [1.0, 0.15]), "1*(sign(dq1)*exp(-((dq1/0.15)^2)))"),),
    "gripper_tau5": (in_words(effect("sign_product", "dq,grip", [0.12]), "0.12*(sign(dq)*abs(grip))"),),
    "gear_payload_tau5": (in_words(effect("harmonic1", "q", [2.5, 0.0]), "2.5*(cos(1*q)) + 0*(sin(1*q))"),),
    "belt_hardening_tau5": (in_words(effect("cube", "stretch", [4e9]), "4e9*(stretch^3)"),),
}


@pytest.mark.parametrize("name", TRUE)
def test_true_effects_make_the_model_move_as_the_machine(name, monkeypatch):
    monkeypatch.setattr(motion, "SECONDS", 2.0)
    case = CASES[name]
    model = repair.repaired(document(*copy.deepcopy(TRUE[name]), unknown_all=[]), case)
    assert model.left_out == (["rate q"] if name == "c1d_tau1" else [])
    run = motion.HeldOut(case, 1)
    assert run.open(model) < 1e-9 < 1e-6 < run.open(repair.Model())
    assert run.closed(model) < 1e-9 < 1e-6 < run.closed(repair.Model())


def test_a_spring_in_the_drive_makes_the_rigid_model_elastic(monkeypatch):
    monkeypatch.setattr(motion, "SECONDS", 2.0)
    spring = in_words(effect("drive_spring", "q", [1 / 150, 0.05 / 150, 0.3 / 150]), None)
    model = repair.repaired(document(spring, verdict="an inner state", unknown_all=[]), CASES["b_all1"])
    assert model.has_spring and dict(model.changes)["k"] == pytest.approx(150.0)
    run = motion.HeldOut(CASES["b_all1"], 1)  # the damping of the spring stays unknown
    assert run.open(model) < 0.2 * run.open(repair.Model())
    assert run.closed(model) < 0.2 * run.closed(repair.Model())


def test_what_the_answer_does_not_stand_for_is_not_put_into_the_model():
    drag = in_words(DRAG, "1.5*(dq*abs(dq))")
    for verdict in ("nothing missing", "failed on held-out rows"):
        assert repair.repaired(document(drag, verdict=verdict, unknown_all=[]), CASES["c1_all1"]) == repair.Model()
    unseen = repair.repaired(document(drag | {"shrinks_gap": False}, unknown_all=[]), CASES["c1_all1"])
    assert not unseen.effects and unseen.left_out == ["signed_square dq (shrinks no gap)"]
    delay = in_words(effect("delay", "", [0.01]) | {"inner_state": "a delay"}, None)
    beside = repair.repaired(document(delay, drag, verdict="an inner state", unknown_all=[]), CASES["c1_all1"])
    assert not beside.effects and beside.left_out == ["delay", "signed_square dq"]


def test_parameters_alone_are_those_of_the_machine():
    case = short("d_off_tau1", seconds=10.0, noise=0.0)
    assert dict(repair.fitted_parameters(case, logs.log_of(case, 1)).changes) == pytest.approx(
        {"m": 3.5, "b": 1.4, "f": 0.5}, rel=0.02
    )


def test_sysid_gets_the_machine_with_motors_and_sensors():
    mujoco = pytest.importorskip("mujoco")
    for machine in ("arm", "cart", "elastic"):
        given = mujoco.MjModel.from_xml_string(fit_by_sysid.text_of(machine, {}))
        nominal = machines.model(machine, machines.as_key(machine, ()))
        assert given.nu == given.nv == nominal.nv and given.nsensordata == 2 * nominal.nv
        assert np.array_equal(given.dof_damping, nominal.dof_damping)
        assert np.array_equal(given.body_mass, nominal.body_mass)
    assert mujoco.MjModel.from_xml_string(fit_by_sysid.text_of("arm", {"m1": 2.5})).body_mass[1] == 2.5
