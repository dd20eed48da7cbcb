"""What papers and laboratories publish instead of logs: tables of means, a row a position, and one accelerometer at the angles of a dividing head."""
import numpy

from recordings import FACES, write
from sensors import DEG, EARTH, G0, GRAVITY, UP, industrial, turn
from tables import write_log


def cube(rng, count):
    """Attitudes well apart: gravity in COUNT directions of a Fibonacci sphere."""
    k = numpy.arange(count) + 0.5
    up = numpy.arccos(1 - 2 * k / count)
    return [turn([0, 0, 1], rng.uniform(0, 6)) @ turn([1, 0, 0], u) @ turn([0, 0, 1], v) for u, v in zip(up, numpy.pi * (1 + 5**0.5) * k)]


def means_of(a, attitudes, sigma, rng, square=(0.0, 0.0, 0.0)):
    f = numpy.array([c.T @ [0, 0, GRAVITY] for c in attitudes])
    return f @ a.matrix.T + a.bias + numpy.array(square) * f**2 / G0 + rng.normal(0, sigma, f.shape)


def positions(folder, rng):
    """A robot's arm in 24 positions and a thermostat: means alone in m/s^2 and deg/s; with a standard deviation; in counts without names; one misread."""
    g, a = industrial(rng)
    at = cube(rng, 24)
    force = means_of(a, at, 30e-6 * G0, rng)
    rate = numpy.array([c.T @ EARTH for c in at]) @ g.matrix.T + g.bias + rng.normal(0, 2e-4 * DEG, (24, 3))
    number = numpy.arange(24) + 1
    write(folder / "means.csv", ["Pos", "ax[m/s^2]", "ay[m/s^2]", "az[m/s^2]", "gx[deg/s]", "gy[deg/s]", "gz[deg/s]"],
          [number, *force.T, *(rate / DEG).T], ["%d"] + ["%.6f"] * 6, ";")
    names = [f"{x}_{what}_g" for what in ("mean", "std") for x in ("ax", "ay", "az")]
    write(folder / "deviations.csv", ["position", *names, "roll_deg", "pitch_deg"],
          [[f"P{n}" for n in number], *(force / G0).T, *numpy.full((3, 24), 0.0011), 0 * number, 15 * number], ["%s"] + ["%.6f"] * 3 + ["%.4f"] * 3 + ["%d"] * 2)
    numpy.savetxt(folder / "counts.txt", numpy.column_stack([number, force / G0 * 16384]), ["%d"] + ["%.1f"] * 3)
    wrong = force.copy()
    wrong[7] += rng.choice([-1, 1], 3) * 0.003 * G0
    write(folder / "misread.csv", ["position", "ax_g", "ay_g", "az_g"], [number, *(wrong / G0).T], ["%d"] + ["%.6f"] * 3)
    bent = means_of(a, at, 10e-6 * G0, rng, (300e-6, -200e-6, 150e-6))
    write(folder / "bent.csv", ["position", "ax_g", "ay_g", "az_g"], [number, *(bent / G0).T], ["%d"] + ["%.7f"] * 3)
    rates = numpy.outer(numpy.linspace(-100, 100, 12) * DEG, [0, 0, 1])
    write(folder / "rates.csv", ["n", "ax_g", "ay_g", "az_g", "gx_dps", "gy_dps", "gz_dps"],
          [number[:12], *(force[:12] / G0).T, *((rates + rate[:12]) / DEG).T], ["%d"] + ["%.6f"] * 6)
    nominal = numpy.array([c.T @ [0, 0, 1.0] for c in at])
    write(folder / "nominal.csv", ["n", "gx", "gy", "gz", "ax", "ay", "az"], [number, *nominal.T, *(force / G0).T], ["%d"] + ["%.4f"] * 3 + ["%.6f"] * 3)
    return {"g": g, "a": a}


