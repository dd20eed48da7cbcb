"""Files of recordings in dialects drawn at random, with the truth about each. Shares no code with the importer.

The instrument: gimbal C_vb = Rz(outer) Ry(inner), level base, perfect but for biases, scale errors and noise; the truth is
increments along b, read-outs, time and site. A dialect is a way to write it down.
"""
import dataclasses
import datetime

import numpy

OMEGA, G0 = 7.292115e-5, 9.80665
SITE = {"latitude_deg": 48.3, "longitude_deg": 11.6, "height_m": 480.0}
# outer, inner of each position, degrees: every axis is turned about both ways
POSITIONS = [(0, 0), (90, 0), (180, 0), (270, 0), (180, 0), (90, 0), (0, 0), (0, 90), (90, 90), (180, 90), (270, 90),
             (180, 90), (90, 90), (90, 180), (90, 270), (90, 180), (90, 90), (90, 0), (0, 0)]
RATES = {"rad/s": 1.0, "deg/s": numpy.pi / 180, "deg/h": numpy.pi / 648000, "mrad/s": 1e-3}
ANGLES = {"rad": 1.0, "deg": numpy.pi / 180, "arcsec": numpy.pi / 648000}
FORCES = {"m/s^2": 1.0, "g": G0, "mg": 1e-3 * G0, "ug": 1e-6 * G0}
VELOCITIES = {"m/s": 1.0, "g*s": G0, "mm/s": 1e-3}
TIMES = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9}


def turn(axis, angle):
    c, s = numpy.cos(angle), numpy.sin(angle)
    m = numpy.zeros(angle.shape + (3, 3))
    i, j = (axis + 1) % 3, (axis + 2) % 3
    m[..., axis, axis] = 1.0
    m[..., i, i], m[..., j, j], m[..., i, j], m[..., j, i] = c, c, -s, s
    return m


def truth(rng, rate, dwell=4.0, move=2.5):
    """Increments, read-outs and time on the schedule, by mid-interval values."""
    knots_t, knots = [0.0], [POSITIONS[0]]
    for k, position in enumerate(POSITIONS):
        if k:
            knots_t.append(knots_t[-1] + move)
            knots.append(position)
        knots_t.append(knots_t[-1] + dwell)
        knots.append(position)
    n = int(knots_t[-1] * rate)
    end = (numpy.arange(n) + 1) / rate

    def angle(t, which):
        # cosine ramp from knot to knot
        values = numpy.array([k[which] for k in knots], float)
        at = numpy.clip(numpy.searchsorted(knots_t, t, side="right") - 1, 0, len(knots) - 2)
        part = (t - numpy.array(knots_t)[at]) / numpy.diff(knots_t)[at]
        return numpy.radians(values[at] + (values[at + 1] - values[at]) * 0.5 * (1 - numpy.cos(numpy.pi * numpy.clip(part, 0, 1))))
    outer, inner = angle(end, 0), angle(end, 1)
    middle = end - 0.5 / rate
    o, i = angle(middle, 0), angle(middle, 1)
    C_nb = turn(2, o) @ turn(1, i)
    heading = rng.uniform(0, 2 * numpy.pi)
    C_nv = turn(1, numpy.array([-heading]))[0]
    C_nb = C_nv @ C_nb
    latitude = numpy.radians(SITE["latitude_deg"])
    earth = OMEGA * numpy.array([numpy.cos(latitude), numpy.sin(latitude), 0.0])   # north, up, east
    d_outer = outer - angle(end - 1 / rate, 0)
    d_inner = inner - angle(end - 1 / rate, 1)
    theta = numpy.einsum("nji,j->ni", C_nb, earth) / rate
    theta[:, 1] += d_inner
    theta += d_outer[:, None] * turn(1, i).transpose(0, 2, 1)[:, :, 2]
    up = numpy.array([0.0, 9.8084, 0.0])
    velocity = numpy.einsum("nji,j->ni", C_nb, up) / rate
    # a good instrument, or a cheap one whose gyros do not see the Earth
    good = rng.random() < 0.7
    gyro_bias, gyro_noise = (5e-8, 2e-6) if good else (3e-3, 2e-3)
    accel_bias, accel_noise = (1e-3, 1e-3) if good else (5e-2, 3e-2)
    theta = theta * (1 + rng.normal(0, 1e-4 if good else 8e-3, 3)) + rng.normal(0, gyro_bias, 3) / rate
    velocity = velocity * (1 + rng.normal(0, 1e-4 if good else 5e-3, 3)) + rng.normal(0, accel_bias, 3) / rate
    theta += rng.normal(0, gyro_noise, theta.shape) * numpy.sqrt(rate) / rate * 0.1
    velocity += rng.normal(0, accel_noise, velocity.shape) * numpy.sqrt(rate) / rate * 0.1
    temperature = 24.0 + 9.0 * (1 - numpy.exp(-end / 90.0)) + rng.normal(0, 0.02, n)
    return {"end": end, "theta": theta, "velocity": velocity, "outer": outer, "inner": inner, "temperature": temperature,
            "rate": rate}


