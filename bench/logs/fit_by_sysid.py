"""Parameters of a machine of MuJoCo fitted by mujoco.sysid, as its user would (pip install 'mujoco[sysid]').

The log of run 0 with all its rows, 500 a second, is cut into windows of 1 s. In each the model starts at the logged
position and velocity and is driven by the logged torques; sysid fits the parameters to positions and velocities.
"""

import contextlib
import dataclasses
import io

import mujoco
import numpy as np

import logs
import machines
from repair import FITTED, Model

WINDOW = machines.RATE  # rows


def text_of(machine, values):
    """MJCF of the nominal machine with motors, and with sensors of position and velocity."""
    text = machines.model_text(machine, {**machines.PARAMETERS[machine], **values})
    count, pieces = 0, text.split("<joint ")
    for k in range(1, len(pieces)):
        pieces[k] = f'name="j{count}" ' + pieces[k].replace(f'name="{count + 1}" ', "", 1)
        count += 1
    motors = "".join(f'<motor joint="j{k}"/>' for k in range(count))
    sensors = "".join(f'<joint{what} name="{what}{k}" joint="j{k}"/>' for what in ("pos", "vel") for k in range(count))
    return "<joint ".join(pieces).replace("</mujoco>", f"<actuator>{motors}</actuator><sensor>{sensors}</sensor></mujoco>")


def fitted(case, seed):
    """The fitted Model."""
    from mujoco import sysid

    machine = case.machine
    logged, _ = logs.one_run(dataclasses.replace(case, rows="all", still=0.0), seed, 0)
    spec = mujoco.MjSpec.from_string(text_of(machine, {}))
    nominal = spec.compile()
    q, dq, u = machines.columns(logged, ["q", "dq", "u"], nominal.nv)
    t = logged["t"] - logged["t"][0]
    windows = [slice(k, k + WINDOW) for k in range(0, len(t) - WINDOW + 1, WINDOW)]
    starts = [sysid.create_initial_state(nominal, q[w.start], dq[w.start]) for w in windows]
    times = t[:WINDOW]
    sequences = sysid.ModelSequences(
        machine,
        spec,
        [f"window{k}" for k in range(len(windows))],
        starts,
        [sysid.TimeSeries(times, u[w]) for w in windows],
        [sysid.TimeSeries.from_names(times, np.column_stack([q[w], dq[w]]), nominal) for w in windows],
    )
    free = sysid.ParameterDict()
    for name in FITTED[machine]:
        value = machines.PARAMETERS[machine][name]
        free.add(sysid.Parameter(name, nominal=value, min_value=0.0, max_value=5 * value))

    def build(parameters, _):
        return mujoco.MjModel.from_xml_string(
            text_of(machine, {name: max(1e-6, parameters[name].value[0]) for name in FITTED[machine]})
        )

    residuals = sysid.build_residual_fn(models_sequences=[sequences], build_model=build, n_threads=1)
    with contextlib.redirect_stdout(io.StringIO()):  # a line for each of its iterations
        found, _ = sysid.optimize(free, residuals, verbose=False)
    return Model(tuple((name, max(1e-6, float(found[name].value[0]))) for name in FITTED[machine]))
