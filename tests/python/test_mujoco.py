"""llmt.mujoco: inverse dynamics against recompiled models, and what was found put into a model."""

import numpy as np
import pytest

import llmt

mujoco = pytest.importorskip("mujoco")
import llmt.mujoco as lm  # noqa: E402

ARM = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="upper">
      <inertial pos="0.01 0 -0.2" mass="2" diaginertia="0.02 0.02 0.004"/>
      <joint name="shoulder" axis="0 1 0" damping="0.3" frictionloss="0.8" armature="0.02"/>
      <body name="fore" pos="0 0 -0.4">
        <inertial pos="0 0.02 -0.15" mass="1" diaginertia="0.01 0.01 0.002"/>
        <joint name="elbow" axis="1 1 0" damping="0.15" frictionloss="0.2" armature="0.01"/>
      </body>
    </body>
  </worldbody>
</mujoco>
"""
KINDS = ["mass", "com", "inertia", "armature", "damping", "frictionloss"]


@pytest.fixture
def spec():
    return mujoco.MjSpec.from_string(ARM)


@pytest.fixture(scope="module")
def motion():
    rng = np.random.default_rng(0)
    return {name: rng.normal(size=30) for name in ("q1", "q2", "dq1", "dq2", "ddq1", "ddq2")}


def values_of(parameters):
    return {name: parameter.value for name, parameter in parameters.items()}


def test_inverse_dynamics_are_those_of_the_model_with_the_values(spec, motion):
    parameters = lm.parameters(spec, KINDS)
    assert len(parameters) == 2 * (1 + 3 + 6 + 3)
    values = {name: value + 2e-4 * (k % 3) for k, (name, value) in enumerate(values_of(parameters).items())}
    given = lm.inverse_dynamics(spec, parameters)(values, motion)
    # The oracle: the same numbers written into the specification, and mj_inverse of what is compiled from it.
    other = spec.copy()
    for body in ("upper", "fore"):
        element = other.body(body)
        element.mass = values[f"mass {body}"]
        element.ipos = [values[f"com_{axis} {body}"] for axis in "xyz"]
        element.inertia = np.zeros(3)
        element.fullinertia = [values[f"inertia_{axes} {body}"] for axes in ("xx", "yy", "zz", "xy", "xz", "yz")]
    for joint in ("shoulder", "elbow"):
        element = other.joint(joint)
        element.armature, element.frictionloss = values[f"armature {joint}"], values[f"frictionloss {joint}"]
        damping = np.array(element.damping, dtype=float)
        damping.flat[0] = values[f"damping {joint}"]
        element.damping = damping
    model = other.compile()
    data = mujoco.MjData(model)
    for row in range(30):
        for k in range(2):
            name = f"q{k + 1}"
            data.qpos[k], data.qvel[k], data.qacc[k] = (motion[prefix + name][row] for prefix in ("", "d", "dd"))
        mujoco.mj_inverse(model, data)
        np.testing.assert_allclose(given[row], data.qfrc_inverse, atol=1e-9)


def test_the_jacobian_is_that_of_differences(spec, motion):
    parameters = lm.parameters(spec, KINDS)
    simulate = lm.inverse_dynamics(spec, parameters)
    values = values_of(parameters)
    jacobian = simulate.jacobian(values, motion)
    assert jacobian.shape == (30, 2, len(parameters))
    for k, name in enumerate(parameters):
        above, below = (simulate({**values, name: values[name] + step}, motion) for step in (1e-5, -1e-5))
        np.testing.assert_allclose(jacobian[:, :, k], (above - below) / 2e-5, atol=1e-5)


def test_joints_columns_and_names_that_do_not_fit_are_refused(spec, motion):
    with pytest.raises(ValueError, match="kinds has 'size'"):
        lm.parameters(spec, "size")
    with pytest.raises(ValueError, match="'mass elbow' is no parameter"):
        lm.inverse_dynamics(spec, {"mass elbow": 1.0})
    simulate = lm.inverse_dynamics(spec)
    with pytest.raises(ValueError, match="the model has 2 joints, inputs has the positions q1"):
        simulate({}, {name: column for name, column in motion.items() if "2" not in name})
    free = mujoco.MjSpec.from_string(
        '<mujoco><worldbody><body><freejoint name="f"/><geom size="1"/></body></worldbody></mujoco>'
    )
    with pytest.raises(ValueError, match="'f' is neither a hinge nor a slide"):
        lm.inverse_dynamics(free)


CART = """
<mujoco>
  <option timestep="0.001" integrator="implicitfast"/>
  <worldbody>
    <body name="cart">
      <inertial pos="0 0 0" mass="3" diaginertia="0.01 0.01 0.01"/>
      <joint name="rail" type="slide" axis="1 0 0" damping="1" frictionloss="0.5"/>
    </body>
  </worldbody>
