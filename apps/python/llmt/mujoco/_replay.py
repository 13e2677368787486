"""A log run through a model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from llmt._results import axes_of, names
from llmt._signals import signals
from llmt.tables.named import columns_of

from ._models import _compiled


class Replay:
    """How far a model moves away from a log. ``rms``: of each position, in rad or m."""

    def __init__(self, time: np.ndarray, measured: np.ndarray, simulated: np.ndarray, positions: list[str]) -> None:
        self.time = time
        """In s; the rows of all windows."""
        self.measured = measured
        """Rows x positions, low-passed."""
        self.simulated = simulated
        """Rows x positions, from the measured state at the begin of each window."""
        self.rms: dict[str, float] = {
            name: float(np.sqrt(np.mean((simulated[:, k] - measured[:, k]) ** 2))) for k, name in enumerate(positions)
        }
        """Root mean square of simulated - measured."""

    def __repr__(self) -> str:
        return ", ".join(f"{name}: {value:.4g}" for name, value in self.rms.items())

    def plot(self, ax: Any = None) -> Any:
        """Draws simulated - measured of each position. Returns the axes of matplotlib, ``ax`` if it is given."""
        ax = axes_of(ax)
        for k, name in enumerate(self.rms):
            ax.plot(self.time, self.simulated[:, k] - self.measured[:, k], label=name, linewidth=0.8)
        ax.set_xlabel("time [s]")
        ax.set_ylabel("simulated - measured")
        ax.legend()
        return ax


def replay(
    spec: Any,
    log: Any,
    *,
    position: str | Sequence[str],
    torque: str | Sequence[str],
    cutoff: float,
    time: str = "",
    rate: float | None = None,
    group: str = "",
    windows: float = 1.0,
    callback: Callable[[Any, Any], None] | None = None,
    standstill: Any = None,
) -> Replay:
    """Runs a model open loop with the measured torques, in windows of that many seconds, each from the measured state.

    The torques go to ``qfrc_applied`` as they were recorded, interpolated between samples; actuators of the model are
    off. ``callback`` as :func:`apply` returns it. The other arguments are those of :func:`llmt.signals`, which gives
    the states and the positions to compare with; ``standstill`` is accepted and not used: no row is left out.
    """
    import mujoco

    positions, torques = names("position", position), names("torque", torque)
    made = signals(
        log,
        position=positions,
        torque=torques,
        time=time,
        rate=rate,
        group=group,
        cutoff=cutoff,
        standstill=0.0,
        every=1,
    )
    model = _compiled(spec)
    if len(positions) != model.nv or len(torques) != model.nv:
        raise ValueError(
            f"the model has {model.nv} joints, {len(positions)} positions and {len(torques)} torques are named"
        )
    if not windows > 0.0:
        raise ValueError(f"windows is {windows}, must be above 0")
    columns = columns_of(made.table, "table")
    instants = np.array(columns[time or "t"], dtype=float)
    states = [np.array([columns[prefix + name] for name in positions], dtype=float).T for prefix in ("", "d")]
    raw = columns_of(log, "log")
    applied = np.array([np.array(raw[name], dtype=float)[made.rows] for name in torques]).T
    model.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_ACTUATION)
    step = 1.0 / made.to_dict()["rate_hz"]
    substeps = max(1, int(np.ceil(step / model.opt.timestep - 1e-9)))
    model.opt.timestep = step / substeps
    data = mujoco.MjData(model)
    friction = model.dof_frictionloss.copy()
    simulated = np.empty_like(states[0])
    length = max(1, round(windows / step))
    since = 0
    for row in range(len(instants)):
        is_new = row == 0 or since == length or not 0.0 < instants[row] - instants[row - 1] < 1.5 * step
        if is_new:
            mujoco.mj_resetData(model, data)
            model.dof_frictionloss[:] = friction
            data.qpos[:], data.qvel[:] = states[0][row], states[1][row]
            since = 0
        else:
            for k in range(substeps):
                share = (k + 0.5) / substeps
                data.qfrc_applied[:] = (1.0 - share) * applied[row - 1] + share * applied[row]
                if callback is not None:
                    callback(model, data)
                mujoco.mj_step(model, data)
        simulated[row] = data.qpos
        since += 1
    return Replay(instants, states[0], simulated, positions)
