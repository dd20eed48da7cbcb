"""A recording of a still INS whose accelerometers creep after turns, written without any code of the project.

Frames: n north, up, east; C_nb = C_nv Rz(outer) Ry(inner), C_nv = Ry(-heading) Rz(pitch) Rx(roll).
"""
import pathlib
import sys

import h5py
import numpy as np

sys.path.insert(1, str(pathlib.Path(__file__).resolve().parents[1] / "second_source"))
from motion import EARTH_RATE, HORIZONTAL, about, gravity  # noqa: E402

UG = 9.80665e-6


def vectors(R):
    """Rotation vectors [n,3] of small rotations [n,3,3]."""
    w = 0.5 * np.stack([R[:, 2, 1] - R[:, 1, 2], R[:, 0, 2] - R[:, 2, 0], R[:, 1, 0] - R[:, 0, 1]], axis=1)
    s = np.linalg.norm(w, axis=1)
    return w * np.where(s > 1e-9, np.arcsin(np.minimum(s, 1.0)) / np.maximum(s, 1e-30), 1.0)[:, None]


class Gimbal:
    def __init__(self, dwell_s, turn_s):
        self.positions, self.dwell, self.turn = HORIZONTAL, dwell_s, turn_s
        self.duration = len(HORIZONTAL) * dwell_s + (len(HORIZONTAL) - 1) * turn_s

    def part(self, t):
        period = self.dwell + self.turn
        k = np.minimum((t // period).astype(int), len(self.positions) - 1)
        return k, t - k * period

    def angles(self, t):
        k, u = self.part(t)
        x = np.clip((u - self.dwell) / self.turn, 0, 1)
        done = x - np.sin(2 * np.pi * x) / (2 * np.pi)
        p = np.radians(np.array(self.positions, float))
        following = p[np.minimum(k + 1, len(p) - 1)]
        return p[k] + done[:, None] * (following - p[k])

    def since_turn(self, t):
        """Since the end of the last turn that is over; infinite before the first. And whether it turns now."""
        k, u = self.part(t)
        turning = u > self.dwell
        return np.where(k > 0, u, np.inf), turning & (k < len(self.positions) - 1)


def creep(case, gimbal, t):
    """[n,3] m/s^2: sizes of the axes times their kernels."""
    s, turning = gimbal.since_turn(t)
    s = np.maximum(s - case["delay_s"], 0.0) + np.where(s < case["delay_s"], np.inf, 0.0)
    df = np.zeros((len(t), 3))
    for axis in range(3):
        kernel = np.exp(-np.power(s / case["tau_s"][axis], case["stretch"]))
        if case["off_in_turns"]:
            kernel = np.where(turning, 0.0, kernel)
        df[:, axis] = case["size_ug"][axis] * UG * kernel
    return df


def write(case, path):
    """`case`: seed, size_ug, tau_s (each of three axes), stretch, delay_s, off_in_turns. Returns the 24 that are true, SI."""
    rng = np.random.default_rng(case["seed"])
    rate, latitude, height = 50.0, np.radians(rng.uniform(-55, 55)), 100.0
    roll, pitch, heading = np.radians([rng.uniform(-3, 3), rng.uniform(-3, 3), rng.uniform(0, 360)])
    gimbal = Gimbal(round(rng.uniform(55, 80)), 7.0)
    n, dt = int(gimbal.duration * rate), 1.0 / rate
    edges = np.arange(n + 1) * dt
    one = np.ones(1)
    C_nv = (about(1, -heading * one) @ about(2, pitch * one) @ about(0, roll * one))[0]

    def attitude(t):
        a = gimbal.angles(t)
        return C_nv @ about(2, a[:, 0]) @ about(1, a[:, 1])

    C, C_middle = attitude(edges), attitude(edges[:-1] + 0.5 * dt)
    turn_of_n = np.array([np.cos(latitude), np.sin(latitude), 0.0]) * EARTH_RATE * dt
    skew = np.array([[0, -turn_of_n[2], turn_of_n[1]], [turn_of_n[2], 0, -turn_of_n[0]], [-turn_of_n[1], turn_of_n[0], 0]])
    theta = vectors(np.swapaxes(C[:-1], 1, 2) @ (np.eye(3) + skew + 0.5 * skew @ skew) @ C[1:])
    f_n = np.array([0.0, gravity(latitude, height), 0.0])
    f = [np.swapaxes(R, 1, 2) @ f_n for R in (C[:-1], C_middle, C[1:])]
    mean_f = (f[0] + 4 * f[1] + f[2]) / 6

    bias = rng.normal(0, 200, 3) * UG
    drift = np.radians(rng.normal(0, 0.05, 3)) / 3600
    scale_f, scale_w = rng.normal(0, 150e-6, 3), rng.normal(0, 30e-6, 3)
    middle = edges[:-1] + 0.5 * dt
    velocity = (mean_f * (1 + scale_f) + bias + creep(case, gimbal, middle)) * dt
    angle = theta * (1 + scale_w) + drift * dt
    velocity += rng.normal(0, 5 * UG * np.sqrt(dt), velocity.shape)
    angle += rng.normal(0, np.radians(0.001) / 60 * np.sqrt(dt), angle.shape)
    for integral, quantum in ((angle, np.radians(0.1 / 3600)), (velocity, 2e-6)):
        whole = np.round(np.cumsum(integral, axis=0) / quantum) * quantum
        integral[:] = np.diff(whole, axis=0, prepend=0.0)

    read_out = gimbal.angles(edges[1:])
    with h5py.File(path, "w") as h:
        h.attrs.update({"format": "ins-selfcal-recording", "version": 1, "serial": f"FORM-{case['seed']}",
                        "sample_rate_hz": rate, "latitude_deg": np.degrees(latitude), "longitude_deg": 10.0,
                        "height_m": height, "dwell_s": float(gimbal.dwell), "rotation_s": gimbal.turn})
        h["time_s"], h["delta_theta_rad"], h["delta_v_mps"] = edges[1:], angle, velocity
        h["gimbal_outer_rad"], h["gimbal_inner_rad"] = read_out[:, 0], read_out[:, 1]
        h["schedule_deg"] = np.array(gimbal.positions, float)
    return {"accel_bias": bias, "gyro_drift": drift, "accel_scale": scale_f, "gyro_scale": scale_w}
