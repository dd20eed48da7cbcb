"""Recordings as laboratories publish them: each writes a file in its maker's form, and returns the truth about it."""
import numpy

import attitudes
from sensors import DEG, EARTH, G0, GRAVITY, UP, consumer, fibre, industrial, moved, tactical, turn

FACES = ["+z", "-z", "+x", "-x", "+y", "-y"]


def write(path, names, columns, formats, separator=","):
    with open(path, "w", encoding="utf-8") as out:
        out.write(separator.join(names) + "\n")
        for row in zip(*columns):
            out.write(separator.join(f % v for f, v in zip(formats, row)) + "\n")


def of(values, unit=1.0):
    return [values[:, k] / unit for k in range(3)]


def tilted(c, rng, sigma):
    return c @ turn(rng.normal(size=3), rng.normal(0, sigma))


def anywhere(rng):
    return turn(rng.normal(size=3), rng.uniform(0.3, numpy.pi))


def tumble(path, rng):
    """Six faces by hand, OpenLog with an ICM-20948: date, time of day, mg, deg/s, no units in the names."""
    g, a = consumer(rng)
    stops = [(tilted(UP[f], rng, 4 * DEG), rng.uniform(6, 25), rng.uniform(1.5, 4)) for f in FACES]
    t, f, w = moved(100.0, stops, rng, tremor=0.4)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    clock = [f"14:{21 + int(s) // 60:02}:{s % 60:05.2f}" for s in t]
    names = "rtcDate,rtcTime,aX,aY,aZ,gX,gY,gZ,mX,mY,mZ,imu_degC,output_Hz".split(",")
    columns = [["06/03/2021"] * len(t), clock, *of(force, G0 / 1000), *of(rate, DEG), *of(rng.normal(30, 0.3, f.shape)), 31 + 0 * t, 99.9 + 0 * t]
    write(path, names, columns, ["%s", "%s"] + ["%.2f"] * 11)
    return g, a, {}


def positions24(path, rng):
    """24 positions of a cube in a fixture good to 0.1 deg, STIM300's text; nothing follows its temperature."""
    g, a = tactical(rng)
    stops = []
    for face in FACES:
        axis = {"x": [1, 0, 0], "y": [0, 1, 0], "z": [0, 0, 1]}[face[1]]
        stops += [(tilted(UP[face] @ turn(axis, q * numpy.pi / 2), rng, 0.1 * DEG), 20.0, 3.0) for q in range(4)]
    t, f, w = moved(125.0, stops, rng, tremor=0.05)
    names = ["Time [s]", "X-Gyro [deg/s]", "Y-Gyro [deg/s]", "Z-Gyro [deg/s]", "X-Acc [g]", "Y-Acc [g]", "Z-Acc [g]", "Temp [°C]", "Counter"]
    warm = 28 + 4 * (1 - numpy.exp(-t / 500)) + rng.normal(0, 0.02, len(t))
    write(path, names, [t, *of(g.read(w, 125.0, rng), DEG), *of(a.read(f, 125.0, rng), G0), warm, numpy.arange(len(t)) * 16 % 256],
          ["%.6f"] + ["%.7f"] * 3 + ["%.8f"] * 3 + ["%.3f", "%d"], ";")
    return g, a, {}


def increments(path, rng):
    """Seven faces, fibre gyros: increments in rad and m/s. The Earth makes 15 deg/h in gyros that are good to 0.1."""
    g, a = fibre(rng)
    stops = [(tilted(UP[f], rng, 0.5 * DEG), 60.0, 6.0) for f in ("+z", "+x", "-z", "-x", "+y", "-y", "+z")]
    t, f, w = moved(100.0, stops, rng, tremor=0.01)
    write(path, ["time(s)", "dthx(rad)", "dthy(rad)", "dthz(rad)", "dvx(m/s)", "dvy(m/s)", "dvz(m/s)"],
          [t, *of(g.read(w, 100.0, rng) / 100.0), *of(a.read(f, 100.0, rng) / 100.0)], ["%.4f"] + ["%.9e"] * 6, " ")
    return g, a, {}


def faces_of_nowhere(path, rng):
    """Nine faces by hand, fibre gyros, a log that says no place: the Earth's rate goes with the pose as a g-sensitivity would."""
    g, a = fibre(rng)
    faces = ("+z", "+x", "-z", "-x", "+y", "-y", "+z", "+y", "-x")
    t, f, w = moved(100.0, [(tilted(UP[face], rng, 0.5 * DEG), 60.0, 6.0) for face in faces], rng, tremor=0.01)
    write(path, ["t_s", "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g"],
          [t, *of(g.read(w, 100.0, rng), DEG), *of(a.read(f, 100.0, rng), G0)], ["%.3f"] + ["%.8f"] * 3 + ["%.7f"] * 3)
    return g, a, {}


