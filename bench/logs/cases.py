"""The cases of the study: which machine, what it hides, how it was logged, and what a right answer is.

A `Case` names signals as machines.py does. `truth` are the terms that the answer should hold. A term is right under
any of the names in `accepted`; its coefficients are compared with `values` in their order.
"""

import dataclasses


@dataclasses.dataclass(frozen=True)
class Term:
    accepted: tuple  # "family location", the first one is what we would print
    values: tuple  # coefficients, in the order of the answer
    output: str = ""  # default: the only target


@dataclasses.dataclass(frozen=True)
class Case:
    name: str
    machine: str
    effects: tuple = ()
    changes: tuple = ()  # of parameters, (name, value of the real machine)
    preparation: str = "plain"  # see logs.py
    noise: float = 0.01  # of the standard deviation of a signal
    noisy: str = "tau"  # "tau": the target only; "all": every signal
    rows: str = "tenth"  # "tenth" or "all"
    still: float = 0.0  # rows with |dq| of the first joint below this are dropped
    seconds: float = 20.0
    runs: int = 1
    correlation: float = 0.2  # s, of the noise where it is correlated
    inputs: tuple = ("q", "dq", "ddq")
    target: str = "tau"
    truth: tuple = ()
    tolerated: tuple = ()  # names of small parts of the same physics, neither right nor wrong
    parameters: tuple = ()  # parameters whose derivatives are given, with the change that is true
    inner: bool = False  # the right answer: an inner state
    refused: bool = False  # the right answer: an error


def drag(value=1.5, of="dq"):
    return Term((f"signed_square {of}",), (value,))


CABLE = Term(("hinge q",), (12.0, 0.25))
STRIBECK = Term(("stribeck dq1",), (1.0, 0.15))
MASS, DAMPING = Term(("linear ddq",), (0.5,)), Term(("linear dq",), (0.4,))
ARM = ("q1", "dq1", "ddq1", "q2", "dq2", "ddq2")
CART_OFF = (("m", 3.5), ("b", 1.4))
ARM_OFF = (("m1", 2.3), ("m2", 1.15), ("b1", 0.42), ("f1", 1.0))
ARM_CHANGES = (("m1", 0.3), ("m2", 0.15), ("b1", 0.12), ("f1", 0.2))
MOVING = 0.03  # rad/s or m/s


def variants(name, levels, **common):
    """name_tau5 and the like: one case for each kind and level of noise."""
    for level in levels:
        noisy, percent = level[:3], int(level[3:])
        yield Case(f"{name}_{level}", noisy=noisy, noise=percent / 100, **common)


def arm_cases():
    a = dict(machine="arm", inputs=ARM, target="tau1")
    stribeck = dict(effects=("stribeck",), truth=(STRIBECK,), **a)
    yield from variants("a", ["tau1", "tau5", "all1", "all5"], still=MOVING, **stribeck)
    yield from variants("a_standing", ["all1"], **stribeck)
    yield from variants("a_lowpass", ["all1", "all5"], preparation="lowpass8", still=MOVING, **stribeck)
    yield from variants("arm_exact", ["tau1", "all1"], **a)
    yield from variants("arm_exact_lowpass", ["all1"], preparation="lowpass8", still=MOVING, **a)
    # Masses 15 % off change gravity and inertia together: without derivatives there is no name to be right.
    yield from variants("arm_off_derivatives", ["tau1", "all1"], changes=ARM_OFF, still=MOVING, parameters=ARM_CHANGES, **a)
    both = dict(changes=ARM_OFF[:3], still=MOVING, parameters=ARM_CHANGES[:3], **stribeck)
    yield from variants("ad_derivatives", ["tau1", "all1"], **both)


