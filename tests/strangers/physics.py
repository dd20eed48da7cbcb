"""What sensors, their bases and tables do: gyros that warm up or follow forces, few turns, the end of a range, a base that tilts or rocks, a reset;
and units that are others than names say."""
import numpy

from parts import by_hand
from recordings import FACES, anywhere, of, tilted, write
from sensors import DEG, EARTH, G0, GRAVITY, UP, consumer, fibre, industrial, moved, tactical, turn
from tables import NAMES, write_log

SI = [*[f"gyro_{x}_rad_s" for x in "xyz"], *[f"acc_{x}_m_s2" for x in "xyz"]]


def either(rng, low, high, *size):
    """Of either sign."""
    return rng.uniform(low, high, size or None) * rng.choice([-1, 1], size or None)


def on_base(c, axis, angle, rate):
    """Specific force and rate of a sensor at C (body to n) whose base turns by ANGLE about AXIS, which stands in n."""
    cos, sin, turning = numpy.cos(angle)[:, None], numpy.sin(angle)[:, None], numpy.gradient(angle)[:, None] * rate

    def seen(v):
        return (v * cos + numpy.cross(v, axis) * sin + axis * (axis @ v) * (1 - cos)) @ c
    return seen(numpy.array([0, 0, GRAVITY])), seen(EARTH) + turning * (axis @ c)


def level(rng):
    heading = rng.uniform(0, 2 * numpy.pi)
    return numpy.array([numpy.cos(heading), numpy.sin(heading), 0.0])


def upright(rng):
    """A face up, a little out of level, at any heading."""
    return turn([0, 0, 1], rng.uniform(0, 2 * numpy.pi)) @ tilted(UP[rng.choice(FACES)], rng, 1 * DEG)


def smooth(s):
    s = numpy.clip(s, 0, 1)
    return 10 * s**3 - 15 * s**4 + 6 * s**5


def warm_gyros(folder, rng):
    """24 poses of a MEMS that was just switched on, turned on about x, then y, then z: gyro x drifts by a few 0.1 deg/s in one or two minutes."""
    g, a = consumer(rng)
    attitudes = [anywhere(rng)]
    for axis, way in enumerate(rng.choice([-1, 1], 3)):
        for _ in range(8):
            attitudes.append(attitudes[-1] @ turn(numpy.eye(3)[axis] + rng.normal(0, 0.1, 3), way * rng.uniform(50, 120) * DEG))
    t, f, w = moved(100.0, [(c, rng.uniform(5, 8), rng.uniform(2, 4)) for c in attitudes], rng)
    jolted = abs(numpy.linalg.norm(w, axis=1) - numpy.linalg.norm(EARTH)) > 1e-9
    f = f + rng.normal(0, 0.4, f.shape) * jolted[:, None]
    drift = numpy.exp(-t / rng.uniform(60, 150))[:, None] * [either(rng, 0.2, 0.5) * DEG, 0, 0]
    write_log(folder / "log.csv", t, g.read(w, 100.0, rng, drift), a.read(f, 100.0, rng))
    return {"g": g, "a": a}


def few_turns(folder, rng):
    """A table of two axes, MEMS gyros: five or six turns of each axis by 90 deg between rests of 6 s, angles that are late by about 20 ms."""
    g, a = (industrial, consumer)[rng.integers(2)](rng)
    rate, late = 200.0, rng.uniform(0.015, 0.025)
    t = (numpy.arange(int(rate * 140)) + 1) / rate
    outer, inner, begin = 0 * t, 0 * t, 6.0
    for angle in (outer, inner):
        way = rng.choice([-90, 90])
        for _ in range(rng.integers(5, 7)):
            move = rng.uniform(2.5, 4)
            angle += (way + rng.normal(0, 0.02)) * smooth((t - begin) / move)
            begin += move + 6
    keep = t < begin
    t, outer, inner = t[keep], outer[keep], inner[keep]
    mount = tilted(numpy.eye(3), rng, 0.4 * DEG)
    c, s, p, q = numpy.cos(inner * DEG), numpy.sin(inner * DEG), numpy.cos(outer * DEG), numpy.sin(outer * DEG)
    zero, turning = 0 * t, numpy.gradient(outer) * rate * DEG
    carried = [p * EARTH[0], -q * EARTH[0], turning + EARTH[2]]   # on the outer axis, about which the inner one's x turns
    w = numpy.column_stack([carried[0] + numpy.gradient(inner) * rate * DEG, c * carried[1] + s * carried[2], c * carried[2] - s * carried[1]])
    f = numpy.column_stack([zero, s * GRAVITY, c * GRAVITY])
    shown = [numpy.interp(t - late, t, x) for x in (outer, inner)]
    write_log(folder / "log.csv", t, g.read(w @ mount, rate, rng), a.read(f @ mount, rate, rng), shown, ["outer_axis_deg", "inner_axis_deg"])
    return {"outer": g.matrix @ mount[2], "inner": g.matrix @ mount[0], "late_s": late}