def headings(path, rng):
    """Four headings a quarter of a turn apart on a level plate, fibre gyros: 10 deg/h of the Earth in gyros that are good to 0.1."""
    g, a = fibre(rng)
    stops = [(turn([0, 0, 1], 0.4 + q * numpy.pi / 2), 90.0, 6.0) for q in range(4)]
    t, f, w = moved(100.0, stops, rng)
    write(path, ["t_s", "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g"],
          [t, *of(g.read(w, 100.0, rng), DEG), *of(a.read(f, 100.0, rng), G0)], ["%.3f"] + ["%.8f"] * 3 + ["%.7f"] * 3)
    return g, a, {}


def staircase(path, rng, columns=("rate", "angle")):
    """A rate table from 10 to 400 deg/s both ways, its rate, its angle from 0 to 360 deg; the sensor's axis 0.3 deg off."""
    g, a = industrial(rng)
    rates = numpy.zeros(0)
    for step in (0, 10, -10, 25, -25, 50, -50, 100, -100, 200, -200, 300, -300, 400, -400, 0):
        before = rates[-1] if len(rates) else 0.0
        rates = numpy.concatenate([rates, numpy.linspace(before, step, max(2, int(abs(step - before) / 2))), numpy.full(1000, float(step))])
    angle, t = numpy.cumsum(rates) / 100.0, (numpy.arange(len(rates)) + 1) / 100.0
    tilt = turn([1, 0, 0], 0.3 * DEG)
    c, s, zero = numpy.cos(angle * DEG), numpy.sin(angle * DEG), 0 * t
    w = numpy.column_stack([c * EARTH[0], -s * EARTH[0], zero + EARTH[2] + rates * DEG])
    f = numpy.column_stack([-(rates * DEG) ** 2 * 0.03, -(rates * DEG) ** 2 * 0.01, zero + GRAVITY])
    held = {"rate": ("table_rate_dps", rates, "%.3f"), "angle": ("table_pos_deg", numpy.mod(angle, 360), "%.4f")}
    table = [held[name] for name in columns]
    write(path, ["time_s", *[x[0] for x in table], "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g"],
          [t, *[x[1] for x in table], *of(g.read(w @ tilt.T, 100.0, rng), DEG), *of(a.read(f @ tilt.T, 100.0, rng), G0)],
          ["%.3f", *[x[2] for x in table]] + ["%.5f"] * 3 + ["%.6f"] * 3)
    return g, a, {"response": (g.matrix @ tilt)[:, 2]}


