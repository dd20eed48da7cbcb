"""The motion of a parked vehicle, as its laser gyros and accelerometers recorded it, under a gimbal that turns.

Kept physical: what gyros and accelerometers feel is one motion of one body. Rates and forces are those of the level vehicle; the
gimbal turns them into the sensors as the schedule goes. Gravity follows the angle that the gyros integrate to, where pieces meet too,
and the Earth's rate of the simulated site follows it. A piece is altered only as a motion can be: turned about the vertical by any
heading, mirrored (forces as a mirror shows them, rates with the other sign), run backwards (rates with the other sign, forces not).
The vehicle settles: its tilt as the accelerometers show it says what the gyros' mean rate holds besides, so that the turning of
the base is no drift of a sensor. About the vertical nothing says that, and the mean rate is taken out.

What the force wanders by more slowly than 20 s, and no turning of gravity explains, is the accelerometers': it stays with them as the
gimbal turns, forwards or backwards, every axis with its own sign.

Lost: the sensors' faster noise, their quanta included, turns with the vehicle, not with the sensor that makes it. What the gyros' noise
is wrong by after 20 s and more stands in the accelerometers' wander, and the gyros take it for the base's.
Shared with the product: nothing.
"""
import math

import numpy

GRAVITY = 9.80665
EARTH_RATE = 7.292115e-5  # rad/s
UP = numpy.array((0.0, 1.0, 0.0))  # x forward, y up, z right
RATE_HZ = 100.0
MIRROR = numpy.array((-1.0, -1.0, 1.0, 1.0, 1.0, -1.0))  # at the plane of x and y: rates are axial, forces polar
REVERSED = numpy.array((-1.0, -1.0, -1.0, 1.0, 1.0, 1.0))


def turning(angle):
    """About up, of a rate and a force side by side: rows times this."""
    c, s = math.cos(angle), math.sin(angle)
    one = numpy.array(((c, 0.0, s), (0.0, 1.0, 0.0), (-s, 0.0, c)))
    both = numpy.zeros((6, 6))
    both[:3, :3] = both[3:, 3:] = one.T
    return both


def rotation_vector(rates):
    """Of a body that starts at zero and turns by little: to second order of the angle."""
    angle = numpy.cumsum(rates, axis=0) / RATE_HZ
    return angle + numpy.cumsum(numpy.cross(angle, rates), axis=0) / (2.0 * RATE_HZ)


def change_of(vector, phi):
    """How a vector that stands still changes in a body that has turned by phi, to second order."""
    first = numpy.cross(phi, vector)
    return -first + 0.5 * numpy.cross(phi, first)


def shaken_seconds(rates):
    """Whether the vehicle turns to and fro by ten times as much as usual, in this second or beside it: people get in or out."""
    rate = int(RATE_HZ)
    whole = len(rates) // rate * rate
    scatter = rates[:whole].reshape(-1, rate, 3).std(axis=1)
    return numpy.convolve((scatter > 10.0 * numpy.median(scatter, axis=0)).any(axis=1), numpy.ones(3), "same") > 0.5


def smoothed(series, shaken):
    """What the series follows over 20 s and more, by the means of its integral over the seconds that are not shaken. Across a stretch that
    is, the integral may step: while the vehicle tilts by 1 to 3 mrad within a second 0.6 mm/s came that no turning of gravity explains,
    half a count, and spread over 20 s that would be 6 ug of a sensor that wanders so at no other time.
    Noise of a second's mean is 0.1 mm/s; the curvature is held so that half of a wave of 40 s is kept."""
    rate, noise, step, kept = int(RATE_HZ), 0.1e-3, 0.6e-3, 40.0 / (2.0 * math.pi)
    n = len(shaken)
    second = (numpy.cumsum(series, axis=0)[:n * rate] / RATE_HZ).reshape(n, rate, -1).mean(axis=1)
    starts = numpy.flatnonzero(shaken & ~numpy.roll(shaken, 1) & (numpy.arange(n) > 0))
    design = numpy.hstack((numpy.eye(n), (numpy.arange(n)[:, None] >= starts).astype(float)))
    curvature = numpy.diff(numpy.eye(n), 2, axis=0)
    normal = design.T @ (~shaken[:, None] * design)
    normal[:n, :n] += kept**4 * curvature.T @ curvature
    normal[range(n, n + len(starts)), range(n, n + len(starts))] += (noise / step)**2
    integral = numpy.linalg.solve(normal, design.T @ (~shaken[:, None] * second))[:n]
    middle = (numpy.arange(n - 1) + 1) * rate
    return numpy.column_stack([numpy.interp(numpy.arange(len(series)), middle, column) for column in numpy.diff(integral, axis=0).T])


