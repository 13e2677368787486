"""MuJoCo models beside logs: the torques that a model needs for a measured motion, its parameters, what was found put
into it, and another log replayed.

Joints are hinges and slides; their order is that of the model. A column ``q`` of positions goes with ``dq`` and ``ddq``,
its velocity and acceleration, as :func:`llmt.signals` names them.
"""

from ._apply import apply
from ._models import inverse_dynamics, parameters
from ._replay import Replay, replay

__all__ = ["Replay", "apply", "inverse_dynamics", "parameters", "replay"]
