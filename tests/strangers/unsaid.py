"""What names say otherwise or not at all, and what nobody may take for granted: degrees of a temperature, ticks, units, directions, the place, a square."""
import numpy

from parts import by_hand
from recordings import anywhere, of, tilted, write
from sensors import DEG, EARTH, G0, GRAVITY, UP, fibre, industrial, moved, turn
from tables import NAMES, write_log


def temperatures(folder, rng):
    """Gyros that follow the temperature; its column in degF, K, degC, and as a register's counts of 0.125 degC (BMI088)."""
    g, a, t, f, w = by_hand(rng, industrial, 24)
    warm = 25 + 12 * t / t[-1] + 3 * numpy.sin(t / 30)
    truth = numpy.array([0.01, -0.02, 0.015]) * DEG
    rate, force = g.read(w, 100.0, rng, (warm - 25)[:, None] * truth), a.read(f, 100.0, rng)
    for name, title, values, form in (("f.csv", "Temperature (°F)", warm * 1.8 + 32, "%.3f"), ("k.csv", "temp_K", warm + 273.15, "%.3f"),
                                      ("c.csv", "temp", warm, "%.3f")):
        write(folder / name, ["t_s", *NAMES, title], [t, *of(rate, DEG), *of(force, G0), values], ["%.2f"] + ["%.5f"] * 3 + ["%.6f"] * 3 + [form])
    counts = [numpy.round((warm - 23) / 0.125)]
    write(folder / "counts.csv", ["time_ms", "gx", "gy", "gz", "ax", "ay", "az", "temp"],
          [t * 1000, *of(numpy.round(rate / DEG / 0.005)), *of(numpy.round(force / G0 * 4000)), *counts], ["%d"] * 8)
    return {"coefficients": truth}


def units(folder, rng):
    """Time in minutes and in ticks; accelerometers in mGal, mm/s^2 and in/s^2; an ordinal for the sign of a degree."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    for name, time, factor, gyro, accelerometer, size in (("minutes.csv", "Time [min]", 1 / 60, "º/s", "m·s⁻²", 1.0), ("ticks.csv", "Time [ticks]", 32768, "°/s", "g", G0),
                                                          ("mgal.csv", "Time (s)", 1, "deg/s", "mGal", 1e-5), ("mm.csv", "Time (s)", 1, "degrees/s", "mm/s²", 1e-3),
                                                          ("inches.csv", "Time (s)", 1, "deg/s", "in/s²", 0.0254)):
        write(folder / name, [time, *[f"Gyro {x} [{gyro}]" for x in "XYZ"], *[f"Acc {x} [{accelerometer}]" for x in "XYZ"]],
              [t * factor, *of(rate, DEG), *of(force, size)], ["%.9f"] + ["%.6f"] * 3 + ["%.8g"] * 3)
    return {"g": g, "a": a}


def intervals(folder, rng):
    """No time but that from row to row: in s with jitter, in whole ms, in us behind the values; 40 rows lost in the fifth pose."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    lost = numpy.searchsorted(t, t[-1] * 0.35)
    keep = numpy.r_[0:lost, lost + 40:len(t)]
    t, values = t[keep], [*of(rate[keep], DEG), *of(force[keep], G0)]
    stamps = t + rng.normal(0, 2e-5, len(t))
    forms = ["%.5f"] * 3 + ["%.6f"] * 3
    write(folder / "s.csv", ["dt", *NAMES], [numpy.diff(stamps, prepend=stamps[0]), *values], ["%.7f", *forms])
    write(folder / "ms.csv", ["Delta time [ms]", *NAMES], [numpy.round(numpy.diff(t, prepend=t[0] - 0.01) * 1e3), *values], ["%d", *forms])
    write(folder / "us.csv", [*NAMES, "dt_us"], [*values, numpy.round(numpy.diff(stamps, prepend=stamps[0] - 0.01) * 1e6)], [*forms, "%d"])
    return {"g": g, "a": a}


