"""Sound sensors in unsound logs, and what fails in a sensor: two of them in one file, two rates, locales, clocks, axes, ends of ranges, knocks."""
import numpy

from parts import by_hand
from recordings import FACES, of, tilted, write
from sensors import DEG, EARTH, G0, GRAVITY, UP, consumer, fibre, industrial, moved, turn
from tables import NAMES, write_log


def instances(folder, rng):
    """ArduPilot's IMU rows as mavlogdump writes them: instances 0 and 1 take turns; with stamps of their own, and with one stamp and no column of it."""
    g, a, t, f, w = by_hand(rng, consumer, 12, 50.0)
    other = consumer(rng)
    rates, forces = [x.read(w, 50.0, rng) for x in (g, other[0])], [x.read(f, 50.0, rng) for x in (a, other[1])]
    us = (t * 1e6 + 12345678).astype(int)
    named = ["GyrX", "GyrY", "GyrZ", "AccX", "AccY", "AccZ"]
    both = [numpy.stack(pair, 1).reshape(-1, 3) for pair in (rates, forces)]
    write(folder / "I.csv", ["TimeUS", "I", *named], [numpy.stack([us, us + 40], 1).ravel(), numpy.tile([0, 1], len(t)), *of(both[0]), *of(both[1])],
          ["%d", "%d"] + ["%.6f"] * 6)
    write(folder / "none.csv", ["TimeUS", *named], [numpy.repeat(us, 2), *of(both[0]), *of(both[1])], ["%d"] + ["%.6f"] * 6)
    write(folder / "first.csv", ["TimeUS", "I", *named], [us, 0 * us, *of(rates[0]), *of(forces[0])], ["%d", "%d"] + ["%.6f"] * 6)
    return {}


def two_rates(folder, rng):
    """Gyros at 200 Hz, accelerometers in each fourth row, the fields between them empty."""
    g, a, t, f, w = by_hand(rng, industrial, 14, 200.0)
    rate, force = g.read(w, 200.0, rng) / DEG, a.read(f, 200.0, rng) / G0
    cells = [["%.6f" % x if k % 4 == 0 else "" for k, x in enumerate(force[:, axis])] for axis in range(3)]
    write(folder / "log.csv", ["t_s", *NAMES], [t, *rate.T, *cells], ["%.3f"] + ["%.5f"] * 3 + ["%s"] * 3)
    return {"g": g, "a": a}


def locales(folder, rng):
    """A French and a German spreadsheet: decimal commas, thousands with points, names that are no English, a byte-order mark, Latin-1."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng) / DEG, a.read(f, 100.0, rng)
    with open(folder / "fr.csv", "w", encoding="utf-8-sig", newline="") as out:
        out.write("Temps (s);" + ";".join(f"Vitesse angulaire {x} (°/s)" for x in "XYZ") + ";" + ";".join(f"Accélération {x} (m/s²)" for x in "XYZ") + "\r\n")
        for row in zip(t, *rate.T, *force.T):
            out.write(";".join(f"{x:.6f}".replace(".", ",") for x in row) + "\r\n")

    def german(x, digits):
        return f"{x:,.{digits}f}".translate(str.maketrans(",.", ".,"))
    with open(folder / "de.csv", "w", encoding="latin-1", newline="") as out:
        out.write("Zeit [ms];" + ";".join(f"Drehrate {x} [°/s]" for x in "XYZ") + ";" + ";".join(f"Beschl. {x} [mg]" for x in "XYZ") + "\r\n")
        for row in zip(t * 1000, *rate.T, *(force / G0 * 1000).T):
            out.write(";".join([german(row[0], 0), *[german(x, 5) for x in row[1:]]]) + "\r\n")
    return {"a": a, "g": g}


def coarse_clock(folder, rng):
    """128 Hz with stamps in whole 10 ms; the same with a burst's counter, 16 a row, full at 65536, and counts of 32 bits."""
    g, a, t, f, w = by_hand(rng, industrial, 14, 128.0)
    rate, force = g.read(w, 128.0, rng), a.read(f, 128.0, rng)
    write(folder / "ms.csv", ["time_ms", *NAMES], [numpy.floor(t * 100) * 10, *of(rate, DEG), *of(force, G0)], ["%d"] + ["%.5f"] * 3 + ["%.6f"] * 3)
    counts = numpy.column_stack([numpy.round(rate / DEG * 40 * 65536), numpy.round(force / G0 * 4000 * 65536)])
    write(folder / "count.csv", ["DATA_CNT", *[f"{x}_{s}_OUT" for s in ("GYRO", "ACCL") for x in "XYZ"]],
          [(65000 + 16 * numpy.arange(len(t))) % 65536, *counts.T], ["%d"] * 7)
    return {"g": g, "a": a, "raw_per_rad_s": 40 * 65536 / DEG}


