"""Logs in parts and pieces: one axis, a file a sensor or a position, clocks that begin again, rows twice, a power cycle between."""
import struct

import numpy

from recordings import FACES, anywhere, of, tilted, write
from sensors import DEG, EARTH, G0, UP, consumer, industrial, moved
from tables import write_log


def matrices(path, named):
    """MATLAB 5: real matrices, not packed."""
    def element(kind, data):
        return struct.pack("<II", kind, len(data)) + data + b"\0" * (-len(data) % 8)
    out = b"MATLAB 5.0 MAT-file".ljust(116) + b"\0" * 8 + struct.pack("<H", 0x0100) + b"IM"
    for name, values in named.items():
        values = numpy.atleast_2d(numpy.asarray(values, float))
        body = element(6, struct.pack("<II", 6, 0)) + element(5, struct.pack("<ii", *values.shape)) + element(1, name.encode())
        body += element(9, values.T.tobytes())
        out += struct.pack("<II", 14, len(body)) + body
    path.write_bytes(out)


def one_axis(folder, rng):
    """MathWorks' LoggedSingleAxisGyroscope: omega in rad/s and Fs; the same as one column of text in deg/s."""
    g, _ = consumer(rng)
    omega = g.read(numpy.tile(EARTH, (120000, 1)), 100.0, rng)[:, 2]
    matrices(folder / "gyro.mat", {"Fs": [[100.0]], "omega": omega[:, None]})
    write(folder / "gyro.txt", ["omega_dps"], [omega / DEG], ["%.6f"])
    return {"mean": (g.matrix @ EARTH)[2] + g.bias[2], "asd": g.asd, "wander": 2 * g.instability}


def by_hand(rng, kind, count, rate=100.0, tremor=0.4):
    g, a = kind(rng)
    t, f, w = moved(rate, [(anywhere(rng), rng.uniform(6, 11), rng.uniform(1, 2)) for _ in range(count)], rng, tremor)
    return g, a, t, f, w


def phone_files(folder, rng):
    """A phone's logger: a file for each sensor, z first, ns since 1970, each with samples at its own moments; acceleration with gravity and without."""
    g, a, t, f, w = by_hand(rng, consumer, 18)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    up = f / numpy.linalg.norm(f, axis=1)[:, None] * G0   # what the phone takes for gravity
    for name, values, behind in (("TotalAcceleration", force, 0.0), ("Accelerometer", force - up, 0.0), ("Gyroscope", rate, 0.0041)):
        stamps = 1709164800123456789 + numpy.round((t + behind) * 1e9).astype(numpy.int64)
        write(folder / f"{name}.csv", ["time", "seconds_elapsed", "z", "y", "x"], [stamps, t + behind, values[:, 2], values[:, 1], values[:, 0]],
              ["%d", "%.9f"] + ["%.7f"] * 3)
    rows = sorted([(x, "ACC", *v) for x, v in zip(t, force)] + [(x + 0.0041, "GYR", *v) for x, v in zip(t, rate)])
    write(folder / "mixed.csv", ["time_s", "sensor", "x", "y", "z"], list(zip(*rows)), ["%.4f", "%s"] + ["%.7f"] * 3)
    return {"g": g, "a": a}


def full_clock(folder, rng):
    """Xsens: SampleTimeFine is full at 2^32 in the middle, PacketCounter at 65536; a second file has the counter alone."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    n = len(t)
    count, fine = (65000 + numpy.arange(n)) % 65536, (2**32 - 50 * n + 100 * numpy.arange(n)) % 2**32
    columns = [*of(a.read(f, 100.0, rng)), *of(g.read(w, 100.0, rng))]
    names = [f"{s}_{axis}" for s in ("Acc", "Gyr") for axis in "XYZ"]
    for name, clocks, values in (("fine.txt", ["PacketCounter", "SampleTimeFine"], [count, fine]), ("count.txt", ["PacketCounter"], [count])):
        write(folder / name, clocks + names, values + columns, ["%d"] * len(clocks) + ["%.6f"] * 6, "\t")
    return {"a": a}


def position_files(folder, rng):
    """Six faces, a file for each; and the same faces side by side in the columns of one file."""
    g, a = industrial(rng)
    files, blocks, names = [], [], []
    for face in FACES:
        t, f, w = moved(100.0, [(tilted(UP[face], rng, 0.5 * DEG), 30.0, 0)], rng)
        force = a.read(f, 100.0, rng)
        files.append(f"{'up' if face[0] == '+' else 'down'}_{face[1]}.csv")
        write_log(folder / files[-1], t, g.read(w, 100.0, rng), force)
        blocks += of(force, G0)
        names += [f"P{len(files)}_a{axis}_g" for axis in "xyz"]
    write(folder / "blocks.csv", ["t_s", *names], [t, *blocks], ["%.2f"] + ["%.6f"] * 18)
    return {"g": g, "a": a, "files": files}


def power_cycle(folder, rng):
    """Twenty poses; in the middle it was switched off for 95 s, and its biases are others behind. And all of it with every hundredth row twice."""
    g, a, t, f, w = by_hand(rng, industrial, 20)
    behind = (t > t[-1] / 2)[:, None]
    truth = {"jump": numpy.array([0.05, -0.03, 0.02]) * DEG, "g": g, "a": a}
    rate, force = g.read(w, 100.0, rng, behind * truth["jump"]), a.read(f, 100.0, rng)
    write_log(folder / "cycle.csv", t + 95.0 * behind[:, 0], rate, force)
    twice = numpy.sort(numpy.concatenate([numpy.arange(len(t)), rng.choice(len(t), len(t) // 100, False)]))
    rate = g.read(w, 100.0, rng)
    write_log(folder / "twice.csv", t[twice], rate[twice], force[twice])
    return truth
