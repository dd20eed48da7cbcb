"""What a logger does to sound readings: words without a sign, rows that are lost or late, times in two columns, quanta that hide the noise, zeros set in a pose."""
import numpy

from parts import by_hand
from recordings import FACES, of, write
from sensors import DEG, EARTH, G0, UP, consumer, fibre, industrial, moved, turn
from tables import NAMES, write_log


def lost_rows(folder, rng):
    """No time; a packet counter of 8 bits says which rows were lost, one in sixteen while it turns."""
    g, a = industrial(rng)
    stops = [(turn(rng.normal(size=3), rng.uniform(0.3, numpy.pi)), rng.uniform(6, 9), 2.0) for _ in range(18)]
    t, f, w = moved(100.0, stops, rng, 0.3)
    kept = (numpy.abs(w).max(1) < 0.02) | (rng.random(len(t)) > 1 / 16)
    write(folder / "log.csv", ["Packet number", *NAMES], [numpy.arange(len(t))[kept] % 256, *of(g.read(w, 100.0, rng)[kept], DEG),
                                                          *of(a.read(f, 100.0, rng)[kept], G0)], ["%d"] + ["%.5f"] * 3 + ["%.6f"] * 3)
    return {"g": g, "a": a, "lost": int((~kept).sum())}


def eight_bits(folder, rng):
    """Accelerometers of 8 bits, 64 counts a g, whose noise is a fiftieth of a count: by hand, with gyros; and six faces, each twice."""
    _, a = consumer(rng)
    a.asd, a.instability, a.quantum = 300e-6 * G0 / 10, 0.0, G0 / 64
    g, _, t, f, w = by_hand(rng, consumer, 14, 50.0)
    write_log(folder / "hand.csv", t, g.read(w, 50.0, rng), a.read(f, 50.0, rng))
    t, f, _ = moved(50.0, [(UP[x], 15.0, 2.0) for x in FACES + FACES], rng, 0.3)
    write(folder / "faces.csv", ["t_s", *NAMES[3:]], [t, *of(a.read(f, 50.0, rng), G0)], ["%.2f"] + ["%.6f"] * 3)
    return {"g": g, "a": a}


