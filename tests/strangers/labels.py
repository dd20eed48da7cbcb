"""Logs that say in each row what its numbers are: serial monitors, JSON a line, IIO dumps, sentences with a checksum."""
import json

import numpy

from parts import by_hand
from sensors import DEG, G0, industrial


def lines(path, row, count, head="", foot=""):
    with open(path, "w", encoding="utf-8") as out:
        out.write(head + "".join(row(k) + "\n" for k in range(count)) + foot)


def sentence(text):
    check = 0
    for c in text.encode():
        check ^= c
    return f"${text}*{check:02X}"


def lists(folder, rng):
    """Rows as programs print lists, accelerometers before gyros and no names; XML, InfluxDB, names behind a word and in Greek; a rest of such rows."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    mg, dps, n = force / G0, rate / DEG, len(t)

    def numbers(k, form, between=", "):
        return between.join(form % v for v in (t[k], *force[k], *rate[k]))
    forms = {
        "brackets.txt": ("", lambda k: f"[{numbers(k, '%.6f')}]", ""),
        "tuples.txt": ("", lambda k: "(%.2f, [%.6f, %.6f, %.6f], [%.6f, %.6f, %.6f])" % (t[k], *force[k], *rate[k]), ""),
        "numpy.txt": ("", lambda k: f"[ {numbers(k, '%.6f', '  ')}]", ""),
        "array.h": ("const float imu[][7] = {\n", lambda k: f"{{{numbers(k, '%.6ff')}}},", "};\n"),
        "matrix.m": ("imu = [\n", lambda k: f"   {numbers(k, '%.7e', '   ')};", "];\n"),
        "sentences.txt": ("", lambda k: sentence("IMU," + numbers(k, "%.6f", ",")), ""),
        "samples.xml": ('<?xml version="1.0"?>\n<log>\n', lambda k: '<sample t="%.2f" ax="%.6f" ay="%.6f" az="%.6f" gx="%.6f" gy="%.6f" gz="%.6f"/>' % (t[k], *force[k], *rate[k]),
                        "</log>\n"),
        "influx.txt": ("", lambda k: "imu,host=pi ax=%.6f,ay=%.6f,az=%.6f,gx=%.6f,gy=%.6f,gz=%.6f %d" % (*force[k], *rate[k], 1600000000000000000 + round(t[k] * 1e9)), ""),
        "greek.csv": ("t,a_x,a_y,a_z,ω_x,ω_y,ω_z\n", lambda k: numbers(k, "%.6f", ","), ""),
        "fields.txt": ("#Fields: t ax ay az gx gy gz\n", lambda k: numbers(k, "%.6f", " "), ""),
    }
    for name, (head, row, foot) in forms.items():
        lines(folder / name, row, n, head, foot)
    still = t < 6.0
    lines(folder / "rest.txt", lambda k: f"{numbers(k % int(still.sum()), '%.6f', ' ')}".replace("%.6f" % t[k % int(still.sum())], "%.2f" % ((k + 1) / 100), 1), 12000)
    return {"g": g, "a": a, "files": list(forms)}


def labelled(folder, rng):
    """One log in the forms of eleven makers; a line that was cut; lines of two sensors, each as it came; bytes; JSON in one piece."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    mg, dps, n = force / G0, rate / DEG, len(t)
    forms = {
        "commas.txt": lambda k: "t: %.2f, ax: %.6f, ay: %.6f, az: %.6f, gx: %.5f, gy: %.5f, gz: %.5f" % (t[k], *mg[k], *dps[k]),
        "equals.log": lambda k: "I (%d) imu: ms=%d ax=%.6f ay=%.6f az=%.6f gx=%.5f gy=%.5f gz=%.5f" % (k, 1000 * t[k], *mg[k], *dps[k]),
        "letters.txt": lambda k: "Time: %.2f s | Accel X: %.6f g, Y: %.6f g, Z: %.6f g | Gyro X: %.5f dps, Y: %.5f dps, Z: %.5f dps" % (t[k], *mg[k], *dps[k]),
        "before.txt": lambda k: "%.2f -> Accelerometer: X=%.6f Y=%.6f Z=%.6f Gyroscope: X=%.5f Y=%.5f Z=%.5f" % (t[k], *mg[k], *dps[k]),
        "glued.txt": lambda k: "10:%02d:%05.2f ax=%.6fg ay=%.6fg az=%.6fg gx=%.5fdps gy=%.5fdps gz=%.5fdps" % (int(t[k]) // 60, t[k] % 60, *mg[k], *dps[k]),
        "three.txt": lambda k: "Time:\t%d ms\tAcc:\t%.6f\t%.6f\t%.6f\tGyro:\t%.5f\t%.5f\t%.5f" % (1000 * t[k], *mg[k], *dps[k]),
        "words.txt": lambda k: "time %.2f acc %.6f %.6f %.6f gyr %.5f %.5f %.5f" % (t[k], *mg[k], *dps[k]),
        "rows.jsonl": lambda k: json.dumps({"t": round(t[k], 2), "temp": None, "acc": [round(x, 6) for x in mg[k]], "gyr": [round(x, 5) for x in dps[k]], "ok": True}),
        "objects.json": lambda k: json.dumps({"id": "imu0", "stamp_ms": int(1.6e12 + 1000 * t[k]), "accel": dict(zip("xyz", numpy.round(mg[k], 6))),
                                              "gyro": dict(zip("xyz", numpy.round(dps[k], 5)))}),
        "iio.txt": lambda k: " ".join(f"in_{s}_{x}_raw: {int(v)}" for s, row in (("accel", mg[k] * 16384), ("anglvel", dps[k] * 131)) for x, v in
                                      zip("xyz", numpy.round(row))) + f" timestamp: {1600000000000000000 + round(t[k] * 1e9)}",
        "sentences.txt": lambda k: sentence("VNIMU,+0.2012,+0.0987,-0.4411," + ",".join("%+09.5f" % x for x in (*force[k], *(rate[k]))) + ",+21.5,+099.1"),
    }
    for name, row in forms.items():
        lines(folder / name, row, n)
    truth = {"g": g, "a": a, "files": {name: {"iio.txt": (16384.0, 131.0), "sentences.txt": (G0, DEG)}.get(name, (1.0, 1.0)) for name in forms}}
    lines(folder / "cut.txt", lambda k: forms["commas.txt"](k)[:60 if k == 3000 else None], n)
    lines(folder / "two.txt", lambda k: "%s: x=%.6f y=%.6f z=%.6f" % ("acc" if rng.random() < 0.5 else "gyr", *mg[k]), n)
    lines(folder / "bytes.txt", lambda k: " ".join("%02X" % b for b in b"\x55\x51" + numpy.round(mg[k] * 2048).astype("<i2").tobytes() + b"\x12"), n)
    (folder / "piece.json").write_text(json.dumps([json.loads(forms["rows.jsonl"](k)) for k in range(n)]), encoding="utf-8")
    (folder / "pretty.json").write_text(json.dumps([json.loads(forms["rows.jsonl"](k)) for k in range(900)], indent=1), encoding="utf-8")
    block = forms["commas.txt"](0) + "\n"   # a card's block of zeros behind a line that ends where the program's buffer does
    text = "".join(forms["commas.txt"](k) + "\n" for k in range(n)).encode()
    size = 1 << 18
    whole = text[:text.rfind(b"\n", 0, 4 * size - len(block)) + 1]
    fill = 4 * size - len(whole)
    (folder / "card.txt").write_bytes(b"#" * (fill - 1) + b"\n" + whole + b"\0" * 9000)
    return truth


def over_lines(folder, rng):
    """A sample in several lines, or in one with words between its numbers: Adafruit's and SparkFun's examples, a sensor of nine axes, ROS's echo; lines that are missing."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    mg, dps, n = 1e3 * force / G0, rate / DEG, len(t)
    field = rng.normal(0, 0.2, (n, 3)) + [20, -5, 43]
    zeros = "[" + ", ".join(["0.0"] * 9) + "]"
    forms = {
        "rest.txt": lambda k: "Acceleration X: %.5f, Y: %.5f, Z: %.5f m/s^2\nRotation X: %.6f, Y: %.6f, Z: %.6f rad/s\nTemperature: 30.08 degC\n" % (*force[k], *rate[k]),
        "brackets.txt": lambda k: "Scaled. Acc (mg) [ %s ], Gyr (DPS) [ %s ], Mag (uT) [ %s ], Tmp (C) [  00030.08 ]" % tuple(
            ",  ".join("%s%010.4f" % ("-" if x < 0 else " ", abs(x)) for x in row) for row in (mg[k], dps[k], field[k])),
        "words.txt": lambda k: "Acceleration in g's\tX: %.6f\tY: %.6f\tZ: %.6f\tRotation in deg/sec\tX: %.5f\tY: %.5f\tZ: %.5f" % (*mg[k] / 1e3, *dps[k]),
        "nine.txt": lambda k: "Orient:\tx= %.2f |\ty= 0.00 |\tz= 0.00\nRot:\tx= %.6f |\ty= %.6f |\tz= %.6f\nMag:\tx= %.2f |\ty= %.2f |\tz= %.2f\nAccl:\tx= %.5f |\ty= %.5f |\tz= %.5f\n--" % (
            k % 360, *rate[k], *field[k], *force[k]),
        "letters.txt": lambda k: "G: %.5f, %.5f, %.5f deg/s\nA: %.6f, %.6f, %.6f g\nM: %.3f, %.3f, %.3f gauss" % (*dps[k], *mg[k] / 1e3, *field[k]),
        "bare.txt": lambda k: " %9.5f %9.5f %9.5f   o/s\n %9.6f %9.6f %9.6f   G" % (*dps[k], *mg[k] / 1e3),
        "echo.txt": lambda k: "header: \n  seq: %d\n  stamp: \n    secs: %d\n    nsecs: %9d\n  frame_id: \"imu\"\nangular_velocity: \n  x: %.8f\n  y: %.8f\n  z: %.8f\n"
            "angular_velocity_covariance: %s\nlinear_acceleration: \n  x: %.6f\n  y: %.6f\n  z: %.6f\nlinear_acceleration_covariance: %s\n---" % (
            k, 1600000000 + round(100 * t[k]) // 100, round(100 * t[k]) % 100 * 10_000_000, *rate[k], zeros, *force[k], zeros),
    }
    head = "Adafruit MPU6050 test!\nMPU6050 Found!\nAccelerometer range set to: +-8G\nFilter bandwidth set to: 5 Hz\n\n"
    for name, row in forms.items():
        lines(folder / name, row, n, head if name == "rest.txt" else "")
    text = (folder / "rest.txt").read_text(encoding="utf-8").splitlines(keepends=True)
    del text[4 * 700 + 6]   # a gyro's line: its sample is none
    (folder / "missing.txt").write_text("".join(text), encoding="utf-8")
    return {"g": g, "a": a, "files": list(forms) + ["missing.txt"], "timed": ["echo.txt"], "raw": ["bare.txt"], "no_unit": ["nine.txt", "echo.txt"]}


def registers(folder, rng):
    """Registers as InvenSense's chips have them: accelerometers, temperature, gyros; no names, or those of a sketch's variables; by hand and at rest."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    mg, dps = a.read(f, 100.0, rng) / G0, g.read(w, 100.0, rng) / DEG
    counts = numpy.round(numpy.column_stack((mg * 16384, (numpy.full(len(t), 31.0) - 36.53) * 340 + rng.normal(0, 8, len(t)), dps * 131))).astype(int)
    still = numpy.flatnonzero(t < 6.0)
    forms = {"registers": ("", "", range(7)), "sketch": ("time,AcX,AcY,AcZ,Tmp,GyX,GyY,GyZ\n", ",", range(7)),
             "behind": ("", "", (0, 1, 2, 4, 5, 6, 3)), "gyros": ("", "", (4, 5, 6, 0, 1, 2, 3))}
    for name, (head, mark, order) in forms.items():
        for rest, rows in (("", range(len(t))), ("_rest", still[numpy.arange(9000) % len(still)])):
            with open(folder / f"{name}{rest}.txt", "w", encoding="utf-8") as out:
                out.write(head)
                for k, row in enumerate(rows):
                    out.write((mark or "\t").join(str(v) for v in (10 * k, *counts[row, list(order)])) + "\n")
    level = 16384 * a.read(f, 100.0, numpy.random.default_rng(1))[still].mean(axis=0) / G0
    return {"g": g, "a": a, "files": list(forms), "level": level}
