"""Columns that hold something else than their names say, beside sensors that are sound."""
import numpy

from parts import by_hand
from recordings import of, write
from sensors import DEG, G0, consumer, industrial
from tables import NAMES, write_log


def claims(folder, rng):
    """By hand, 16 poses: m/s^2 called g, increments that were added up, angles called rates, accelerometers divided by their size; one coarse and sound."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    forms = ["%.3f"] + ["%.7f"] * 6
    write(folder / "unit.csv", ["t_s", *NAMES], [t, *of(rate, DEG), *of(force)], forms)
    write(folder / "sums.csv", ["t_s", *[f"dth{x}_rad" for x in "xyz"], *[f"dv{x}_mps" for x in "xyz"]],
          [t, *of(numpy.cumsum(rate, 0) / 100), *of(numpy.cumsum(force, 0) / 100)], forms)
    write(folder / "angles.csv", ["t_s", *[f"g{x}_deg" for x in "xyz"], *NAMES[3:]], [t, *of(numpy.cumsum(rate, 0) / 100, DEG), *of(force, G0)], forms)
    write(folder / "direction.csv", ["t_s", *NAMES], [t, *of(rate, DEG), *of(force / numpy.linalg.norm(force, axis=1)[:, None])], forms)
    _, coarse, t, f, w = by_hand(rng, consumer, 16)
    coarse.asd, coarse.quantum = 400e-6 * G0, 4e-3 * G0   # a quantum as large as the noise
    write_log(folder / "coarse.csv", t, g.read(w, 100.0, rng), coarse.read(f, 100.0, rng))
    return {"a": coarse}