def levelled(rates):
    """In axes whose y is up when the record begins: the mean of the forces as the gyros carry them back there. Along the mean force itself,
    1.5 mrad away, the vertical would be wrong by up to 7 ug whenever the vehicle tilts."""
    phi = rotation_vector(rates[:, :3] - rates[:, :3].mean(axis=0))
    up = (rates[:, 3:] + change_of(rates[:, 3:], -phi)).mean(axis=0)
    up /= numpy.linalg.norm(up)
    axis = numpy.cross(up, UP)
    sine, cosine = numpy.linalg.norm(axis), up @ UP
    k = numpy.cross(numpy.eye(3), axis / sine)  # this times a vector: axis x vector
    turn = numpy.eye(3) + sine * k + (1.0 - cosine) * (k @ k)
    return numpy.hstack((rates[:, :3] @ turn.T, rates[:, 3:] @ turn.T))


def step_at(second, k, around):
    """[axes]: by how much the velocity goes up between seconds k - 1 and k: two lines of one slope, `around` seconds before and behind."""
    t = numpy.arange(-around, around) + 0.5
    design = numpy.column_stack((numpy.ones(2 * around), t, t > 0.0))
    return numpy.linalg.lstsq(design, second[k - around:k + around], rcond=None)[0][2]


def velocity_steps(force):
    """[seconds x axes] The integral's steps, one by one, the largest first, each less those before it. The noise of a second's mean velocity
    is 0.1 mm/s: half a count is ten times what that makes of a step."""
    around, least, rate = 12, 0.6e-3, int(RATE_HZ)
    whole = len(force) // rate * rate
    second = (numpy.cumsum(force, axis=0)[:whole] / RATE_HZ).reshape(-1, rate, force.shape[1]).mean(axis=1)
    steps = numpy.zeros_like(second)
    size = numpy.zeros_like(second)
    changed = range(around, len(second) - around)
    while True:
        for k in changed:
            size[k] = step_at(second, k, around)
        k, axis = numpy.unravel_index(numpy.argmax(abs(size)), size.shape)
        if abs(size[k, axis]) < least:
            return steps
        steps[k, axis] += size[k, axis]
        second[k:, axis] -= size[k, axis]
        changed = range(max(around, k - around), min(len(second) - around, k + around + 1))


def motion_of(rates):
    """Of the level vehicle, from what its sensors read: its rates against the Earth, the forces that shake it, less gravity as the
    rates turn it, and what the accelerometers wander by."""
    rates = levelled(rates)
    force = rates[:, 3:] - rates[:, 3:].mean(axis=0)
    earth = rates[:, :3].mean(axis=0)
    second = int(RATE_HZ)
    whole = len(rates) // second * second
    own = rates[:, :3] - earth
    for _ in range(4):
        phi = rotation_vector(own)
        left = force - GRAVITY * change_of(UP, phi)
        # Tilt that the gyros' mean rate makes and the accelerometers do not see: not the base's. f_x = g phi_z, f_z = -g phi_x.
        seconds = left[:whole].reshape(-1, second, 3).mean(axis=1)
        slope = numpy.polyfit(numpy.arange(len(seconds)), seconds, 1)[0] / GRAVITY
        earth = earth - numpy.array((-slope[2], 0.0, slope[0]))
        own = rates[:, :3] - earth - change_of(earth, phi)
    left = force - GRAVITY * change_of(UP, rotation_vector(own))
    # No vehicle is pushed one way for long: 5 ug over 20 s are a centimetre. What the force wanders by more slowly is the accelerometers',
    # and what they drift by in half an hour is no noise: a cubic, as of the LN-100.
    steps, phi = velocity_steps(left), rotation_vector(own)
    slow = left.copy()
    slow[:len(steps) * second:second] -= steps * RATE_HZ
    smooth, shaken = int(20 * RATE_HZ), shaken_seconds(own)
    wander, turned = (smoothed(v, shaken) for v in (slow, phi))
    # Gravity's size there, scale factors and axes are another 0.2 % than the mere turning has it: 9 ug of 4.5 mrad of tilt.
    inside = slice(2 * smooth, -2 * smooth)
    cubic = numpy.polynomial.polynomial.polyvander(numpy.linspace(-1.0, 1.0, len(wander)), 3)[inside]
    fit = numpy.linalg.lstsq(numpy.hstack((cubic, turned[inside])), wander[inside], rcond=None)[0]
    wander -= turned @ fit[4:]
    left -= wander + phi @ fit[4:]
    return own, left, wander[inside] - cubic @ fit[:4]


