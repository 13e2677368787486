"""What make_wheels.sh asks of an installed wheel: it fits and predicts, and the libraries that it uses are its own."""

import re
import sys
from pathlib import Path

import numpy as np

import llmt

inputs = np.random.default_rng(0).uniform(-1, 1, (500, 2))
outputs = np.where(inputs[:, 0] > 0, 3 * inputs[:, 1], 1.0)
model = llmt.LocalLinearTreeRegressor().fit(inputs, outputs)
assert np.allclose(model.predict([[0.5, 0.5], [-0.5, 0.5]]), [1.5, 1.0], atol=0.01)

loaded = {line.split()[-1] for line in Path("/proc/self/maps").read_text().splitlines() if ".so" in line}
libraries = {path for path in loaded if re.search(r"lib(tbb|fmt|yaml-cpp|muparser|urdf|tinyxml|console_bridge)", path)}
foreign = {path for path in libraries if not path.startswith(sys.prefix)}
assert libraries and not foreign, f"libraries of the system: {sorted(foreign)}; of the wheel: {sorted(libraries)}"
print(f"Python {sys.version.split()[0]}: llmt {llmt.__version__} fits and predicts, with its own {len(libraries)} libraries")