def table_log(folder, rng):
    """A rate table that logs its angle in a file of its own: 20 Hz, from 0 to 360 deg, begun earlier, 80 ms late."""
    g, a = industrial(rng)
    rates = numpy.concatenate([numpy.full(1500, float(r)) for r in (0, 20, -20, 50, -50, 100, -100, 150, -150, 0)])
    rates = numpy.convolve(numpy.pad(rates, 100, "edge"), numpy.ones(201) / 201, "valid")
    angle, t = numpy.cumsum(rates) / 100, (numpy.arange(len(rates)) + 1) / 100
    c_bn = numpy.array([turn([0, 0, 1], x) for x in angle * DEG]).transpose(0, 2, 1)
    write_log(folder / "imu.csv", t, g.read(c_bn @ EARTH + (rates * DEG)[:, None] * [0, 0, 1], 100.0, rng), a.read(c_bn @ [0, 0, GRAVITY], 100.0, rng))
    stamps = numpy.arange(-5, t[-1] + 5, 0.05)
    shown = numpy.interp(stamps - 0.08, t, angle)
    write(folder / "table.csv", ["time_s", "table_angle_deg", "table_rate_dps"], [stamps, shown % 360, numpy.gradient(shown) * 20], ["%.3f", "%.4f", "%.3f"])
    return {"response": g.matrix[:, 2], "late_s": 0.08}


def six_faces(folder, rng):
    """Six positions on a plate good to 0.1 deg: means alone, and with the standard deviation of the readings."""
    _, a = industrial(rng)
    at = [UP[face] @ turn(rng.normal(size=3), rng.normal(0, 0.1 * DEG)) for face in FACES]
    force = means_of(a, at, 20e-6 * G0, rng) / G0
    write(folder / "means.csv", ["Face", "Ax (g)", "Ay (g)", "Az (g)"], [FACES, *force.T], ["%s"] + ["%.6f"] * 3)
    write(folder / "deviations.csv", ["Face", "Ax (g)", "Ay (g)", "Az (g)", "Std Ax (g)", "Std Ay (g)", "Std Az (g)"],
          [FACES, *force.T, *numpy.full((3, 6), 4e-4)], ["%s"] + ["%.6f"] * 3 + ["%.5f"] * 3)
    return {"a": a}


def head(folder, rng):
    """A quartz accelerometer on a dividing head in V, mA and g: 12 to 72 angles, five readings of each, a drift, a cubic part; four angles alone."""
    truth = {"bias": rng.normal(0, 3e-3), "scale": 1 + rng.normal(0, 3e-3), "k2": rng.normal(0, 60e-6), "kip": rng.normal(0, 30e-6),
             "misalignment": rng.normal(0, 1e-3), "level_deg": 0.0}

    def read(degrees, unit, noise=4e-6, drift=0.0, k3=0.0, begin=0.0):
        p = (degrees - begin) * DEG + truth["misalignment"]
        s, c = numpy.sin(p), numpy.cos(p)
        y = truth["scale"] * (truth["bias"] + s + truth["k2"] * s**2 + truth["kip"] * s * c + k3 * s**3) + drift * numpy.linspace(0, 1, len(s))
        return unit * (y + rng.normal(0, noise, len(s)))

    def put(name, names, degrees, reading, angle="%.3f"):
        write(folder / name, names, [degrees, reading], [angle, "%.8f"])
    round_trip = numpy.arange(25) * 15.0
    put("volts.csv", ["angle_deg", "output_V"], round_trip, read(round_trip, 2.5))
    repeated = numpy.repeat(numpy.arange(12) * 30.0, 5)
    put("amperes.csv", ["Winkel [deg]", "Ausgang [mA]"], repeated, read(repeated, 1.3))
    fine = numpy.arange(72) * 5.0
    put("g.csv", ["table_angle_deg", "accel_g"], fine, read(fine, GRAVITY / G0, begin=90.0))
    numpy.savetxt(folder / "plain.txt", numpy.column_stack([fine, read(fine, 1.0)]), ["%.3f", "%.8f"])
    put("drift.csv", ["angle_deg", "output_V"], fine, read(fine, 2.5, drift=100e-6))
    put("cubic.csv", ["angle_deg", "output_V"], fine, read(fine, 2.5, k3=80e-6))
    put("four.csv", ["angle_deg", "output_V"], fine[::18], read(fine[::18], 2.5))
    write(folder / "more.csv", ["No", "Angle (deg)", "Mean (V)", "Std (V)", "Temp (C)"],
          [numpy.arange(25) + 1, round_trip, read(round_trip, 2.5), 0 * round_trip + 2e-4, 0 * round_trip + 25], ["%d", "%.1f", "%.8f", "%.6f", "%.2f"])
    put("radians.csv", ["angle", "output_V"], fine * DEG, read(fine, 2.5), "%.6f")
    with open(folder / "minutes.txt", "w", encoding="utf-8") as out:
        out.write("Angle;Output (mA)\n")
        for d, y in zip(round_trip + 0.25, read(round_trip + 0.25, 1.3)):
            out.write(f"{int(d)}°{15:02}'{0:02}\";{y:.8f}\n")
    return truth