def directions(folder, rng):
    """Names of vehicles: forward, right, down; right, forward, up; long, lat, vert with rates of roll, pitch, yaw; p, q, r; VBOX, yaw first."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng) / DEG, a.read(f, 100.0, rng) / G0
    turned = {"frd": ([0, 1, 2], [1, -1, -1]), "rfu": ([1, 0, 2], [-1, 1, 1])}   # of forward, left, up

    def put(name, gyros, accelerometers, order=((0, 1, 2), (1, 1, 1)), columns=((0, 1, 2), (0, 1, 2))):
        r, s = rate[:, order[0]] * order[1], force[:, order[0]] * order[1]
        write(folder / name, ["time", *gyros, *accelerometers], [t, *r[:, columns[0]].T, *s[:, columns[1]].T], ["%.3f"] + ["%.6f"] * 6)
    words = {"F": "Forward", "R": "Right", "D": "Down", "U": "Up"}
    for order in ("frd", "rfu"):
        put(f"{order}.csv", [f"Gyro {words[x]} (deg/s)" for x in order.upper()], [f"Acc {words[x]} (g)" for x in order.upper()], turned[order])
    put("mixed.csv", ["gyro_up_dps", "gyro_right_dps", "gyro_fwd_dps"], ["acc_up_g", "acc_right_g", "acc_fwd_g"], turned["rfu"], ((2, 0, 1), (2, 0, 1)))
    put("vehicle.csv", ["RollRate_dps", "PitchRate_dps", "YawRate_dps"], ["LongAccel_g", "LatAccel_g", "VertAccel_g"])
    put("pqr.csv", ["p [deg/s]", "q [deg/s]", "r [deg/s]"], ["ax [g]", "ay [g]", "az [g]"])
    put("vbox.csv", ["YawRate (deg/s)", "PitchRate (deg/s)", "RollRate (deg/s)"], ["XAccel (g)", "YAccel (g)", "ZAccel (g)"], columns=((2, 1, 0), (0, 1, 2)))
    return {"g": g, "a": a, "turned": {"frd.csv": turned["frd"], "rfu.csv": turned["rfu"], "mixed.csv": turned["rfu"]}}


def places(folder, rng):
    """Fibre gyros at nine faces; the operator tells the place, another, or no height."""
    g, a = fibre(rng)
    faces = ("+z", "+x", "-z", "-x", "+y", "-y", "+z", "+y", "-x")
    t, f, w = moved(100.0, [(tilted(UP[face], rng, 0.5 * DEG), 60.0, 6.0) for face in faces], rng, tremor=0.01)
    write(folder / "log.csv", ["t_s", *NAMES], [t, *of(g.read(w, 100.0, rng), DEG), *of(a.read(f, 100.0, rng), G0)], ["%.3f"] + ["%.8f"] * 3 + ["%.7f"] * 3)
    return {"g": g, "a": a}


def aslant(folder, rng):
    """Gyros whose board stands at 45 deg to the accelerometers'; a time that is ten times too fast, so that few turns are not rounds."""
    g, a, t, f, w = by_hand(rng, industrial, 18)
    write_log(folder / "fast.csv", 10 * t, g.read(w, 100.0, rng), a.read(f, 100.0, rng))
    g.matrix = g.matrix @ turn([0, 0, 1], numpy.pi / 4)
    write_log(folder / "aslant.csv", t, g.read(w, 100.0, rng), a.read(f, 100.0, rng))
    return {}


def back_and_forth(folder, rng):
    """A table that turns fibre gyros back and forth by 6 deg/s without a stop, its angle beside them."""
    g, a = fibre(rng)
    t = (numpy.arange(60000) + 1) / 50
    phase = t % 120 / 120
    angle = numpy.where(phase < 0.5, 720 * phase - 180, 540 - 720 * phase) * DEG
    kernel = numpy.hanning(52)[1:-1]
    angle = numpy.convolve(numpy.pad(angle, 25, "edge"), kernel / kernel.sum(), "same")[25:-25]
    c_bn = numpy.array([turn([0, 0, 1], x) for x in angle]).transpose(0, 2, 1)
    w = c_bn @ EARTH + numpy.gradient(angle, t)[:, None] * [0, 0, 1]
    write(folder / "log.csv", ["t_s", *NAMES, "angle_deg"], [t, *of(g.read(w, 50.0, rng), DEG), *of(a.read(c_bn @ [0, 0, GRAVITY], 50.0, rng), G0), angle / DEG],
          ["%.2f"] + ["%.7f"] * 6 + ["%.4f"])
    return {"response": g.matrix[:, 2]}


def ramp(folder, rng):
    """Poses by hand while the temperature does nothing but rise with time; both triads follow it."""
    g, a, t, f, w = by_hand(rng, industrial, 24)
    warm = (20 + 30 * t / t[-1])[:, None]
    rate = g.read(w, 100.0, rng, (warm - 35) * numpy.array([0.003, -0.004, 0.002]) * DEG)
    force = a.read(f, 100.0, rng, (warm - 35) * numpy.array([200, -150, 100]) * 1e-6 * G0)
    write(folder / "log.csv", ["t_s", *NAMES, "temp_C"], [t, *of(rate, DEG), *of(force, G0), warm[:, 0]], ["%.2f"] + ["%.5f"] * 3 + ["%.6f"] * 3 + ["%.3f"])
    return {}


def fall(folder, rng):
    """Poses by hand; while it is turned it knocks against the table, and each accelerometer's bias is another by 2 to 4 mg from then on."""
    g, a = industrial(rng)
    stops = [(anywhere(rng), rng.uniform(6, 11), rng.uniform(1, 2)) for _ in range(24)]
    time = sum(rest + move for _, rest, move in stops[:rng.integers(7, 17)]) - 0.5
    t, f, w = moved(100.0, stops, rng, 0.4)
    jump = rng.uniform(2e-3, 4e-3, 3) * rng.choice([-1, 1], 3) * G0
    write_log(folder / "log.csv", t, g.read(w, 100.0, rng), a.read(f, 100.0, rng, (t > time)[:, None] * jump))
    return {"time": time, "bias": a.bias, "jump": jump}


def squares(folder, rng):
    """MEMS accelerometers with a square of 0.3 to 1 mg/g^2: one axis, three, in 20 and 30 poses by hand."""
    files = {}
    for k, (square, count) in enumerate(((s, n) for s in ((3e-4, 0, 0), (3e-4, -2e-4, 1.5e-4), (1e-3, 0, 0), (1e-3, 1e-3, -1e-3)) for n in (20, 30))):
        g, a, t, f, w = by_hand(rng, industrial, count)
        write_log(folder / f"{k}.csv", t, g.read(w, 100.0, rng), a.read(f, 100.0, rng) + numpy.array(square) * f**2 / G0)
        files[f"{k}.csv"] = a
    return {"files": files, "gravity": GRAVITY}
