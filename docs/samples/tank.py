"""Writes tank.csv: the level of a tank that is not there, with an inflow through a long pipe and a hole in its floor.

    dh/dt = (inflow(t - 30 s) - 10 sqrt(h)) / 200        level h in m, inflow in l/s, area 0.2 m2

So it rests at h = (inflow / 10)^2. Measurement noise has a standard deviation of 5 mm. `tank.py new` writes
tank_new.csv, a shorter record of another inflow.
"""
import math
import random
import sys

is_new = sys.argv[1:] == ["new"]
random = random.Random(2 if is_new else 1)
inflows = [8.0] * 4
level = 0.8 if is_new else 0.64
print("t_s,inflow_l_s,level_m")
for row in range(200 if is_new else 400):
    if row == 0 or random.random() < 0.12:
        inflow = round(random.uniform(4.0, 14.0), 1)
    print(f"{10 * row},{inflow},{level + random.gauss(0.0, 0.005):.4f}")
    inflows = [inflow, *inflows[:3]]
    for _ in range(100):
        level += 0.1 * (inflows[3] - 10.0 * math.sqrt(max(level, 0.0))) / 200.0
