"""Sensors as their data sheets describe them, on benches, tables and in hands. Shares no code with the product.

n = north, west, up; a reading is matrix @ truth + bias + white noise + noise of a bias that wanders about zero, clipped, in whole quanta.
"""
import dataclasses

import numpy

G0, DEG = 9.80665, numpy.pi / 180
LATITUDE_DEG, HEIGHT_M = 48.3, 480.0
_s2 = numpy.sin(LATITUDE_DEG * DEG) ** 2
GRAVITY = 9.7803253359 * (1 + 0.00193185265241 * _s2) / numpy.sqrt(1 - 0.00669437999013 * _s2) - 3.0856e-6 * HEIGHT_M
EARTH = 7.292115e-5 * numpy.array([numpy.cos(LATITUDE_DEG * DEG), 0.0, numpy.sin(LATITUDE_DEG * DEG)])


def turn(axis, angle):
    axis = numpy.asarray(axis, float) / numpy.linalg.norm(axis)
    k = numpy.array([[0, -axis[2], axis[1]], [axis[2], 0, -axis[0]], [-axis[1], axis[0], 0]])
    return numpy.eye(3) + numpy.sin(angle) * k + (1 - numpy.cos(angle)) * k @ k


UP = {"+z": numpy.eye(3), "-z": turn([1, 0, 0], numpy.pi), "+x": turn([0, 1, 0], -numpy.pi / 2),
      "-x": turn([0, 1, 0], numpy.pi / 2), "+y": turn([1, 0, 0], numpy.pi / 2), "-y": turn([1, 0, 0], -numpy.pi / 2)}


def rotation_between(a, b):
    """Axis and angle of a^T b, in the axes of a."""
    r = a.T @ b
    angle = numpy.arccos(numpy.clip((numpy.trace(r) - 1) / 2, -1, 1))
    v = numpy.array([r[2, 1] - r[1, 2], r[0, 2] - r[2, 0], r[1, 0] - r[0, 1]])
    if angle > 1e-9 and numpy.linalg.norm(v) < 1e-6:   # half a turn
        values, vectors = numpy.linalg.eigh(r)
        return vectors[:, numpy.argmax(values)], angle
    return (v / numpy.linalg.norm(v), angle) if angle > 1e-9 else (numpy.array([0, 0, 1.0]), 0.0)


def moved(rate, stops, rng, tremor=0.0):
    """Time, specific force, rate of turn; stops: attitude, seconds of rest, seconds to the next. Tremor of a hand while it turns."""
    attitude, omega, moving = [], [], []
    for k, (c, rest, move) in enumerate(stops):
        n = round(rest * rate)
        attitude.append(numpy.repeat(c[None], n, 0))
        omega.append(numpy.zeros((n, 3)))
        moving.append(numpy.zeros(n))
        if k + 1 < len(stops):
            axis, angle = rotation_between(c, stops[k + 1][0])
            m = round(move * rate)
            s = (numpy.arange(m) + 0.5) / m
            attitude.append(numpy.array([c @ turn(axis, angle * p) for p in 10 * s**3 - 15 * s**4 + 6 * s**5]))
            omega.append(axis * (angle / m * rate * (30 * s**2 - 60 * s**3 + 30 * s**4))[:, None])   # whole samples: as far as the attitudes
            moving.append(numpy.ones(m))
    c_bn = numpy.concatenate(attitude).transpose(0, 2, 1)
    omega, moving = numpy.concatenate(omega), numpy.concatenate(moving)
    force = c_bn @ numpy.array([0, 0, GRAVITY])
    shake = rng.normal(0, 1, force.shape)
    kernel = numpy.hanning(max(3, int(rate / 10)))
    for axis in range(3):
        shake[:, axis] = numpy.convolve(shake[:, axis], kernel / numpy.linalg.norm(kernel), "same")
    force = force + tremor * shake * moving[:, None]
    omega = omega + 0.1 * tremor * shake[:, ::-1] * moving[:, None]
    return (numpy.arange(len(force)) + 1) / rate, force, omega + c_bn @ EARTH


def wander(rng, n, rate, sigma):
    """First-order processes a decade apart: a flat Allan deviation; its mean over the log is the bias's."""
    out = numpy.zeros((n, 3))
    for tau in (3.0, 30.0, 300.0):
        step = max(1, int(tau * rate / 30))
        m = n // step + 2
        keep = numpy.exp(-step / (rate * tau))
        x = numpy.zeros((m, 3))
        x[0] = rng.normal(0, sigma, 3)
        drive = rng.normal(0, sigma * numpy.sqrt(1 - keep * keep), (m, 3))
        for k in range(1, m):
            x[k] = keep * x[k - 1] + drive[k]
        for axis in range(3):
            out[:, axis] += numpy.interp(numpy.arange(n), numpy.arange(m) * step, x[:, axis])
    return out - out.mean(0)


@dataclasses.dataclass
class Triad:
    asd: float              # rad/s or m/s^2 per sqrt(Hz)
    instability: float
    bias: numpy.ndarray
    matrix: numpy.ndarray
    quantum: float = 0.0
    limit: float = numpy.inf

    def read(self, truth, rate, rng, extra=0.0):
        y = truth @ self.matrix.T + self.bias + extra + rng.normal(0, self.asd * numpy.sqrt(rate), truth.shape)
        y = numpy.clip(y + wander(rng, len(y), rate, self.instability), -self.limit, self.limit)
        return numpy.round(y / self.quantum) * self.quantum if self.quantum else y


def triad(rng, asd, instability, bias, scale, cross, quantum=0.0, limit=numpy.inf):
    matrix = numpy.eye(3) + rng.normal(0, cross, (3, 3))
    matrix[range(3), range(3)] = 1 + rng.normal(0, scale, 3)
    return Triad(asd, instability, rng.normal(0, bias, 3), matrix, quantum, limit)


def consumer(rng):      # ICM-20948, LSM6DSO
    return (triad(rng, 0.0045 * DEG, 0.002 * DEG, 0.4 * DEG, 0.006, 0.006, DEG / 16.4, 2000 * DEG),
            triad(rng, 90e-6 * G0, 30e-6 * G0, 0.03 * G0, 0.008, 0.006, G0 / 8192, 4 * G0))


def industrial(rng):    # ADIS16470, MTi, VN-100
    return (triad(rng, 0.004 * DEG, 8 / 3600 * DEG, 0.08 * DEG, 1e-3, 8e-4, 1e-4 * DEG, 450 * DEG),
            triad(rng, 50e-6 * G0, 13e-6 * G0, 0.003 * G0, 1e-3, 8e-4, 1e-5 * G0))


def tactical(rng):      # STIM300
    return (triad(rng, 0.15 / 60 * DEG, 0.3 / 3600 * DEG, 10 / 3600 * DEG, 3e-4, 3e-4),
            triad(rng, 0.04 / 60, 15e-6 * G0, 1.5e-3 * G0, 3e-4, 3e-4))


def fibre(rng):         # fibre gyros, quartz accelerometers
    return (triad(rng, 0.012 / 60 * DEG, 0.02 / 3600 * DEG, 0.5 / 3600 * DEG, 1e-4, 1e-4),
            triad(rng, 40e-6 * G0, 5e-6 * G0, 5e-4 * G0, 2e-4, 2e-4))
