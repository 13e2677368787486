"""Writes heat_pump.csv: the coefficient of performance (heat out by electricity in) of a heat pump that is not there.

Three regimes meet abruptly: below -7 degrees a backup heater helps out, in humid air below 2 degrees the evaporator ices
up and is defrosted, and above 85 % load the compressor is less efficient. Measurement noise has a standard deviation of
0.08. Humidity beyond that and the day of the week do nothing.
"""
import random

random = random.Random(1)
print("outdoor_C,flow_C,load_percent,humidity_percent,weekday,cop")
for row in range(600):
    outdoor = round(random.uniform(-15.0, 20.0), 1)
    flow = round(random.uniform(30.0, 55.0), 1)
    load = round(random.uniform(20.0, 100.0))
    humidity = round(random.uniform(40.0, 100.0))
    weekday = random.choice(["Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"])
    cop = 4.4 + 0.075 * outdoor - 0.055 * (flow - 35.0)
    if outdoor < -7.0:
        cop = 2.9 + 0.03 * (outdoor + 7.0) - 0.02 * (flow - 35.0)
    elif outdoor < 2.0 and humidity > 75.0:
        cop -= 0.6 + 0.012 * (humidity - 75.0)
    if load > 85.0:
        cop -= 0.03 * (load - 85.0)
    print(f"{outdoor},{flow},{load},{humidity},{weekday},{cop + random.gauss(0.0, 0.08):.3f}")