class Piece:
    """Of a recording: its slow rates, and the noise of their integral about its mean over a second."""

    def __init__(self, slow, noise):
        self.slow, self.noise = slow, noise

    @staticmethod
    def of(rates, rate_hz):
        window = int(rate_hz) | 1
        integral = numpy.cumsum(rates, axis=0) / rate_hz
        mean = numpy.column_stack([numpy.convolve(column, numpy.ones(window) / window, "same") for column in integral.T])
        inside = slice(window, len(rates) - window)
        return Piece(numpy.diff(mean, axis=0)[inside] * rate_hz, (integral - mean)[1:][inside])


def seamless(pieces, rate_hz):
    """Rates: what white noise of an integral does where two pieces meet is the difference of its values on both sides, no step."""
    noise = numpy.concatenate([p.noise for p in pieces])
    return numpy.concatenate([p.slow for p in pieces]) + numpy.diff(noise, axis=0, prepend=noise[:1]) * rate_hz


def altered(piece, random):
    alter = turning(random.uniform(0.0, 2.0 * math.pi))
    if random.random() < 0.5:
        alter = numpy.diag(MIRROR) @ alter
    slow, noise = piece.slow, piece.noise
    if random.random() < 0.5:
        slow, noise = REVERSED * slow[::-1], -REVERSED * noise[::-1]
    return Piece(slow @ alter, noise @ alter)


class ParkedVehicle:
    """Draws of its motion. `rates`: rows of rate and force as its sensors read them, forward, up, right."""

    rate_hz = RATE_HZ

    def __init__(self, rates, latitude_deg, pieces=3):
        self.earth = EARTH_RATE * numpy.array((math.cos(math.radians(latitude_deg)), math.sin(math.radians(latitude_deg)), 0.0))
        own, shaken, self.wander = motion_of(rates)
        motion = numpy.hstack((own, shaken))
        length = len(motion) // pieces
        self.pieces = [Piece.of(motion[k * length:(k + 1) * length], RATE_HZ) for k in range(pieces)]
        self.seconds = min(sum(len(p.slow) for p in self.pieces), len(self.wander)) / RATE_HZ

    def drawn(self, random):
        """Rows of what rate and force change by in the vehicle that is level at first, heading north, and of the accelerometers' wander."""
        parts = [altered(self.pieces[k], random) for k in random.permutation(len(self.pieces))]
        motion = seamless(parts, RATE_HZ)
        phi = rotation_vector(motion[:, :3])
        rate = motion[:, :3] + change_of(self.earth, phi)
        force = motion[:, 3:] + GRAVITY * change_of(UP, phi)
        wander = random.choice((-1.0, 1.0), 3) * self.wander[::random.choice((-1, 1))]
        n = min(len(rate), len(wander))
        return numpy.hstack((rate[:n], force[:n], wander[:n]))

    @staticmethod
    def in_sensors(drawn, outer, inner):
        """Of a gimbal with these angles at the end of each sample: C_bv = (Rz(outer) Ry(inner))^T."""
        def of_sample(angle):
            return angle - 0.5 * numpy.diff(angle, prepend=angle[0])

        o, i = of_sample(outer)[:, None], of_sample(inner)[:, None]
        out = []
        for v in (drawn[:, :3], drawn[:, 3:6]):
            x, y, z = v[:, :1], v[:, 1:2], v[:, 2:]
            x, y = numpy.cos(o) * x + numpy.sin(o) * y, numpy.cos(o) * y - numpy.sin(o) * x
            out += [numpy.cos(i) * x - numpy.sin(i) * z, y, numpy.sin(i) * x + numpy.cos(i) * z]
        both = numpy.hstack(out)
        both[:, 3:] += drawn[:, 6:]
        return both
