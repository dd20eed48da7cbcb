"""A base at rest, a gimbal and an ideal IMU on it, in numpy: angles, specific force and rate at any time.

Frames: n north, up, east; C_nb = C_nv Rz(outer) Ry(inner), C_nv = Ry(-heading) Rz(pitch) Rx(roll).
"""
import numpy

DEG = numpy.pi / 180.0
EARTH_RATE = 7.292115e-5
HORIZONTAL = [(0, 0), (90, 0), (180, 0), (270, 0), (180, 0), (90, 0), (0, 0), (0, 90), (90, 90), (180, 90), (270, 90), (180, 90),
              (90, 90), (90, 180), (90, 270), (90, 180), (90, 90), (90, 0), (0, 0)]
TABLE_2 = HORIZONTAL[:13] + [(0, 90), (0, 180), (0, 270), (0, 180), (0, 90), (0, 0)]
DIAGONAL = [(o + 45, i + 45) for o, i in HORIZONTAL] + [(45, 135)]


def about(axis, angle):
    """[...,3,3] rotations about a coordinate axis."""
    c, s = numpy.cos(angle), numpy.sin(angle)
    R = numpy.zeros(numpy.shape(angle) + (3, 3))
    R[..., axis, axis] = 1.0
    i, j = (axis + 1) % 3, (axis + 2) % 3
    R[..., i, i], R[..., j, j] = c, c
    R[..., i, j], R[..., j, i] = -s, s
    return R


def gravity(latitude, height_m):
    """WGS-84, latitude in rad: Somigliana's formula and the free air term to second order."""
    s2 = numpy.sin(latitude) ** 2
    a, f, m = 6378137.0, 1 / 298.257223563, 0.00344978650684
    g = 9.7803253359 * (1 + 0.00193185265241 * s2) / numpy.sqrt(1 - 0.00669437999014 * s2)
    return g * (1 - 2 / a * (1 + f + m - 2 * f * s2) * height_m + 3 / a**2 * height_m**2)


def wandering(random, count):
    """Turns of 45 to 180 deg about either axis, either way, within 300 deg of zero."""
    plan = [(0.0, 0.0)]
    while len(plan) < count:
        o, i = plan[-1]
        step = float(random.choice([-180, -90, -45, 45, 60, 90, 180]))
        following = (o + step, i) if random.uniform() < 0.5 else (o, i + step)
        if max(abs(following[0]), abs(following[1])) <= 300:
            plan.append(following)
    return plan


class Motion:
    def __init__(self, random, plan, dwell_s, turn_s, attitude_deg, latitude_deg, off_deg):
        self.plan, self.dwell_s, self.turn_s, self.latitude_deg = plan, dwell_s, turn_s, latitude_deg
        self.reached = numpy.array(plan, float) + random.normal(0.0, off_deg, (len(plan), 2))  # the gimbal's accuracy
        self.way = numpy.diff(self.reached, axis=0)
        self.begins = dwell_s + numpy.arange(len(plan) - 1) * (dwell_s + turn_s)
        self.duration_s = len(plan) * dwell_s + (len(plan) - 1) * turn_s
        heading, pitch, roll = (angle * DEG for angle in attitude_deg)
        self.C_nv = about(1, -heading) @ about(2, pitch) @ about(0, roll)
        self.gravity = gravity(latitude_deg * DEG, 50.0)
        self.earth = EARTH_RATE * numpy.array([numpy.cos(latitude_deg * DEG), numpy.sin(latitude_deg * DEG), 0.0])

    def gimbal(self, t):
        """Angles and rates [n,2] in rad, the turn that is the last one to have begun (-1: none), and whether it goes on."""
        turn = numpy.searchsorted(self.begins, t, side="right") - 1
        known = numpy.maximum(turn, 0)
        x = numpy.where(turn < 0, 0.0, numpy.clip((t - self.begins[known]) / self.turn_s, 0.0, 1.0))
        going = (x > 0.0) & (x < 1.0)
        done = x - numpy.sin(2 * numpy.pi * x) / (2 * numpy.pi)
        rate = numpy.where(going, (1 - numpy.cos(2 * numpy.pi * x)) / self.turn_s, 0.0)
        start = numpy.where(turn < 0, 0, known)
        angles = self.reached[start] + self.way[known] * done[:, None]
        return angles * DEG, self.way[known] * rate[:, None] * DEG, turn, going

    def senses(self):
        """[turns + 1, 2] sense of each axis' last turn once so many turns have begun."""
        senses = numpy.zeros((len(self.way) + 1, 2))
        for k, way in enumerate(self.way):
            senses[k + 1] = numpy.where(numpy.abs(way) > 5.0, numpy.sign(way), senses[k])
        return senses

    def at(self, t):
        """Specific force [n,3] m/s^2, rate [n,3] rad/s, and what laws may depend on, by name."""
        angles, rates, turn, going = self.gimbal(t)
        inner = about(1, angles[:, 1])
        C_nb = self.C_nv @ about(2, angles[:, 0]) @ inner
        force = C_nb.transpose(0, 2, 1) @ numpy.array([0.0, self.gravity, 0.0])
        of_outer = inner.transpose(0, 2, 1) @ numpy.array([0.0, 0.0, 1.0])
        rate = C_nb.transpose(0, 2, 1) @ self.earth + of_outer * rates[:, :1] + rates[:, 1:] * numpy.array([0.0, 1.0, 0.0])
        over = numpy.where(going, turn - 1, turn)
        ended = self.begins[numpy.maximum(over, 0)] + self.turn_s
        since = numpy.where(over < 0, 1e9, t - ended)
        sense = self.senses()[turn + 1]
        known = {"outer": angles[:, 0], "inner": angles[:, 1], "wo": rates[:, 0] / DEG, "wi": rates[:, 1] / DEG, "t": t / 3600.0,
                 "since": since, "rest": numpy.where(going, 0.0, since), "so": sense[:, 0], "si": sense[:, 1],
                 "n": turn + 1.0, "going": going}
        for axis, letter in enumerate("xyz"):
            known["f" + letter] = force[:, axis] / 9.80665
            known["w" + letter] = rate[:, axis] / DEG
        return force, rate, known