def time_behind(folder, rng):
    """PSINS: increments in rad and m/s, no names, the time behind them; fibre gyros in which the Earth makes 15 deg/h."""
    g, a = fibre(rng)
    t, f, w = moved(100.0, [(tilted(UP[x], rng, 0.5 * DEG), 40.0, 3.0) for x in FACES + ["+z"]], rng, tremor=0.01)
    write(folder / "imu.txt", [], [*of(g.read(w, 100.0, rng) / 100), *of(a.read(f, 100.0, rng) / 100), t], ["%.12e"] * 6 + ["%.4f"], " ")
    lines = (folder / "imu.txt").read_text(encoding="utf-8").split("\n", 1)[1]
    (folder / "imu.txt").write_text(lines, encoding="utf-8")
    return {"g": g, "raw_per_rad_s": 0.01}


def wrong_axes(folder, rng):
    """z of the accelerometers reversed; y of the gyros; x and y of the accelerometers exchanged; increments that are called deg/s; all right."""
    g, a, t, f, w = by_hand(rng, industrial, 14)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    for name, gyros, accelerometers in (("z", rate, force * [1, 1, -1]), ("y", rate * [1, -1, 1], force), ("swap", rate, force[:, [1, 0, 2]]),
                                        ("increments", rate / 100, force), ("right", rate, force)):
        write(folder / f"{name}.csv", ["t_s", *NAMES], [t, *of(gyros, DEG), *of(accelerometers, G0)], ["%.2f"] + ["%.8f"] * 3 + ["%.6f"] * 3)
    return {}


def half_dead(folder, rng):
    """A gyro that stands from the middle on; one that never answers; faces of accelerometers whose range is 1 g."""
    g, a, t, f, w = by_hand(rng, industrial, 20)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    stuck, dead = rate.copy(), rate.copy()
    stuck[len(t) // 2:, 0] = stuck[len(t) // 2, 0]
    dead[:, 1] = 2e-4
    write_log(folder / "stuck.csv", t, stuck, force)
    write_log(folder / "dead.csv", t, dead, force)
    _, b = industrial(rng)
    b.bias = numpy.abs(b.bias) * [1, -1, 1] + [0.02, -0.02, 0.02]
    t, f, w = moved(100.0, [(tilted(UP[x], rng, 0.5 * DEG), 20.0, 3.0) for x in FACES], rng, tremor=0.1)
    write_log(folder / "range.csv", t, g.read(w, 100.0, rng), numpy.clip(b.read(f, 100.0, rng), -G0, 0.99997 * G0))
    return {"g": g, "a": a, "b": b}


def knock(folder, rng):
    """Twenty-two poses; somewhere between the fifth and the seventeenth it falls, and its gyros' biases are others behind."""
    g, a, t, f, w = by_hand(rng, industrial, 22)
    at = rng.uniform(0.3, 0.7) * t[-1]
    jump = numpy.array([0.3, -0.2, 0.1]) * DEG
    write_log(folder / "log.csv", t, g.read(w, 100.0, rng, (t > at)[:, None] * jump), a.read(f, 100.0, rng))
    return {"jump": jump, "at": at, "g": g}


def staircases(folder, rng):
    """Two axes: staircases of rates to 100 deg/s both ways about the vertical, tens of rounds, in each of four tilts; no read-out told."""
    g, a = industrial(rng)
    rates = numpy.zeros(0)
    for step in (0, 20, 50, 100, 50, 20, 0, -20, -50, -100, -50, -20, 0):
        before = rates[-1] if len(rates) else 0.0
        rates = numpy.concatenate([rates, numpy.linspace(before, step, max(2, int(abs(step - before)))), numpy.full(700, float(step))])
    at = numpy.cumsum(rates) / 100 * DEG
    force, rate = [], []
    for k, tilt in enumerate((0, 90, 0, -90)):
        c_bn = numpy.array([turn([0, 0, 1], x) @ turn([1, 0, 0], tilt * DEG) for x in at]).transpose(0, 2, 1)
        force.append(c_bn @ [0, 0, GRAVITY])
        rate.append(c_bn @ EARTH + (rates * DEG)[:, None] * c_bn[0, :, 2])
        if k < 3:
            after = turn([0, 0, 1], at[-1]) @ turn([1, 0, 0], (90, 0, -90)[k] * DEG)
            _, f, w = moved(100.0, [(c_bn[-1].T, 1, 5), (after, 1, 0)], rng)
            force.append(f)
            rate.append(w)
    force, rate = numpy.concatenate(force), numpy.concatenate(rate)
    t = (numpy.arange(len(force)) + 1) / 100
    write_log(folder / "log.csv", t, g.read(rate, 100, rng), a.read(force, 100, rng))
    return {"g": g}
