"""A readable tree: the sample table, six rules, and the picture of the tree."""

import sys
from pathlib import Path

import pandas as pd

from llmt import LocalLinearTreeRegressor

table = pd.read_csv(Path(__file__).parents[2] / "samples" / "heat_pump.csv")
X, y = table.drop(columns="cop"), table["cop"]

model = LocalLinearTreeRegressor(readable=True).fit(X, y)  # the weekday is a column of words
print(model.rules_.to_string(max_colwidth=70))
print(f"RMSE on held-out rows {model.summary_['readable'][0]['cv_rmse']:.4f}")

if len(sys.argv) > 1:
    import matplotlib

    matplotlib.use("Agg")
    model.plot().figure.savefig(sys.argv[1], dpi=120, bbox_inches="tight")
