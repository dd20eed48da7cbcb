"""Gyros that their device sets to zero, and one gyro at headings that nobody says."""
import numpy

from parts import by_hand
from recordings import of, write
from sensors import DEG, EARTH, GRAVITY, fibre, industrial, turn
from tables import write_log


def silent(folder, rng):
    """A device that sets its gyros to zero at rest: below 0.3 deg/s by hand, wholly in one pose; a fibre gyro turned to eight headings, no angle beside it."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    rate = g.read(w, 100.0, rng) - g.bias
    write_log(folder / "hand.csv", t, numpy.where(numpy.abs(rate) < 0.3 * DEG, 0.0, rate), a.read(f, 100.0, rng))
    n = 60000
    write_log(folder / "rest.csv", (numpy.arange(n) + 1) / 100, numpy.zeros((n, 3)), a.read(numpy.tile([0, 0, GRAVITY], (n, 1)), 100.0, rng))
    one, _ = fibre(rng)
    angle = numpy.concatenate([numpy.append(numpy.full(2000, q * 45.0), numpy.linspace(q * 45, q * 45 + 45, 100)) for q in range(8)])
    c_bn = numpy.array([turn([0, 0, 1], x) for x in angle * DEG]).transpose(0, 2, 1)
    rate = one.read(c_bn @ EARTH + numpy.gradient(angle * DEG)[:, None] * 20 * [0, 0, 1], 20.0, rng)
    write(folder / "headings.csv", ["time_s", "gyro_x_deg_per_h"], [(numpy.arange(len(angle)) + 1) / 20, rate[:, 0] / DEG * 3600], ["%.2f", "%.4f"])
    return {"g": g, "a": a, "bias": g.bias * 0}