def elastic_cases():
    b = dict(machine="elastic", inner=True)
    yield from variants("b", ["all1", "all5"], **b)
    yield from variants("b_lowpass", ["all1"], preparation="lowpass8", **b)
    yield from variants("b_allrows", ["all1"], rows="all", **b)
    second = dict(b, preparation="second_derivatives", inputs=("d2ddq", "d2u", "q", "dq", "ddq"))
    yield from variants("b_second_derivatives", ["all1"], **second)
    spring = Term(("linear tau_gear",), (-1 / 150,))
    two = dict(preparation="two_encoders", inputs=("q", "dq", "ddq", "tau_gear"), target="q_link", truth=(spring,))
    two |= dict(tolerated=("linear dq", "rate tau_gear"))  # the damping of the spring
    yield from variants("b_two", ["all1", "all5"], machine="elastic", **two)


def cart_cases():
    c = dict(machine="cart")
    hidden = {"c1": dict(effects=("drag",), truth=(drag(),), **c), "c2": dict(effects=("cable",), truth=(CABLE,), **c)}
    for name, case in hidden.items():
        yield from variants(name, ["tau5", "all1", "all5"], **case)
        yield from variants(f"{name}_encoder", ["tau1"], preparation="encoder", **case)
        yield from variants(f"{name}_encoder_lowpass", ["tau1"], preparation="encoder_lowpass", still=MOVING, **case)
        off = dict(case, changes=CART_OFF, truth=(*case["truth"], MASS, DAMPING), still=MOVING)
        yield from variants(f"{name}d", ["tau1", "tau5"], **off)
        parameters = dict(off, truth=case["truth"], parameters=(("m", 0.5), ("b", 0.4)))
        yield from variants(f"{name}d_derivatives", ["tau5", "all1"], **parameters)
    c1 = hidden["c1"]
    yield from variants("c1_lowpass", ["all1", "all5"], preparation="lowpass8", **c1)
    step = dict(c1, truth=(drag(-0.5),), preparation="one_step", inputs=("q", "dq", "u"), target="ddq")
    yield from variants("c1_one_step", ["all1"], **step)
    yield from variants("c1_correlated", ["tau5"], preparation="correlated", rows="fifth", **c1)
    yield from variants("c1_runs", ["all5"], runs=3, seconds=8.0, **c1)
    yield from variants("c1_allrows", ["all5"], rows="all", **c1)
    yield from variants("d_exact", ["tau1", "tau5", "all1", "all5"], **c)
    yield from variants("d_exact_allrows", ["all5"], rows="all", **c)
    yield from variants("c1_long", ["tau5"], rows="all", seconds=100.0, **c1)
    yield from variants("d_exact_long", ["tau5"], rows="all", seconds=100.0, **c)
    yield from variants("d_exact_runs", ["all5"], runs=3, seconds=8.0, **c)
    yield from variants("d_exact_correlated", ["tau5"], preparation="correlated", rows="fifth", **c)
    yield from variants("d_exact_encoder", ["tau1"], preparation="encoder", **c)
    yield from variants("d_exact_encoder_lowpass", ["tau1"], preparation="encoder_lowpass", still=MOVING, **c)
    yield from variants("d_exact_ten_kilohertz", ["tau2"], preparation="ten_kilohertz", rows="all", seconds=2.0, **c)
    off = dict(c, changes=CART_OFF, truth=(MASS, DAMPING))
    yield from variants("d_off", ["tau1", "tau5", "all1", "all5"], **off)
    off = dict(c, changes=CART_OFF, parameters=(("m", 0.5), ("b", 0.4)))
    yield from variants("d_off_derivatives", ["tau1", "all1", "all5"], **off)
    right = dict(c, parameters=(("m", 0.0), ("b", 0.0)))
    yield from variants("d_exact_derivatives", ["all1", "all5"], **right)
    leak = dict(c, inputs=("q", "dq", "ddq", "u"), refused=True)
    yield Case("leak", **leak)