def clipped_rates(folder, rng):
    """A rate table with its rate, steps of 100, 200 and 300 deg/s both ways, gyros that end at 250."""
    g, a = industrial(rng)
    g.limit = 250 * DEG
    rates = numpy.zeros(0)
    for step in (0, 100, -100, 200, -200, 300, -300, 0):
        before = rates[-1] if len(rates) else 0.0
        rates = numpy.concatenate([rates, numpy.linspace(before, step, max(2, int(abs(step - before) / 2))), numpy.full(1200, float(step))])
    t, angle = (numpy.arange(len(rates)) + 1) / 100.0, numpy.cumsum(rates) / 100.0 * DEG
    mount = tilted(numpy.eye(3), rng, 0.4 * DEG)
    c, s, zero = numpy.cos(angle), numpy.sin(angle), 0 * t
    w = numpy.column_stack([c * EARTH[0], -s * EARTH[0], zero + EARTH[2] + rates * DEG])
    f = numpy.column_stack([-(rates * DEG) ** 2 * 0.03, -(rates * DEG) ** 2 * 0.01, zero + GRAVITY])
    write_log(folder / "log.csv", t, g.read(w @ mount, 100.0, rng), a.read(f @ mount, 100.0, rng), [rates], ["table_rate_dps"])
    return {"response": g.matrix @ mount[2]}


def follows_temperature(folder, rng):
    """24 poses by hand while it warms up by 6 to 10 degC, with its temperature: a gyro's bias follows it by 0.005 to 0.02 deg/s/degC."""
    g, a, t, f, w = by_hand(rng, industrial, 24)
    warm = rng.uniform(20, 26) + rng.uniform(6, 10) * (1 - numpy.exp(-t / rng.uniform(60, 150)))
    truth = numpy.zeros(3)
    truth[rng.integers(3)] = either(rng, 0.005, 0.02) * DEG
    rate = g.read(w, 100.0, rng, (warm - warm[0])[:, None] * truth)
    write(folder / "log.csv", ["t_s", *NAMES, "temp_C"], [t, *of(rate, DEG), *of(a.read(f, 100.0, rng), G0), warm + rng.normal(0, 0.02, len(t))],
          ["%.2f"] + ["%.5f"] * 3 + ["%.6f"] * 3 + ["%.2f"])
    return {"coefficients": truth}


def tilting_base(folder, rng):
    """A tactical MEMS stands for half an hour. The base tilts at once by 0.15 to 0.3 deg; in a second file an accelerometer's bias jumps by as much."""
    g, a = tactical(rng)
    g.asd = 0.1 / 60 * DEG
    t = (numpy.arange(1800 * 50) + 1) / 50.0
    c, at, angle = upright(rng), rng.uniform(0.2, 0.8) * t[-1], rng.uniform(0.15, 0.3) * DEG
    f, w = on_base(c, level(rng), angle * smooth((t - at) / rng.uniform(1, 2)), 50.0)
    write_log(folder / "tilt.csv", t, g.read(w, 50.0, rng), a.read(f, 50.0, rng))
    axis = rng.choice([k for k in range(3) if abs(c[2, k]) < 0.5])
    jump = numpy.eye(3)[axis] * rng.choice([-1, 1]) * angle * GRAVITY
    f, w = on_base(c, level(rng), 0 * t, 50.0)
    write_log(folder / "jump.csv", t, g.read(w, 50.0, rng), a.read(f, 50.0, rng, (t > at)[:, None] * jump))
    return {"at_s": at, "angle_deg": angle / DEG, "axis": "xyz"[axis], "jump_g": jump[axis] / G0}