@dataclasses.dataclass
class Dialect:
    separator: str
    decimal: str
    header: str            # names, units in names, units line, comment, none
    comment: str
    bom: bool
    crlf: bool
    rate: float
    time: str              # unit, "date", "none", "index"
    origin: float
    gyro_kind: str
    gyro_unit: str
    accel_kind: str
    accel_unit: str
    gyro_axes: numpy.ndarray   # file = axes @ b
    accel_axes: numpy.ndarray
    gimbal_unit: str
    gimbal_signs: tuple
    gimbal_order: tuple    # names of the columns in their order
    temperature: str       # C, K, F, none
    strangers: list        # columns of no use here
    jitter: float          # of the times, in parts of the interval
    order: list            # of the groups
    know_site: bool


def signed_permutation(rng, plain):
    if rng.random() < plain:
        return numpy.eye(3)
    return numpy.eye(3)[rng.permutation(3)] * rng.choice([-1.0, 1.0], 3)[:, None]


def draw(rng):
    separator, decimal = [(",", "."), (";", "."), (";", ","), ("\t", "."), ("\t", ","), (" ", "."), (" ", ",")][rng.integers(7)]
    gyro_kind, accel_kind = [("rates", "rates"), ("rates", "rates"), ("increments", "increments"), ("rates", "increments"),
                             ("increments", "rates")][rng.integers(5)]
    strangers = [s for s in ("magnetometer", "counter", "status", "height", "word") if rng.random() < 0.15]
    order = ["gyro", "accel", "gimbal", "temperature", *strangers]
    rng.shuffle(order)
    gyro_axes = signed_permutation(rng, 0.4)
    return Dialect(
        separator=separator, decimal=decimal,
        header=str(rng.choice(["names", "units in names", "units line", "comment", "none"])),
        comment=str(rng.choice(["", "#", "%"])), bom=bool(rng.random() < 0.2), crlf=bool(rng.random() < 0.3),
        rate=float(rng.choice([10.0, 50.0, 64.0, 100.0, 125.0, 200.0, 400.0])),
        time=str(rng.choice(["s", "ms", "us", "ns", "date", "none"])), origin=float(rng.choice([0.0, 0.0, 254500.0])),
        gyro_kind=gyro_kind, gyro_unit=str(rng.choice(list(RATES if gyro_kind == "rates" else ANGLES))),
        accel_kind=accel_kind, accel_unit=str(rng.choice(list(FORCES if accel_kind == "rates" else VELOCITIES))),
        gyro_axes=gyro_axes, accel_axes=gyro_axes if rng.random() < 0.6 else signed_permutation(rng, 0.3),
        gimbal_unit=str(rng.choice(["deg", "rad"])), gimbal_signs=tuple(rng.choice([-1.0, 1.0], 2)),
        gimbal_order=("outer", "inner") if rng.random() < 0.6 else ("inner", "outer"),
        temperature=str(rng.choice(["C", "K", "F", "none"])), strangers=strangers, jitter=float(rng.choice([0.0, 0.0, 0.03])),
        order=order, know_site=bool(rng.random() < 0.6))


NAMES = {
    "gyro": {"rates": [["gx", "gy", "gz"], ["gyro_x", "gyro_y", "gyro_z"], ["wx", "wy", "wz"], ["AngularRateX", "AngularRateY", "AngularRateZ"],
                       ["angular_velocity.x", "angular_velocity.y", "angular_velocity.z"], ["Gyr_X", "Gyr_Y", "Gyr_Z"]],
             "increments": [["dtheta_x", "dtheta_y", "dtheta_z"], ["delta_angle_x", "delta_angle_y", "delta_angle_z"]]},
    "accel": {"rates": [["ax", "ay", "az"], ["acc_x", "acc_y", "acc_z"], ["AccX", "AccY", "AccZ"], ["fx", "fy", "fz"],
                        ["linear_acceleration.x", "linear_acceleration.y", "linear_acceleration.z"], ["Acc_X", "Acc_Y", "Acc_Z"]],
              "increments": [["dv_x", "dv_y", "dv_z"], ["delta_vel_x", "delta_vel_y", "delta_vel_z"]]},
}