def gripper_cases():
    g = dict(machine="gripper", inputs=("q", "dq", "ddq", "grip"), still=0.002)
    friction = Term(("sign_product dq,grip",), (0.12,))
    yield from variants("gripper", ["tau5", "all1", "all5"], effects=("load_friction",), truth=(friction,), **g)
    yield from variants("gripper_exact", ["tau5", "all1", "all5"], **g)
    yield from variants("gripper_exact_standing", ["all1"], **dict(g, still=0.0))


def gear_cases():
    g = dict(machine="gear", still=MOVING)
    stribeck = Term(("stribeck dq",), (1.2, 0.2))
    ripple = Term(("wave q",), (0.8, 0.5, 2 * 3.141592653589793 / 24))
    yield from variants("gear_stribeck", ["tau5", "all5"], effects=("stribeck",), truth=(stribeck,), **g)
    yield from variants("gear_ripple", ["tau5", "all5"], effects=("ripple",), truth=(ripple,), **g)
    yield from variants("gear_both", ["tau1", "all1"], effects=("stribeck", "ripple"), truth=(stribeck, ripple), **g)
    payload = Term(("harmonic1 q",), (2.5, 0.0))
    yield from variants("gear_payload", ["tau5", "all5"], effects=("payload",), truth=(payload,), **g)
    yield from variants("gear_exact", ["tau5", "all1", "all5"], **g)
    yield from variants("gear_exact_allrows", ["all5"], rows="all", **g)
    off = dict(g, changes=(("J", 1.38), ("b", 2.5)), parameters=(("J", 0.18), ("b", 0.5)))
    yield from variants("gear_off_derivatives", ["all5"], **off)
    yield from variants("gear_stribeck_off_derivatives", ["all1"], effects=("stribeck",), truth=(stribeck,), **off)


def belt_cases():
    b = dict(machine="belt", still=MOVING)
    with_stretch = dict(b, inputs=("q", "dq", "ddq", "stretch", "dstretch"))
    tension = Term(("linear tension",), (-1 / 20000,))
    two = dict(b, preparation="two_encoders", inputs=("q", "dq", "ddq", "tension"), target="q_b", truth=(tension,))
    two |= dict(tolerated=("linear dq", "rate tension"))
    yield from variants("belt_two", ["all1"], **two)
    yield from variants("belt_rigid", ["all1"], preparation="rigid_belt", inner=True, **b)
    hardening = Term(("cube stretch",), (4e9,))
    yield from variants("belt_hardening", ["tau5", "all1"], effects=("hardening",), truth=(hardening,), **with_stretch)
    yield from variants("belt_exact", ["tau5", "all1", "all5"], **with_stretch)


def other_cases():
    """A thermal plant sampled each second, and a pump."""
    t = dict(machine="thermal", inputs=("T", "dT", "fan"), target="power", seconds=6000.0, rows="fifth",
             preparation="correlated", correlation=30.0)
    fan = Term(("square fan",), (-8.0,))
    radiation = Term(("power T", "power4 T"), (2.8e-9, 4.0))
    yield from variants("thermal_fan", ["tau1"], effects=("fan_heat",), truth=(fan,), **t)
    yield from variants("thermal_radiation", ["tau1"], effects=("radiation",), truth=(radiation,), **t)
    yield from variants("thermal_exact", ["tau1", "tau5"], **t)
    p = dict(machine="pump", inputs=("w", "dw"))
    flow = Term(("square w", "signed_square w"), (2e-4,))
    yield from variants("pump_flow", ["tau5", "all5"], effects=("flow",), truth=(flow,), **p)
    yield from variants("pump_exact", ["tau5", "all5"], **p)
    yield from variants("pump_exact_correlated", ["tau5"], preparation="correlated", rows="fifth", **p)


def all_cases():
    ours = [*gripper_cases(), *gear_cases(), *belt_cases(), *other_cases()]
    cases = [*arm_cases(), *elastic_cases(), *cart_cases(), *ours]
    return {case.name: case for case in cases}