def zero_in_a_pose(folder, rng):
    """Accelerometers that were set to zero where they lay: 0 g in the first pose, up to 2 g in others."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force = a.read(f, 100.0, rng)
    a.bias = a.bias - force[:300].mean(0)
    write_log(folder / "log.csv", t, g.read(w, 100.0, rng), force - force[:300].mean(0))
    return {"g": g, "a": a}


def encoder(folder, rng):
    """A rate table whose encoder counts 2^20 a turn, clockwise; the same angle in rad by its name."""
    g, a = industrial(rng)
    rates = numpy.concatenate([numpy.full(900, float(r)) for r in (0, 20, -20, 60, -60, 150, -150, 0)])
    rates = numpy.convolve(numpy.pad(rates, 100, "edge"), numpy.ones(201) / 201, "valid")
    angle, t = numpy.cumsum(rates) / 100 * DEG, (numpy.arange(len(rates)) + 1) / 100
    c_bn = numpy.array([turn([0, 0, 1], x) for x in angle]).transpose(0, 2, 1)
    rate = g.read(c_bn @ EARTH + (rates * DEG)[:, None] * [0, 0, 1], 100.0, rng)
    force = a.read(c_bn @ [0, 0, G0], 100.0, rng)
    write_log(folder / "counts.csv", t, rate, force, [numpy.floor(-angle / numpy.pi / 2 * 2**20) % 2**20], ["encoder_counts"])
    write(folder / "rad.csv", ["t_s", "encoder_rad", *NAMES], [t, angle, *of(rate, DEG), *of(force, G0)], ["%.2f", "%.7f"] + ["%.5f"] * 3 + ["%.6f"] * 3)
    return {"response": g.matrix[:, 2]}


def unsigned(folder, rng):
    """Registers as words without a sign, decimal and hexadecimal; with it, but full in fast turns."""
    g, a, t, f, w = by_hand(rng, consumer, 16)
    per_rad_s, per_g = 131 / DEG, 8192
    names = ["ms", "ax", "ay", "az", "gx", "gy", "gz"]
    counts = numpy.column_stack([numpy.round(a.read(f, 100.0, rng) / G0 * per_g), numpy.round(g.read(w, 100.0, rng) * per_rad_s)]).astype(int)
    for name, words, form in (("plain.csv", counts % 65536, "%d"), ("hex.csv", counts % 65536, "0x%04X"), ("full.csv", (counts + 32768) % 65536 - 32768, "%d")):
        write(folder / name, names, [(t * 1000).astype(int), *words.T], ["%d"] + [form] * 6)
    return {"g": g, "a": a, "raw_per_rad_s": per_rad_s, "per_g": per_g / G0}


def by_network(folder, rng):
    """Seconds and nanoseconds in two columns, some rows behind later ones; the card's last block filled up with zeros."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    order = numpy.arange(len(t))
    for k in rng.choice(len(t) // 10 - 2, len(t) // 300, False) * 10:
        order[[k, k + 1]] = order[[k + 1, k]]
    stamps = 1589000000370000000 + numpy.round(t * 1000).astype(numpy.int64) * 1000000
    columns = [stamps // 10**9, stamps % 10**9, *of(g.read(w, 100.0, rng), DEG), *of(a.read(f, 100.0, rng), G0)]
    write(folder / "log.csv", ["secs", "nsecs", *NAMES], [c[order] for c in columns], ["%d", "%d"] + ["%.5f"] * 3 + ["%.6f"] * 3)
    with open(folder / "log.csv", "ab") as out:
        out.write(b"1589000900,5000\0" + b"\0" * 5000)
    return {"g": g, "a": a}


def open_rows(folder, rng):
    """ST's and Shimmer's tables: a tab behind each row, names with units in brackets or in a line of their own; WitMotion's with blanks in fields."""
    g, a, t, f, w = by_hand(rng, consumer, 16)
    rate, force = g.read(w, 100.0, rng) / DEG, a.read(f, 100.0, rng)
    columns = [t * 1e6, *of(force, G0 / 1000), *of(rate * 1000)]
    clock = [f"2023-4-11 10:{12 + int(x) // 60:02}:{x % 60:06.3f}" for x in t]
    st = ["time[us]", *[f"acc_{x}[mg]" for x in "xyz"], *[f"gyro_{x}[mdps]" for x in "xyz"], ""]
    write(folder / "st.txt", st, [*columns, [""] * len(t)], ["%d"] + ["%.3f"] * 6 + ["%s"], "\t")
    units = ["us", *["mg"] * 3, *["mdps"] * 3, ""]
    shimmer = ["Unit_Timestamp_CAL", *[f"Unit_Accel_LN_{x}_CAL" for x in "XYZ"], *[f"Unit_Gyro_{x}_CAL" for x in "XYZ"], ""]
    head = ['"sep=\t"\n' + shimmer[0], *shimmer[1:-1], "\n" + "\t".join(units)]
    write(folder / "shimmer.csv", head, [*columns, [""] * len(t)], ["%d"] + ["%.3f"] * 6 + ["%s"], "\t")
    wit = ["address\tChipTime", "Time(ms)", *[f"a{x}(g)" for x in "xyz"], *[f"w{x}(deg/s)" for x in "xyz"]]
    write(folder / "wit.txt", wit, [["A5"] * len(t), clock, t * 1000, *of(force, G0), *of(rate)], ["%s", "%s", "%.1f"] + ["%.5f"] * 6, "\t")
    return {"g": g, "a": a}


def one_on_a_table(folder, rng):
    """One fibre gyro across the axis of a table that stops at twelve headings: the Earth's rate goes round in it."""
    g, _ = fibre(rng)
    angles = numpy.concatenate([numpy.append(numpy.full(1000, q * 30.0), numpy.linspace(q * 30, q * 30 + 30, 100)) for q in range(12)])
    c_bn = numpy.array([turn([0, 0, 1], x) for x in angles * DEG]).transpose(0, 2, 1)
    rate = c_bn @ EARTH + numpy.gradient(angles * DEG)[:, None] * 20 * [0, 0, 1]
    write(folder / "log.csv", ["time_s", "table_deg", "gyro_x_deg_per_h"], [(numpy.arange(len(angles)) + 1) / 20, angles, g.read(rate, 20.0, rng)[:, 0] / DEG * 3600],
          ["%.2f", "%.4f", "%.4f"])
    return {"bias": g.bias[0]}