def columns(rng, d, t):
    """(names, units, values as text) in the dialect's order; a unit is told only where the header has units."""
    def text(values, digits):
        return [f"%.{digits}g" % v for v in values]
    groups = {}
    for group, kind, unit, axes, raw in (("gyro", d.gyro_kind, d.gyro_unit, d.gyro_axes, t["theta"]),
                                         ("accel", d.accel_kind, d.accel_unit, d.accel_axes, t["velocity"])):
        table = {"gyro": {**RATES, **ANGLES}, "accel": {**FORCES, **VELOCITIES}}[group]
        values = raw @ axes.T * (d.rate if kind == "rates" else 1.0) / table[unit]
        names = NAMES[group][kind][rng.integers(len(NAMES[group][kind]))]
        groups[group] = [(names[k], unit, text(values[:, k], 12)) for k in range(3)]
    read_outs = {"outer": t["outer"] * d.gimbal_signs[0], "inner": t["inner"] * d.gimbal_signs[1]}
    gimbal_names = [{"outer": "outer", "inner": "inner"}, dict(zip(d.gimbal_order, ("axis1", "axis2"))),
                    {"outer": "Kippwinkel", "inner": "Drehwinkel"}, {"outer": "pitch", "inner": "azimuth"}][rng.integers(4)]
    groups["gimbal"] = [(gimbal_names[w], d.gimbal_unit, text(read_outs[w] / ANGLES[d.gimbal_unit], 10)) for w in d.gimbal_order]
    c = t["temperature"]
    if d.temperature != "none":
        value = {"C": c, "K": c + 273.15, "F": c * 1.8 + 32}[d.temperature]
        groups["temperature"] = [("temp", d.temperature, text(value, 6))]
    n = len(t["end"])
    field = numpy.einsum("nji,j->ni", turn(2, t["outer"]) @ turn(1, t["inner"]), [18.0, -43.0, 5.0]) + rng.normal(0, 0.3, (n, 3))
    groups["magnetometer"] = [(f"m{a}", "", text(field[:, k], 5)) for k, a in enumerate("xyz")]
    groups["counter"] = [("packet", "", [str(k % 256) for k in range(n)])]
    groups["word"] = [("unit", "", ["IMU-1"] * n)]
    groups["status"] = [("status", "", ["0"] * n)]
    groups["height"] = [("baro_height", "", text(480 + numpy.cumsum(rng.normal(0, 0.01, n)), 6))]
    result = []
    if d.time == "date":
        start = datetime.datetime(2024, 5, 17, 9, 30)
        stamp = [(start + datetime.timedelta(microseconds=round(e * 1e6))).isoformat(timespec="microseconds") + "Z" for e in t["end"]]
        result.append(("utc", "", stamp))
    elif d.time != "none":
        stamp = t["end"] + d.jitter / d.rate * rng.normal(0, 1, len(t["end"])).clip(-3, 3)
        exact = numpy.round((stamp + d.origin) / TIMES[d.time], 7 if d.time == "s" else 3)
        result.append(("time", d.time, [repr(float(v)) if d.time == "s" else f"{v:.3f}".rstrip("0").rstrip(".") for v in exact]))
    for group in d.order:
        result += groups.get(group, [])
    return result


def write(path, rng, d, t):
    all_columns = columns(rng, d, t)
    end = "\r\n" if d.crlf else "\n"
    lines = []
    mark = d.comment
    if mark and d.header != "none":
        lines.append(f"{mark} recorded with firmware 2.3")
    names, units = [c[0] for c in all_columns], [c[1] or "-" for c in all_columns]
    if d.header == "names":
        lines.append(d.separator.join(names))
    elif d.header == "units in names":
        lines.append(d.separator.join(n if u == "-" else f"{n}[{u}]" for n, u in zip(names, units)))
    elif d.header == "units line":
        lines += [d.separator.join(names), d.separator.join(units)]
    elif d.header == "comment":
        lines.append((mark or "#") + " " + d.separator.join(names))
    for row in zip(*(c[2] for c in all_columns)):
        cells = [cell if cell.endswith("Z") else cell.replace(".", d.decimal) for cell in row]
        lines.append(d.separator.join(cells))
    data = ("\ufeff" if d.bom else "") + end.join(lines) + end
    path.write_bytes(data.encode("utf-8"))
    return {"units told": d.header in ("units in names", "units line"), "columns": [c[0] for c in all_columns]}
