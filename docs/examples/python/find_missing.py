"""A simulation with parameters of its own, measurements of the real thing, and what the simulation lacks."""

import numpy as np

import llmt


def plate(parameters, inputs):
    """Temperature of a heated plate above the room, t seconds after switching on: R P (1 - exp(-t / tau))."""
    return parameters["R"] * inputs["power"] * (1 - np.exp(-inputs["t"] / parameters["tau"]))


# The real plate is cooled by a draught that nobody told the simulation of; R and tau are only roughly known.
rng = np.random.default_rng(1)
inputs = {"t": rng.uniform(0, 600, 120), "power": rng.uniform(10, 50, 120), "draught": rng.uniform(0, 2, 120)}
truth = plate({"R": 0.82, "tau": 140.0}, inputs) - 0.03 * inputs["power"] * np.sqrt(inputs["draught"])
measured = {"T": truth + rng.normal(0, 0.1, 120)}

found = llmt.discover(
    plate,
    {"R": llmt.Parameter(1.0, unit="K/W"), "tau": llmt.Parameter(100.0, unit="s")},
    inputs,
    measured,
    terms={"cooling": ("power sqrt(draught)", lambda x: x["power"] * np.sqrt(x["draught"]))},
)
print(found.summary)
for term in found.to_dict()["effects"]:
    for value in term["parameters"]:
        print(f"{value['name']} of {term['formula']}: {value['value']:.4f} +- {value['std_error']:.4f}")
for value in found.to_dict()["simulation"]:
    print(f"{value['name']}: {value['value']:.4f} +- {value['std_error']:.4f} {value['unit']}")
print(f"gap on {found.gap['heldout_samples']} rows set aside: {found.gap['before']:.3f} -> {found.gap['after']:.3f}")
elsewhere = {"t": [300.0], "power": [40.0], "draught": [1.5]}
print(f"at t = 300, power = 40, draught = 1.5: {found.predict(elsewhere)[0]:.2f}")
