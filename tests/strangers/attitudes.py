"""A sensor that is turned and put down, with its attitude as other instruments see it. Shares no code with the product.

r = the room, x y z with z up; C_rb = Rz(a) Ry(b) Rx(c), whose rates follow by hand: no integration stands between attitude and rate.
"""
import numpy

from sensors import DEG, EARTH, GRAVITY

UP = numpy.array([0, 0, 1.0])


class Hand:
    """Angles from stop to stop, with a wave on the way; at rest in between."""

    def __init__(self, rng, stops, rest_s, move_s):
        self.rest_s, self.move_s = rest_s, move_s
        self.stop = numpy.column_stack([rng.uniform(-2.5, 2.5, stops), rng.uniform(-1.2, 1.2, stops), rng.uniform(-2.5, 2.5, stops)])
        self.wave = rng.uniform(-0.5, 0.5, (stops, 3, 2))
        self.turns = rng.uniform(1.0, 3.0, (stops, 3, 2))
        self.duration = stops * (rest_s + move_s) - move_s
        heading = rng.uniform(0, 2 * numpy.pi)
        self.earth = numpy.array([EARTH[0] * numpy.cos(heading), EARTH[0] * numpy.sin(heading), EARTH[2]])

    def angles(self, t):
        """a b c and their derivatives."""
        period = self.rest_s + self.move_s
        k = numpy.clip((t // period).astype(int), 0, len(self.stop) - 1)
        s = numpy.clip((t - k * period - self.rest_s) / self.move_s, 0, 1)[:, None]
        way = self.stop[numpy.minimum(k + 1, len(self.stop) - 1)] - self.stop[k]
        smooth, slope = 10 * s**3 - 15 * s**4 + 6 * s**5, 30 * s**2 - 60 * s**3 + 30 * s**4
        window, dwindow = 64 * s**3 * (1 - s) ** 3, 192 * s**2 * (1 - s) ** 2 * (1 - 2 * s)
        angle, rate = self.stop[k] + way * smooth, way * slope
        for j in range(2):
            phase = 2 * numpy.pi * self.turns[k, :, j] * s
            angle = angle + self.wave[k, :, j] * window * numpy.sin(phase)
            rate = rate + self.wave[k, :, j] * (dwindow * numpy.sin(phase) + window * numpy.cos(phase) * 2 * numpy.pi * self.turns[k, :, j])
        return angle, rate / self.move_s

    def c_rb(self, t):
        (a, b, c), _ = (x.T for x in self.angles(t))
        ca, sa, cb, sb, cc, sc = numpy.cos(a), numpy.sin(a), numpy.cos(b), numpy.sin(b), numpy.cos(c), numpy.sin(c)
        return numpy.array([[ca * cb, ca * sb * sc - sa * cc, ca * sb * cc + sa * sc],
                            [sa * cb, sa * sb * sc + ca * cc, sa * sb * cc - ca * sc],
                            [-sb, cb * sc, cb * cc]]).transpose(2, 0, 1)

    def rate(self, t):
        """Against inertial space, in b."""
        (_, b, c), (da, db, dc) = (x.T for x in self.angles(t))
        cb, sb, cc, sc = numpy.cos(b), numpy.sin(b), numpy.cos(c), numpy.sin(c)
        body = numpy.column_stack([dc - da * sb, db * cc + da * cb * sc, -db * sc + da * cb * cc])
        return body + numpy.einsum("nji,j->ni", self.c_rb(t), self.earth)

    def force(self, t, rng, tremor):
        """With what a hand does while it moves."""
        f = numpy.einsum("nji,j->ni", self.c_rb(t), GRAVITY * UP)
        moves = numpy.abs(self.angles(t)[1]).max(1) > 0
        return f + tremor * rng.normal(0, 1, f.shape) * moves[:, None]


def quaternions(c):
    """w x y z of matrices, by the largest of the four."""
    t = numpy.trace(c, axis1=1, axis2=2)
    squares = numpy.column_stack([1 + t, *[1 + 2 * c[:, k, k] - t for k in range(3)]]) / 4
    q = numpy.sqrt(numpy.maximum(squares, 1e-300))
    off = numpy.column_stack([c[:, 2, 1] - c[:, 1, 2], c[:, 0, 2] - c[:, 2, 0], c[:, 1, 0] - c[:, 0, 1]]) / 4
    sums = {(0, 1): (c[:, 0, 1] + c[:, 1, 0]) / 4, (0, 2): (c[:, 0, 2] + c[:, 2, 0]) / 4, (1, 2): (c[:, 1, 2] + c[:, 2, 1]) / 4}
    products = numpy.zeros((len(c), 4, 4))
    for i in range(3):
        products[:, 0, i + 1] = products[:, i + 1, 0] = off[:, i]
        for j in range(3):
            if i != j:
                products[:, i + 1, j + 1] = sums[min(i, j), max(i, j)]
    for i in range(4):
        products[:, i, i] = squares[:, i]
    k = numpy.argmax(squares, 1)
    return products[numpy.arange(len(c)), k] / q[numpy.arange(len(c)), k][:, None]


def times(p, q):
    """Of quaternions w x y z."""
    w = p[..., 0] * q[..., 0] - (p[..., 1:] * q[..., 1:]).sum(-1)
    return numpy.concatenate([w[..., None], p[..., :1] * q[..., 1:] + q[..., :1] * p[..., 1:] + numpy.cross(p[..., 1:], q[..., 1:])], -1)


def small(phi):
    angle = numpy.linalg.norm(phi, axis=-1, keepdims=True)
    return numpy.concatenate([numpy.cos(angle / 2), numpy.sinc(angle / (2 * numpy.pi)) / 2 * phi], -1)


def filtered(t, rate, force, q, kp):
    """What a filter in the device makes of its own gyros and accelerometers (after Mahony): w x y z, body to room."""
    out = numpy.zeros((len(t), 4))
    down = force / numpy.linalg.norm(force, axis=1)[:, None]
    dt = t[1] - t[0]
    q = numpy.array(q)
    for k in range(len(t)):
        w, x, y, z = q
        seen = numpy.array([2 * (x * z - w * y), 2 * (w * x + y * z), w * w - x * x - y * y + z * z])
        q = times(q, small(dt * (rate[k] + kp * numpy.cross(down[k], seen))))
        q = q / numpy.sqrt(q @ q)
        out[k] = q
    return out


def in_accelerometers_frame(g, a):
    """Matrices of gyros and accelerometers in the frame in which the latter is upper triangular."""
    j = numpy.eye(3)[::-1]
    k = j @ numpy.linalg.cholesky(j @ a @ a.T @ j) @ j
    return g @ (numpy.linalg.inv(k) @ a).T, k