def chamber(path, rng):
    """Six faces at each of five temperatures of a chamber."""
    g, a = industrial(rng)
    temperatures = [-20, 0, 25, 45, 60]
    stops = [(tilted(UP[f], rng, 0.3 * DEG), 25.0, 3.0) for _ in temperatures for f in FACES]
    t, f, w = moved(50.0, stops, rng, tremor=0.05)
    warm = numpy.repeat(temperatures, 6)[numpy.minimum((t - 1e-9) // 28, 29).astype(int)] + rng.normal(0, 0.01, len(t))
    truth = {"gyro_temperature": numpy.array([0.004, -0.007, 0.002]) * DEG, "accel_temperature": numpy.array([200, -100, 50]) * 1e-6 * G0,
             "accel_scale_temperature": numpy.array([60, -40, 20]) * 1e-6}
    dt = (warm - 25)[:, None]
    rate = g.read(w, 50.0, rng, dt * truth["gyro_temperature"])
    force = a.read(f * (1 + dt * truth["accel_scale_temperature"]), 50.0, rng, dt * truth["accel_temperature"])
    write(path, ["time", "temp", "gyro_x", "gyro_y", "gyro_z", "acc_x", "acc_y", "acc_z"], [t, warm, *of(rate, DEG), *of(force, G0)],
          ["%.3f", "%.2f"] + ["%.5f"] * 3 + ["%.6f"] * 3, ";")
    return g, a, truth


def phone(path, rng):
    """A phone's accelerometers alone: z first, time in ns since 1970 with jitter."""
    g, a = consumer(rng)
    t, f, _ = moved(100.0, [(anywhere(rng), rng.uniform(5, 12), rng.uniform(1, 2)) for _ in range(18)], rng, tremor=0.8)
    force = a.read(f, 100.0, rng)
    stamps = 1709164800123456789 + numpy.round(t * 1e9 + rng.normal(0, 3e5, len(t))).astype(numpy.int64)
    write(path, ["time", "seconds_elapsed", "z", "y", "x"], [stamps, t, force[:, 2], force[:, 1], force[:, 0]], ["%d", "%.9f"] + ["%.7f"] * 3)
    return g, a, {}


def turned_on(path, rng):
    """An MPU-6050 switched on cold, upside down, registers, time in ms: what it drifts by while it warms up."""
    g, a = consumer(rng)
    t = (numpy.arange(60000) + 1) / 50.0
    truth = {"gyro": numpy.array([0.24, -0.36, 0.14]) * DEG, "tau_s": 240.0}
    cold = numpy.exp(-t / truth["tau_s"])[:, None]
    rate = g.read(numpy.tile(EARTH * [1, 1, -1], (len(t), 1)), 50.0, rng, cold * truth["gyro"])
    force = a.read(numpy.tile([0, 0, -GRAVITY], (len(t), 1)), 50.0, rng)
    write(path, ["millis", "ax", "ay", "az", "temp", "gx", "gy", "gz"],
          [numpy.round(t * 1000), *of(numpy.round(force * 16384 / G0)), numpy.round(-600 * cold[:, 0] - 1500), *of(numpy.round(rate * 131 / DEG))],
          ["%d"] * 8)
    return g, a, truth


def optical(path, rng):
    """A MEMS of a phone's kind at 200 Hz in a hand, marked; beside it a tracker's file: 120 Hz, y up, 3 ms late, its clock 20 ppm fast, markers lost."""
    g, a = consumer(rng)
    hand = attitudes.Hand(rng, 16, 3.0, 3.0)
    t = (numpy.arange(int(hand.duration * 200)) + 1) / 200.0
    rate, force = g.read(hand.rate(t), 200.0, rng), a.read(hand.force(t, rng, 0.5), 200.0, rng)
    write(path, ["Time(s)", "accX(g)", "accY(g)", "accZ(g)", "gyrX(dps)", "gyrY(dps)", "gyrZ(dps)"], [t, *of(force, G0), *of(rate, DEG)],
          ["%.4f"] + ["%.6f"] * 3 + ["%.4f"] * 3)
    truth = {"delay_s": 0.003, "drift_ppm": 20.0, "noise_rad": 3e-4}
    middle = (t[0] + t[-1]) / 2
    stamps = numpy.arange(0.7 / 120, hand.duration, 1 / 120)
    c_ym = turn([1, 0, 0], -numpy.pi / 2) @ hand.c_rb(stamps - truth["delay_s"] - 20e-6 * (stamps - middle)) @ turn(rng.normal(size=3), rng.uniform(0.5, 3))
    q = attitudes.times(attitudes.small(rng.normal(0, truth["noise_rad"], (len(stamps), 3))), attitudes.quaternions(c_ym))
    q *= rng.choice([-1, 1], (len(q), 1))   # the same attitudes
    text = [["%.7f" % v for v in row] for row in q]
    for k in rng.integers(200, len(text) - 200, 5):
        text[k:k + 40] = [["", "", "", ""]] * 40
    write(path.with_name("mocap.csv"), ["Time (Seconds)", "Rotation X", "Rotation Y", "Rotation Z", "Rotation W"],
          [stamps, *[[row[k] for row in text] for k in (1, 2, 3, 0)]], ["%.6f"] + ["%s"] * 4)
    return g, a, truth


def robot_arm(path, rng):
    """An ADIS on a robot's flange at 100 Hz; its controller's attitude every 20 ms in the same rows, x y z w, room to flange, 12 ms late."""
    g, a = industrial(rng)
    hand = attitudes.Hand(rng, 14, 3.0, 3.0)
    t = (numpy.arange(int(hand.duration * 100)) + 1) / 100.0
    rate, force = g.read(hand.rate(t), 100.0, rng), a.read(hand.force(t, rng, 0.05), 100.0, rng)
    begin, delay = rng.uniform(0, 0.02), 0.012
    taken = numpy.maximum(0.0, begin + 0.02 * numpy.floor((t - delay - begin) / 0.02))
    first, of_row = numpy.unique(taken, return_inverse=True)
    q = attitudes.quaternions(hand.c_rb(first) @ turn(rng.normal(size=3), rng.uniform(0.5, 3)))
    q = attitudes.times(q, attitudes.small(rng.normal(0, 5e-5, (len(q), 3)))) * [1, -1, -1, -1]
    wait = numpy.mean(t[numpy.searchsorted(of_row, numpy.arange(len(first)))][5:] - first[5:])   # to the row that shows it
    write(path, ["time_s", "gyr_x_dps", "gyr_y_dps", "gyr_z_dps", "acc_x_g", "acc_y_g", "acc_z_g", "robot_qx", "robot_qy", "robot_qz", "robot_qw"],
          [t, *of(rate, DEG), *of(force, G0), *q[of_row][:, [1, 2, 3, 0]].T], ["%.3f"] + ["%.5f"] * 3 + ["%.6f"] * 3 + ["%.8f"] * 4)
    return g, a, {"delay_s": wait}


def fused(path, rng):
    """A MEMS with a filter of its own: q0 to q3 stand beside the sensors that they were computed from."""
    g, a = consumer(rng)
    hand = attitudes.Hand(rng, 12, 4.0, 2.0)
    t = (numpy.arange(int(hand.duration * 100)) + 1) / 100.0
    rate, force = g.read(hand.rate(t), 100.0, rng), a.read(hand.force(t, rng, 0.3), 100.0, rng)
    q = attitudes.filtered(t, rate - g.bias, force, attitudes.quaternions(hand.c_rb(t[:1]))[0], 0.2)
    write(path, ["time_s", "gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g", "q0", "q1", "q2", "q3"],
          [t, *of(rate, DEG), *of(force, G0), *q.T], ["%.3f"] + ["%.5f"] * 3 + ["%.6f"] * 3 + ["%.6f"] * 4)
    return g, a, {}
