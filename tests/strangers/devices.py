"""What devices and their loggers write beside or in the place of plain readings: halves of words, sets that were calibrated, a receiver's sentences, clocks of UTC, modules of few axes, few poses while it warms up."""
import numpy

from parts import by_hand
from recordings import anywhere, of, tilted, write
from sensors import DEG, G0, UP, consumer, industrial, moved
from tables import NAMES, write_log


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


def side_by_side(folder, rng):
    """Raw and calibrated sets in one file: raw counts behind the calibrated ones, before them, Android's uncalibrated gyros, a plain set beside a filtered one.
    Two sensors that no name tells apart; two of which one is filtered in x alone."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    rate, force = g.read(w, 100.0, rng), a.read(f, 100.0, rng)
    other = by_hand(rng, industrial, 2)
    rate2, force2 = other[0].read(w, 100.0, rng), other[1].read(f, 100.0, rng)
    clean = (numpy.linalg.solve(g.matrix, (rate - g.bias).T).T, numpy.linalg.solve(a.matrix, (force - a.bias).T).T)
    counts = [*of(numpy.round(rate / DEG * 400)), *of(numpy.round(force / G0 * 16000))]
    si = [*of(clean[0]), *of(clean[1])]

    def put(file, titles, columns, forms):
        names = [title % axis for title in titles for axis in "xyz"]
        write(folder / file, ["t_s", *names], [t, *columns], ["%.2f", *[form for form in forms for _ in range(3)]])
    put("behind.csv", ("gyr_%s_rad_s", "acc_%s_m_s2", "gyr_raw_%s", "acc_raw_%s"), si + counts, ("%.7f", "%.6f", "%d", "%d"))
    put("before.csv", ("raw_gyr_%s", "raw_acc_%s", "cal_gyr_%s", "cal_acc_%s"), counts + si, ("%d", "%d", "%.7f", "%.6f"))
    put("android.csv", ("acc_%s_m_s2", "gyro_uncalibrated_%s_rad_s", "gyro_%s_rad_s"), [*of(force), *of(rate), *si[:3]], ("%.6f", "%.7f", "%.7f"))
    put("filtered.csv", ("gyro_%s_rad_s", "acc_%s_m_s2", "gyro_filtered_%s_rad_s", "acc_filtered_%s_m_s2"), [*of(rate), *of(force), *si], ("%.7f", "%.6f", "%.7f", "%.6f"))
    put("two.csv", ("gyro1_%s_rad_s", "acc1_%s_m_s2", "gyro2_%s_rad_s", "acc2_%s_m_s2"), [*of(rate2), *of(force2), *of(rate), *of(force)], ("%.7f", "%.6f", "%.7f", "%.6f"))
    write(folder / "one.csv", ["t_s", *[f"gyro_{x}_rad_s" for x in "xyz"], "acc_x_m_s2", "acc_y_m_s2", "acc_z_m_s2", "acc_x_filtered_m_s2", "acc_y_m_s2", "acc_z_m_s2"],
          [t, *of(rate), *of(force), *of(force2)], ["%.2f"] + ["%.7f"] * 3 + ["%.6f"] * 6)
    return {"g": g, "a": a, "raw_per_rad_s": 400 / DEG, "per_g": 16000 / G0}


def checksum(text):
    """NovAtel's 32 bits, bit by bit."""
    register = 0
    for byte in text.encode():
        register ^= byte
        for _ in range(8):
            register = (register >> 1) ^ (0xEDB88320 if register & 1 else 0)
    return f"{register:08x}"


