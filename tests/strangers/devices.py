"""What devices and their loggers write beside or in the place of plain readings: halves of words."""
import numpy

from parts import by_hand
from recordings import write
from sensors import DEG, G0, consumer, industrial


def halves(folder, rng):
    """Words of 32 bits in two registers each, as Analog Devices name them, with and without a sign; most and least significant word; InvenSense's bytes.
    The low halves empty; two ranges that are called low and high; the halves the wrong way round."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    gyro, force = g.read(w, 100.0, rng) / DEG * 40 * 65536, a.read(f, 100.0, rng) / G0 * 4000 * 65536
    counts = numpy.round(numpy.column_stack([gyro, force])).astype(numpy.int64)
    high, low, ms = counts >> 16, counts & 0xFFFF, (t * 1000).astype(int)
    registers = [f"{x}_{s}" for s in ("GYRO", "ACCL") for x in "XYZ"]

    def put(file, names, lows, highs, first="LOW"):
        title = [f"{r}_{n}" for r in registers for n in names]
        columns = [c[:, k] for k in range(6) for c in ((lows, highs) if first == "LOW" else (highs, lows))]
        write(folder / file, ["time_ms", *title], [ms, *columns], ["%d"] * 13)
    put("adis.csv", ("LOW", "OUT"), low, high)
    put("unsigned.csv", ("LOW", "OUT"), low, high % 65536)
    put("signed.csv", ("MSW", "LSW"), (low + 32768) % 65536 - 32768, high, "HIGH")
    put("exchanged.csv", ("LOW", "OUT"), high, low)
    put("empty.csv", ("LOW", "OUT"), 0 * low, high)
    _, consumers, *_ = by_hand(rng, consumer, 2)
    wide = numpy.round(numpy.column_stack([g.read(w, 100.0, rng) / DEG * 16.4, consumers.read(f, 100.0, rng) / G0 * 8192])).astype(numpy.int64)
    registers = [f"{s}_{x}OUT" for s in ("GYRO", "ACCEL") for x in "XYZ"]
    put("bytes.csv", ("H", "L"), wide & 0xFF, wide >> 8, "HIGH")
    ranges = numpy.round(numpy.column_stack([force, force / 16]) / 65536).astype(int)
    write(folder / "ranges.csv", ["time_ms", *[f"gyro_{x}" for x in "xyz"], *[f"acc_low_{x}" for x in "xyz"], *[f"acc_high_{x}" for x in "xyz"]],
          [ms, *high[:, :3].T, *ranges.T], ["%d"] * 10)
    return {"g": g, "a": a, "raw_per_rad_s": 40 * 65536 / DEG, "per_g": 4000 * 65536 / G0, "bytes": {"a": consumers, "per_g": 8192 / G0}}