</mujoco>
"""


def drive(seconds, seed, mass=3.0, force=None):
    """A log of the cart at 500 Hz."""
    spec = mujoco.MjSpec.from_string(CART)
    spec.body("cart").mass = mass
    model = spec.compile()
    data, rng = mujoco.MjData(model), np.random.default_rng(seed)
    phases = rng.uniform(0, 6.28, 3)
    rows = []
    for step in range(int(1000 * seconds)):
        goal = 0.3 * np.sin(np.array([0.7, 2.1, 3.3]) * data.time + phases).sum()
        push = 400.0 * (goal - data.qpos[0]) - 60.0 * data.qvel[0]
        if step % 2 == 0:
            rows.append([data.time, data.qpos[0] + 1e-6 * rng.normal(), push])
        data.qfrc_applied[0] = push - (force(data.qpos[0], data.qvel[0]) if force else 0.0)
        mujoco.mj_step(model, data)
    return {name: np.array(column) for name, column in zip(("t", "x", "u"), zip(*rows))}


LOG = {"time": "t", "position": "x", "torque": "u", "cutoff": 20.0}


def drag(x, v):
    return 1.5 * v * abs(v)


def test_what_is_found_makes_the_replay_of_another_run_right():
    spec = mujoco.MjSpec.from_string(CART)
    rows = llmt.signals(drive(16.0, 1, 3.5, drag), **LOG)
    parameters = lm.parameters(spec, ["mass", "damping"])
    found = llmt.discover(lm.inverse_dynamics(spec, parameters), parameters, rows.inputs, rows.torques, signals=rows)
    assert "dx |dx|" in [term["formula"] for term in found.to_dict()["effects"]]
    other = drive(6.0, 2, 3.5, drag)
    fixed, callback = found.mujoco(spec)
    assert fixed.body("cart").mass == pytest.approx(3.5, abs=0.02)
    assert spec.body("cart").mass == 3.0
    before, after = lm.replay(spec, other, **LOG), lm.replay(fixed, other, callback=callback, **LOG)
    assert after.rms["x"] < 0.1 * before.rms["x"]
    assert len(after.time) == len(after.measured) == len(after.simulated)


def expression_of(name, x, values):
    """As ``llmt discover --json`` writes it."""
    return {
        "linear": lambda k: f"{k}*({x})",
        "sign": lambda k: f"{k}*(sign({x}))",
        "signed_square": lambda k: f"{k}*({x}*abs({x}))",
        "cube": lambda k: f"{k}*({x}^3)",
        "tanh": lambda k, c: f"{k}*(tanh({x}/{c}))",
        "harmonic1": lambda a, b: f"{a}*(cos(1*{x})) + {b}*(sin(1*{x}))",
        "product": lambda k: f"{k}*(x*dx)",
        "gain": lambda k: f"{k}*(u)",
        "square_of_acceleration": lambda k: f"{k}*(ddx^2)",
    }.get(name, lambda *_: None)(*values)


class Found:
    """A result with given terms, as apply() reads one."""

    def __init__(self, *terms, verdict="named", may_be_applied=True, parameters=(), **marks):
        self.terms, self.parameters, self.marks = terms, parameters, marks
        self.answer = {"verdict": verdict, "may_be_applied": may_be_applied}

    def to_dict(self):
        effects = [
            {
                "name": name,
                "location": location,
                "output": "u",
                "formula": name,
                "expression": expression_of(name, location, values),
                "regime": None,
                "parameters": [{"value": value} for value in values],
            }
            | self.marks
            for name, location, *values in self.terms
        ]
        inputs = [{"name": name, "word": name, "low": -1.0, "high": 1.0} for name in ("x", "dx", "ddx")]
        columns = {"inputs": inputs, "outputs": [{"name": "u", "word": "u"}], "order": "", "unknown_all": []}
        return self.answer | {"parameters": self.parameters, "effects": effects} | columns


def test_terms_of_the_own_motion_become_fields():
    cart = mujoco.MjSpec.from_string(CART)
    fixed, callback = lm.apply(
        Found(("linear", "dx", 0.4), ("sign", "dx", 0.3), ("linear", "ddx", 0.2), ("linear", "x", 7.0)), cart
    )
    assert callback is None
    model = fixed.compile()
    assert model.dof_damping[0] == pytest.approx(1.4) and model.dof_frictionloss[0] == pytest.approx(0.8)
    assert model.dof_armature[0] == pytest.approx(0.2) and model.jnt_stiffness[0] == pytest.approx(7.0)


@pytest.mark.parametrize(
    "family, values",
    [("signed_square", [1.5]), ("tanh", [0.7, 0.2]), ("cube", [0.4]), ("harmonic1", [0.3, -0.8]), ("product", [2.0])],
)
def test_forces_have_the_sign_that_gives_the_needed_torque(family, values):
    """Forward dynamics with the callback, then inverse dynamics of the model without it: the term is what is left."""
    cart = mujoco.MjSpec.from_string(CART)
    fixed, callback = lm.apply(Found((family, "dx", *values)), cart)
    model = fixed.compile()
    data = mujoco.MjData(model)
    data.qpos[0], data.qvel[0], data.qfrc_applied[0] = 0.2, 0.6, 4.0
    callback(model, data)
    mujoco.mj_forward(model, data)
    needed = lm.inverse_dynamics(cart)({}, {"x": [0.2], "dx": [0.6], "ddx": [float(data.qacc[0])]})[0, 0]
    term = {
        "signed_square": 1.5 * 0.6**2,
        "tanh": 0.7 * np.tanh(3.0),
        "cube": 0.4 * 0.6**3,
        "harmonic1": 0.3 * np.cos(0.6) - 0.8 * np.sin(0.6),
        "product": 2.0 * 0.2 * 0.6,
    }[family]
    assert 4.0 - needed == pytest.approx(term, abs=1e-6)


def test_friction_that_falls_with_speed_is_friction_of_the_joint():
    cart = mujoco.MjSpec.from_string(CART)
    fixed, callback = lm.apply(Found(("stribeck", "dx", 1.0, 0.15)), cart)
    model = fixed.compile()
    data = mujoco.MjData(model)
    for speed, friction in ((0.0, 1.5), (0.15, 0.5 + np.exp(-1.0)), (-3.0, 0.5)):
        data.qvel[0] = speed
        callback(model, data)
        assert model.dof_frictionloss[0] == pytest.approx(friction)


def test_what_mujoco_cannot_take_is_named():
    cart = mujoco.MjSpec.from_string(CART)
    with pytest.warns(UserWarning, match="gain of the output"):
        fixed, callback = lm.apply(Found(("gain", "", 0.1)), cart)
    assert callback is None
    heavier = {"parameters": [{"name": "mass cart", "value": 3.5, "change": 0.5}]}
    for term in (("gain", "", 0.1), ("square_of_acceleration", "ddx", 0.2)):
        with pytest.warns(UserWarning, match="nothing is changed: parameters were fitted beside what cannot be put in"):
            fixed, callback = lm.apply(Found(term, ("cube", "dx", 0.4), **heavier), cart)
        assert callback is None and fixed.body("cart").mass == 3.0


def test_what_the_answer_does_not_stand_for_stays_as_it_was():
    cart = mujoco.MjSpec.from_string(CART)
    heavier = {"parameters": [{"name": "mass cart", "value": 3.01, "change": 0.01}]}
    for verdict in ("nothing missing", "undecided", "failed on held-out rows"):
        fixed, callback = lm.apply(Found(("cube", "dx", 0.4), verdict=verdict, may_be_applied=False, **heavier), cart)
        assert callback is None and fixed.body("cart").mass == 3.0
    fixed, _ = lm.apply(Found(verdict="undecided", **heavier), cart)
    assert fixed.body("cart").mass == 3.01
    delay = Found(("delay", "", 0.01), verdict="an inner state", inner_state="a delay", **heavier)
    with pytest.warns(UserWarning, match=r"nothing is changed: .* inner state delay of the output"):
        fixed, callback = lm.apply(delay, cart)
    assert callback is None and fixed.body("cart").mass == 3.0
    with pytest.warns(UserWarning, match=r"cube of dx .*did not shrink the gap"):
        fixed, callback = lm.apply(Found(("cube", "dx", 0.4), shrinks_gap=False, **heavier), cart)
    assert callback is None and fixed.body("cart").mass == 3.0