def reset_in_a_gap(folder, rng):
    """A MEMS stands for an hour, 3 s of the log are missing in the middle: behind them a gyro's bias is another by 40 to 80 deg/h; or it is not."""
    g, a = tactical(rng)
    g.asd = 0.2 / 60 * DEG
    t = (numpy.arange(3600 * 25) + 1) / 25.0
    at = rng.uniform(0.4, 0.6) * t[-1]
    keep = (t < at) | (t >= at + 3)
    t, axis, size = t[keep], rng.integers(3), either(rng, 40, 80) / 3600 * DEG
    f, w = on_base(upright(rng), level(rng), 0 * t, 25.0)
    for name, jump in (("reset.csv", size * numpy.eye(3)[axis]), ("gap.csv", numpy.zeros(3))):
        write_log(folder / name, t, g.read(w, 25.0, rng, (t > at)[:, None] * jump), a.read(f, 25.0, rng))
    return {"at_s": at, "axis": "xyz"[axis], "jump": size}


def rocked(folder, rng):
    """Fibre gyros on a base that is rocked for half an hour by 0.5 to 1.5 deg in 6 to 10 s; the same at rest."""
    g, a = fibre(rng)
    t = (numpy.arange(1800 * 50) + 1) / 50.0
    c, hz, size = upright(rng), 1 / rng.uniform(6, 10), rng.uniform(0.5, 1.5) * DEG
    for name, angle in (("rocked.csv", size * numpy.sin(2 * numpy.pi * (hz * t + rng.uniform()))), ("rest.csv", 0 * t)):
        f, w = on_base(c, level(rng), angle, 50.0)
        write_log(folder / name, t, g.read(w, 50.0, rng), a.read(f, 50.0, rng))
    return {"asd": g.asd, "hz": hz}


def wrong_time(folder, rng):
    """Poses by hand: time in ms that is called time_s; deg/s that are called rad/s."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    write(folder / "ms.csv", ["time_s", *SI], [numpy.round(t * 1000), *of(rate), *of(force)], ["%d"] + ["%.7f"] * 3 + ["%.6f"] * 3)
    write(folder / "degrees.csv", ["time_s", *SI], [t, *of(rate, DEG), *of(force)], ["%.2f"] + ["%.5f"] * 3 + ["%.6f"] * 3)
    return {}


def forces_in_g(folder, rng):
    """Twelve poses by hand: accelerometers in g that are called m/s^2."""
    g, a, t, f, w = by_hand(rng, industrial, 12)
    values = [*of(g.read(w, 100.0, rng)), *of(a.read(f, 100.0, rng), G0)]
    write(folder / "log.csv", ["time_s", *SI], [t, *values], ["%.2f"] + ["%.7f"] * 3 + ["%.6f"] * 3)
    return {}


def silent_gyro(folder, rng):
    """Twelve poses by hand; one of the gyros reads 0 throughout."""
    g, a, t, f, w = by_hand(rng, industrial, 12)
    rate, axis = g.read(w, 100.0, rng), rng.integers(3)
    rate[:, axis] = 0.0
    write_log(folder / "log.csv", t, rate, a.read(f, 100.0, rng))
    return {"a": a, "axis": axis}


def g_sensitive(folder, rng):
    """24 poses by hand, no latitude: two of the nine elements by which gyros follow forces are 0.03 to 0.1 deg/s/g."""
    g, a, t, f, w = by_hand(rng, industrial, 24)
    elements = numpy.zeros(9)
    elements[rng.choice(9, 2, False)] = either(rng, 0.03, 0.1, 2) * DEG
    write_log(folder / "log.csv", t, g.read(w, 100.0, rng, f / G0 @ elements.reshape(3, 3).T), a.read(f, 100.0, rng))
    return {"elements": elements.reshape(3, 3)}
