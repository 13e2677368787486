"""What make_wheels.sh asks of an installed wheel: it fits, predicts and calibrates, the libraries that it uses are its own,
and it has their licences."""

import re
import sys
from importlib.metadata import distribution
from pathlib import Path

import numpy as np

import llmt
from llmt import robotics, samples

inputs = np.random.default_rng(0).uniform(-1, 1, (500, 2))
outputs = np.where(inputs[:, 0] > 0, 3 * inputs[:, 1], 1.0)
model = llmt.LocalLinearTreeRegressor().fit(inputs, outputs)
assert np.allclose(model.predict([[0.5, 0.5], [-0.5, 0.5]]), [1.5, 1.0], atol=0.01)

X, y = samples.heat_pump()  # arrays with words: no pandas here
assert llmt.LocalLinearTreeRegressor(cv=0).fit(X, y).score(X, y) > 0.9

for description in ("arm.yaml", "arm.urdf"):
    calibrated = robotics.calibrate(samples.path(description), samples.arm_measured(), folds=0)
    errors = {row["model"]: row["mean"] for row in calibrated.errors}
    assert errors["geometric"] < 0.5 * errors["nominal"], errors

loaded = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines() if ".so" in line}
# libexpat is the system's: auditwheel takes it to be everywhere.
libraries = {path for path in loaded if re.search(r"lib(tbb|fmt|yaml-cpp|muparser|urdf|tinyxml|console_bridge)", path)}
foreign = {path for path in libraries if not path.startswith(sys.prefix)}
assert libraries and not foreign, f"libraries of the system: {sorted(foreign)}; of the wheel: {sorted(libraries)}"
licences = [file for file in distribution("llmt").files or [] if "bundled" in file.parts]
assert len(licences) >= len(libraries), f"{len(libraries)} libraries, licences: {licences}"
print(
    f"Python {sys.version.split()[0]}: llmt {llmt.__version__} fits, predicts and calibrates, with its own "
    f"{len(libraries)} libraries and {len(licences)} licences"
)
