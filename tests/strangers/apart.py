"""Positions that nothing connects: a file each of a navigation-grade unit, a time that begins anew in each, turns that were cut out; a clock of whole seconds."""
import numpy

from parts import by_hand
from recordings import anywhere, of, tilted, write
from sensors import DEG, G0, UP, industrial, moved, triad
from tables import NAMES, write_log


def navigation(rng):    # LN-100, iNAV: ring laser gyros, bias of 0.02 deg/h, 0.003 deg/sqrt(h)
    return (triad(rng, 0.003 / 60 * DEG, 0.003 / 3600 * DEG, 0.02 / 3600 * DEG, 2e-5, 2e-5),
            triad(rng, 8e-6 * G0, 2e-6 * G0, 1e-4 * G0, 1e-4, 1e-4))


def ring_lasers(folder, rng):
    """Each axis up and down, 200 s in a file each, any heading; the Earth makes 15 deg/h in gyros that are good to 0.02."""
    g, a = navigation(rng)
    files = []
    for face in ("+x", "-x", "+y", "-y", "+z", "-z"):
        heading = numpy.array(UP[face])
        c = tilted(rotation_about_up(rng) @ heading, rng, 0.3 * DEG)
        t, f, w = moved(64.0, [(c, 200.0, 0)], rng)
        files.append(f"{face[1]}_{'up' if face[0] == '+' else 'down'}.csv")
        write(folder / files[-1], ["t_s", *NAMES], [t, *of(g.read(w, 64.0, rng), DEG), *of(a.read(f, 64.0, rng), G0)], ["%.6f"] + ["%.10f"] * 6)
    return {"g": g, "a": a, "files": files}


def rotation_about_up(rng):
    angle = rng.uniform(0, 2 * numpy.pi)
    c, s = numpy.cos(angle), numpy.sin(angle)
    return numpy.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])


def restarts(folder, rng):
    """Twenty positions in one file: the logger is started anew in each, its time at 0; the turns cut out and the rows on one clock."""
    g, a = industrial(rng)
    parts = [moved(100.0, [(anywhere(rng), rng.uniform(8, 12), 0)], rng) for _ in range(20)]
    t, f, w = (numpy.concatenate([p[k] for p in parts]) for k in range(3))
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    write_log(folder / "anew.csv", t, rate, force)
    write_log(folder / "cut.csv", (numpy.arange(len(t)) + 1) / 100, rate, force)
    two = numpy.concatenate([numpy.arange(len(t)), numpy.arange(len(t))])   # two sensors, one under the other
    write_log(folder / "two.csv", ((numpy.arange(len(t)) + 1) / 100)[two], rate[two], force[two])
    return {"g": g, "a": a}


def whole_seconds(folder, rng):
    """A spreadsheet's clock of whole seconds, in s and as a time of the day, begun in the middle of one."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    seconds = numpy.floor(t + rng.uniform(0.2, 0.8)).astype(int)
    columns = [*of(rate, DEG), *of(force, G0)]
    forms = ["%.5f"] * 3 + ["%.6f"] * 3
    write(folder / "seconds.csv", ["time_s", *NAMES], [seconds, *columns], ["%d", *forms])
    write(folder / "clock.csv", ["Time", *NAMES], [[f"12:{s // 60:02}:{s % 60:02}" for s in seconds], *columns], ["%s", *forms])
    return {"g": g, "a": a}
