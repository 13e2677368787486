"""Other packages on the public benchmarks of benchmarks.py, in free run: SysIdentPy and jax-sysid.

    pip install sysidentpy jax-sysid
    python bench/dynamics/rivals.py --data ../shared/data
    python bench/dynamics/rivals.py --data ../shared/data --only tanks

Both choose as llmt does, by free runs over a stretch of the learning record that is held out, its last fifth, and are
then fitted to all of it. SysIdentPy: FROLS with polynomials of degree 1 to 3 of 2, 3, 5 or 10 lags, each with the number
of terms that the AIC asks for. jax-sysid: a recurrent net of 2 or 3 states and of 4 to 16 neurons in either layer, by
Adam and L-BFGS on the simulated record; the state at the start of a test is estimated on the window.
"""

import argparse
import math
import time
import warnings
from pathlib import Path

import benchmarks
import numpy as np

warnings.filterwarnings("ignore")
LONGEST = 10000  # rows that a fit takes, the last ones: of all of Silverbox SysIdentPy would need tens of GiB


def error_of(simulated, measured):
    """The root mean square error, infinite where the run has left all bounds."""
    difference = np.asarray(simulated) - measured
    return math.sqrt(np.mean(difference**2)) if np.all(np.isfinite(difference)) else math.inf


class Polynomial:
    """A NARX polynomial of SysIdentPy."""

    name = "SysIdentPy"
    settings = [(degree, lags) for degree in (1, 2, 3) for lags in (2, 3, 5, 10) if degree < 3 or lags < 5]

    def __init__(self, setting, u, y):
        from sysidentpy.basis_function import Polynomial as Basis
        from sysidentpy.model_structure_selection import FROLS
        from sysidentpy.parameter_estimation import LeastSquares

        degree, lags = setting
        self.lags = lags
        self.model = FROLS(ylag=lags, xlag=lags, n_info_values=40, estimator=LeastSquares(),
                           basis_function=Basis(degree=degree))
        self.model.fit(X=u[-LONGEST:, None], y=y[-LONGEST:, None])

    def run(self, u, y, window):
        """Simulated values behind the window, from the measured ones at its end."""
        begin = max(window - self.lags, 0)
        simulated = self.model.predict(X=u[begin:, None], y=y[begin:begin + self.lags, None])[:, 0]
        return simulated[window - begin:]


class Network:
    """A recurrent net of jax-sysid, on standardised signals."""

    name = "jax-sysid"
    settings = [(states, neurons) for states in (2, 3) for neurons in (4, 8, 16)]

    def __init__(self, setting, u, y):
        import flax.linen as nn
        import jax
        from jax_sysid.models import RNN

        jax.config.update("jax_enable_x64", True)
        states, neurons = setting

        def layers(outputs):
            class Net(nn.Module):
                @nn.compact
                def __call__(self, x):
                    return nn.Dense(outputs)(nn.swish(nn.Dense(neurons)(x))) + nn.Dense(outputs)(x)

            return Net

        u, y = u[-LONGEST:], y[-LONGEST:]
        self.scales = (u.mean(), u.std(), y.mean(), y.std())
        self.model = RNN(states, 1, 1, FX=layers(states), FY=layers(1), x_scaling=0.1, seed=0)
        self.model.loss(rho_x0=1e-4, rho_th=1e-4, train_x0=True)
        self.model.optimization(adam_epochs=500, lbfgs_epochs=1000, iprint=-1)
        self.model.fit(self.scaled_y(y), self.scaled_u(u))

    def scaled_u(self, u):
        return ((u - self.scales[0]) / self.scales[1])[:, None]

    def scaled_y(self, y):
        return ((y - self.scales[2]) / self.scales[3])[:, None]

    def run(self, u, y, window):
        """Simulated values behind the window, on which the first state is estimated."""
        state = self.model.learn_x0(self.scaled_u(u[:window]), self.scaled_y(y[:window]), verbosity=False)
        simulated, _ = self.model.predict(state, self.scaled_u(u))
        return self.scales[2] + self.scales[3] * np.asarray(simulated)[window:, 0]


def chosen(rival, u, y, window):
    """The setting with the least error in free run over the last fifth of the record, and that error."""
    learned = int(0.8 * len(u))
    errors = {}
    for setting in rival.settings:
        try:
            model = rival(setting, u[:learned], y[:learned])
            errors[setting] = error_of(model.run(u[learned:], y[learned:], window), y[learned + window:])
        except (ValueError, np.linalg.LinAlgError, FloatingPointError):  # terms that the rows do not determine
            errors[setting] = math.inf
    best = min(errors, key=errors.get)
    return best, errors[best]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--data", type=Path, required=True)
    parser.add_argument("--only", default="", help="tasks whose name begins so")
    parser.add_argument("--rivals", default="SysIdentPy,jax-sysid")
    arguments = parser.parse_args()
    rivals = [rival for rival in (Polynomial, Network) if rival.name in arguments.rivals.split(",")]
    print(f"{'rival':11} {'record':38} {'test':17} {'RMSE':>9} {'held out':>9} {'CPU s':>7}  chosen")
    learned = {}
    for task in benchmarks.tasks(arguments.data):
        if not task.name.startswith(arguments.only):
            continue
        u, y = (np.array(column) for column in task.train)
        for rival in rivals:
            key = (rival.name, task.name.split(", window")[0])
            if key not in learned:
                before = time.process_time()
                setting, held_out = chosen(rival, u, y, task.window)
                learned[key] = setting, held_out, rival(setting, u, y), time.process_time() - before
            setting, held_out, model, seconds = learned[key]
            for test, record in task.tests.items():
                inputs, measured = (np.array(column) for column in record)
                error = error_of(model.run(inputs, measured, task.window), measured[task.window:])
                label = f"{task.name} [{task.unit}]" if task.unit else task.name
                print(f"{rival.name:11} {label:38} {test:17} {task.factor * error:9.4g} {task.factor * held_out:9.4g} "
                      f"{seconds:7.1f}  {setting}", flush=True)


if __name__ == "__main__":
    main()
