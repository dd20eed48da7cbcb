"""Tables, centrifuges and drives: what turns or moves without six quiet faces. Each writes a log and returns the truth about it."""
import numpy

from recordings import of, write
from sensors import DEG, EARTH, G0, GRAVITY, UP, consumer, industrial, moved, turn

NAMES = ["gx_dps", "gy_dps", "gz_dps", "ax_g", "ay_g", "az_g"]


def write_log(path, t, rate, force, before=(), names=()):
    """Time, columns BEFORE, gyros in deg/s, accelerometers in g."""
    write(path, ["t_s", *names, *NAMES], [t, *before, *of(rate, DEG), *of(force, G0)], ["%.3f", *["%.4f"] * len(names)] + ["%.5f"] * 3 + ["%.6f"] * 3)


def sweeps(path, rng):
    """Three sweeps of a rate table in one log, the sensor mounted anew by hand for each of its axes; angle from 0 to 360 deg."""
    g, a = industrial(rng)
    force, rate, angle = [], [], []
    for axis in range(3):
        rates = numpy.zeros(0)
        for step in (0, 50, -50, 100, -100, 200, -200, 0):
            before = rates[-1] if len(rates) else 0.0
            rates = numpy.concatenate([rates, numpy.linspace(before, step, max(2, int(abs(step - before) / 2))), numpy.full(700, float(step))])
        mount = UP[["+x", "+y", "+z"][axis]]
        at = numpy.cumsum(rates) / 100 * DEG
        c_bn = numpy.array([turn([0, 0, 1], x) @ mount for x in at]).transpose(0, 2, 1)
        rate.append(c_bn @ EARTH + (rates * DEG)[:, None] * mount[2])
        force.append(c_bn @ [0, 0, GRAVITY])
        angle.append(numpy.mod(at / DEG, 360))
        if axis < 2:
            _, f, w = moved(100.0, [(c_bn[-1].T, 2, 8), (UP[["+x", "+y", "+z"][axis + 1]], 8, 0)], rng, 0.3)
            force.append(f)
            rate.append(w)
            angle.append(numpy.full(len(f), angle[-1][-1]))
    force, rate = numpy.concatenate(force), numpy.concatenate(rate)
    t = (numpy.arange(len(force)) + 1) / 100
    write_log(path, t, g.read(rate, 100, rng), a.read(force, 100, rng), [numpy.concatenate(angle)], ["table_angle_deg"])
    return {"response": g.matrix}


def oscillation(path, rng):
    """A table that oscillates by 20 deg at half a hertz for two minutes; its encoder in millidegrees is 12 ms late."""
    g, a = industrial(rng)
    rate_hz, late = 200.0, 0.012
    t = (numpy.arange(int(150 * rate_hz)) + 1) / rate_hz
    angle = 20 * DEG * numpy.clip((t - 15) / 4, 0, 1) * numpy.clip((140 - t) / 4, 0, 1) * numpy.sin(numpy.pi * t)
    turning = numpy.gradient(angle, t)
    tilt, c, s = turn([1, 0, 0], 0.4 * DEG), numpy.cos(angle), numpy.sin(angle)
    w = numpy.column_stack([c * EARTH[0], -s * EARTH[0], EARTH[2] + turning])
    f = numpy.column_stack([-0.05 * turning**2, 0.05 * numpy.gradient(turning, t), 0 * t + GRAVITY])
    encoder = numpy.round(numpy.interp(t - late, t, angle) / DEG, 3)
    write_log(path, t, g.read(w @ tilt.T, rate_hz, rng), a.read(f @ tilt.T, rate_hz, rng), [encoder], ["encoder_deg"])
    return {"response": (g.matrix @ tilt)[:, 2], "late_s": late, "interval_s": 1 / rate_hz}


def centrifuge(path, rng):
    """Rest, seven levels from 1.4 to 6 g on an arm of a metre, rest; the accelerometers alone."""
    g, a = industrial(rng)
    turning = numpy.zeros(0)
    for level in (0, 1, 1.5, 2, 3, 4, 5, 6, 0):
        target, before = numpy.sqrt(level * G0), turning[-1] if len(turning) else 0.0
        turning = numpy.concatenate([turning, numpy.linspace(before, target, 400), numpy.full(1500, target)])
    t = (numpy.arange(len(turning)) + 1) / 100
    f = numpy.column_stack([-turning**2, numpy.gradient(turning, t), 0 * t + GRAVITY])
    write(path, ["t_s", *NAMES[3:]], [t, *of(a.read(f, 100, rng), G0)], ["%.2f"] + ["%.6f"] * 3)
    return {"levels": 7}


def smooth(rng, n, sigma, samples, columns=1):
    kernel = numpy.hanning(max(3, samples))
    kernel /= numpy.linalg.norm(kernel)
    return sigma * numpy.column_stack([numpy.convolve(rng.normal(0, 1, n), kernel, "same") for _ in range(columns)])


def drive(path, rng, stands_s):
    """A vehicle in traffic for eight minutes, at once or after it stood for 15 s; a pedestrian."""
    g, a = industrial(rng)
    n = int((480 + stands_s) * 100)
    t = (numpy.arange(n) + 1) / 100
    go = numpy.clip((t - stands_s) / 5, 0, 1) if stands_s else numpy.ones(n)
    yaw, along = smooth(rng, n, 8 * DEG, 800)[:, 0] * go, smooth(rng, n, 0.8, 600)[:, 0] * go
    roll, pitch = (smooth(rng, n, 1.5 * DEG, 500, 2) * go[:, None]).T
    speed = numpy.maximum(numpy.cumsum(along) / 100 + 12 * go, 0)
    w = EARTH + numpy.column_stack([numpy.gradient(roll, t), numpy.gradient(pitch, t), yaw]) + smooth(rng, n, 0.4 * DEG, 20, 3) * go[:, None]
    f = numpy.column_stack([along - GRAVITY * numpy.sin(pitch), yaw * speed + GRAVITY * numpy.sin(roll), 0 * t + GRAVITY])
    f = f + smooth(rng, n, 0.25, 10, 3) * go[:, None]
    write_log(path, t, g.read(w, 100, rng), a.read(f, 100, rng))
    return {"at_rest": g.matrix @ EARTH + g.bias}


def walk(path, rng):
    """A pedestrian's foot for three minutes, of a logger that says no unit."""
    g, a = consumer(rng)
    a.limit = 16 * G0
    n = 18000
    t = (numpy.arange(n) + 1) / 100
    step = 2 * numpy.pi * 0.9 * t
    swing = numpy.column_stack([25 * DEG * numpy.sin(step), 6 * DEG * numpy.sin(step + 1), 8 * DEG * numpy.sin(step + 2)])
    f = numpy.column_stack([numpy.sin(swing[:, 1]), numpy.sin(swing[:, 0]), numpy.cos(swing[:, 0])]) * GRAVITY
    f = f + numpy.column_stack([2 * numpy.sin(2 * step), 1.2 * numpy.sin(step), 3 * numpy.sin(2 * step + 0.5)]) + rng.normal(0, 0.4, (n, 3))
    write(path, ["timestamp_ms", "accX", "accY", "accZ", "gyrX", "gyrY", "gyrZ"],
          [numpy.round(t * 1000), *of(a.read(f, 100, rng)), *of(g.read(numpy.gradient(swing, axis=0) * 100, 100, rng))], ["%d"] + ["%.5f"] * 6)
    return {}