def novatel(folder, rng):
    """NovAtel's logs: RAWIMUS among positions, a week that ends, a line that was damaged; RAWIMUX with long headers.
    What the receiver corrected; all lines damaged; positions alone."""
    g, a, t, f, w = by_hand(rng, industrial, 14, 125.0)
    per_s, angle, velocity = 125, 1e-9, 2e-8   # counts of an IMU of theirs
    counts = numpy.round(numpy.column_stack([a.read(f, 125.0, rng) / velocity, g.read(w, 125.0, rng) / angle]) / per_s).astype(numpy.int64)
    seconds = 604800 - t[len(t) // 2] + t
    weeks, seconds = 2209 + (seconds >= 604800), seconds % 604800
    raw = [f"{c[2]},{-c[1]},{c[0]},{c[5]},{-c[4]},{c[3]}" for c in counts]
    damaged = int(rng.integers(3000, len(t) - 100))

    def line(mark, head, fields, wrong=False):
        text = f"{head};{fields}"
        return f"{mark}{text}*{checksum(text + ' ' * wrong)}\r\n"

    def short(name, k, fields, wrong=False):
        return line("%", f"{name},{weeks[k]},{seconds[k]:.3f}", fields, wrong)
    position = "SOL_COMPUTED,PPP,48.30000000000,11.60000000000,480.0000,46.0000,WGS84,0.0119,0.0107,0.0198"

    def positions(k):
        return line("#", f"BESTPOSA,COM1,0,65.0,FINESTEERING,{weeks[k]},{seconds[k]:.3f},02000020,cdba,16809", position) if k % 125 == 0 else ""

    def put(file, row, count=len(t)):
        (folder / file).write_text("[COM1]<OK\r\n" + "".join(row(k) for k in range(count)), encoding="ascii", newline="")
    put("rawimus.gps", lambda k: positions(k) + short("RAWIMUSA", k, f"{weeks[k]},{seconds[k]:.9f},ea5afe00,{raw[k]}", k == damaged))
    put("rawimux.log", lambda k: line("#", f"RAWIMUXA,USB1,0,64.5,FINESTEERING,{weeks[k]},{seconds[k]:.3f},02000020,0dc5,16809",
                                      f"04,41,{weeks[k]},{seconds[k]:.9f},ea5afe00,{raw[k]}"))
    put("corrected.txt", lambda k: positions(k) + short("IMURATECORRIMUSA", k, f"{weeks[k]},{seconds[k]:.9f},0.000105592,-0.000227975,-0.000027416,-0.002454522,-0.000917886,-0.004175763"), 500)
    put("damaged.txt", lambda k: short("RAWIMUSA", k, f"{weeks[k]},{seconds[k]:.9f},ea5afe00,{raw[k]}", True), 500)
    put("positions.txt", lambda k: positions(125 * k), 50)
    return {"g": g, "a": a, "raw_per_rad_s": 1 / angle / per_s, "per_g": 1 / velocity / per_s}


def clocks(folder, rng):
    """One log through a leap second in POSIX and UTC, in whole seconds too; through midnight with rows lost there, in whole seconds, as hhmmss; through a GPS week's end.
    A clock that was set back by three seconds."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    forms = ["%.5f"] * 3 + ["%.6f"] * 3
    values = [*of(g.read(w, 100.0, rng), DEG), *of(a.read(f, 100.0, rng), G0)]
    t = numpy.round(t - t[int(len(t) * rng.uniform(0.3, 0.7))], 2)   # zero where the day, the second or the week ends
    late, ten_ms = (t >= 0), numpy.round(t * 100).astype(int)
    lost = (ten_ms >= -2) & (ten_ms < 5)

    def day(k):
        return f"{k // 360000:02d}:{k // 6000 % 60:02d}:{k % 6000 / 100:05.2f}"

    def put(file, name, stamps, form, keep=slice(None)):
        write(folder / file, [name, *NAMES], [numpy.asarray(stamps)[keep], *[v[keep] for v in values]], [form, *forms])
    put("posix.csv", "unix_time", 1483228800 + t - late, "%.2f")   # the last second of 2016 stands twice
    put("posix_ms.csv", "timestamp_ms", 1483228800000 + ten_ms * 10 - 1000 * late, "%d")
    put("whole.csv", "unix_time", numpy.floor(1483228800 + t - late), "%d")
    leap = (ten_ms >= 0) & (ten_ms < 100)
    put("utc.csv", "time_utc", [f"2016-12-31T23:59:60.{k:02d}Z" if x else f"2016-12-31T{day(8640000 + k)}Z" if k < 0 else f"2017-01-01T{day(k - 100)}Z"
                                for k, x in zip(ten_ms, leap)], "%s")
    put("midnight.csv", "time", [day(k % 8640000) for k in ten_ms], "%s", ~lost)
    put("seconds.csv", "time", [day(k % 8640000)[:8] for k in ten_ms], "%s")
    put("digits.csv", "utc", [day(k % 8640000).replace(":", "") for k in ten_ms], "%s")
    put("week.csv", "gps_tow_s", (604800 + t) % 604800, "%.2f", ~lost)
    put("back.csv", "time_s", 5000 + t - 3 * late, "%.2f")
    return {"g": g, "a": a}


def few_axes(folder, rng):
    """Modules that lack axes, at rest: two accelerometers and one gyro, of a car; three accelerometers and one gyro, turned by hand; two accelerometers beside three gyros.
    Two accelerometers alone; two of each."""
    g, a = industrial(rng)
    t, f, w = moved(100.0, [(tilted(UP["+z"], rng, 0.05), 200.0, 0)], rng)
    rate, force = g.read(w, 100.0, rng) / DEG, a.read(f, 100.0, rng) / G0
    plane = ["t_s", "ax_g", "ay_g", "yaw_rate_dps"]
    write(folder / "plane.csv", plane, [t, *force[:, :2].T, rate[:, 2]], ["%.2f"] + ["%.6f"] * 3)
    write(folder / "three.csv", [*plane[:3], "gx_dps", "gy_dps", "gz_dps"], [t, *force[:, :2].T, *rate.T], ["%.2f"] + ["%.6f"] * 5)
    write(folder / "two.csv", plane[:3], [t, *force[:, :2].T], ["%.2f"] + ["%.6f"] * 2)
    write(folder / "four.csv", [*plane[:3], "gx_dps", "gy_dps"], [t, *force[:, :2].T, *rate[:, :2].T], ["%.2f"] + ["%.6f"] * 4)
    g2, a2, t2, f2, w2 = by_hand(rng, industrial, 16)
    write(folder / "spatial.csv", ["t_s", "ax_g", "ay_g", "az_g", "rate_x_dps"], [t2, *of(a2.read(f2, 100.0, rng), G0), g2.read(w2, 100.0, rng)[:, 0] / DEG],
          ["%.2f"] + ["%.6f"] * 4)
    at_rest = w.mean(0) @ g.matrix.T + g.bias
    return {"a": a2, "mean": at_rest, "asd": g.asd, "wander": 2 * g.instability}


def warming_up(folder, rng):
    """Nine poses by hand, as many as there are unknowns, in the minutes in which accelerometers warm up by 3 to 6 mg; a ramp of 1 to 2 mg; the same poses of a warm one."""
    g, a = industrial(rng)
    t, f, w = moved(100.0, [(anywhere(rng), rng.uniform(6, 11), rng.uniform(1, 2)) for _ in range(9)], rng, 0.4)
    passed, way = (t / t[-1])[:, None], rng.uniform(3, 6, 3) * rng.choice([-1, 1], 3) * 1e-3 * G0
    files = {"warm.csv": 0 * passed * way, "ramp.csv": passed * way / 3, "warming.csv": (1 - numpy.exp(-passed * rng.uniform(1, 5))) * way}
    for name, extra in files.items():
        write_log(folder / name, t, g.read(w, 100.0, rng), a.read(f, 100.0, rng, extra))
    return {"a": a, "files": {name: extra.mean(0) for name, extra in files.items()}}
