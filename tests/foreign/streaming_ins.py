#!/usr/bin/python3
"""An INS of somebody else's that speaks no UDS: usage streaming_ins.py INTERFACE RECORDING SPEED MEMORY DWELL MOVE [LOSE]

Written from what `selfcal device describe config/profiles/frames.toml` says, and from nothing else of ours. Its IMU's data are those of
RECORDING, which has the moves of one schedule: its time stands still where a move is due and not commanded. Whenever the set that it holds
changes it writes it to MEMORY (JSON). LOSE: of that sample one frame does not come, once.
"""
import json
import os
import select
import signal
import socket
import struct
import sys
import time
from pathlib import Path

import h5py
import numpy

COMMAND, WRITE, STATE, IDENTITY, TOLD = 0x201, 0x202, 0x310, 0x311, 0x312
ANGLES, VELOCITIES, GIMBAL = 0x300, 0x301, 0x302
MOVE, START, STOP, RESET, READ = 0x10, 0x11, 0x12, 0x13, 0x20
STARTING, IDLE, MOVING = 0, 1, 2
SERIAL, SOFTWARE = 700123, 3
AWAY_S, STARTING_S, STATE_EVERY_S, BURST = 1.0, 0.5, 0.05, 100
# What one count of each coefficient is worth; None: a float.
WORTH = [1] + [0.001] * 3 + [None] * 3 + [0.001] * 3 + [-0.001] * 3 + [None] * 3 + [0.001] * 3 + [None] * 6
NAMES = (["version"] + [f"accel_bias_{a}" for a in "xyz"] + [f"gyro_drift_{a}" for a in "xyz"]
         + [f"accel_scale_{s}_{a}" for s in ("pos", "neg") for a in "xyz"] + [f"accel_misalignment_{p}" for p in ("yx", "zx", "zy")]
         + [f"gyro_scale_{a}" for a in "xyz"] + [f"gyro_misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")])


def in_counts(increments, worth):
    sums = numpy.rint(numpy.cumsum(increments, axis=0) / worth).astype(int)
    return numpy.diff(sums, axis=0, prepend=0)


def upwards(count, values):
    """Three of 18 bits behind a byte, the lowest bit first."""
    bits = count
    for k, value in enumerate(values):
        bits |= (int(value) & 0x3FFFF) << 8 + 18 * k
    return bits.to_bytes(8, "little")


def downwards(count, values):
    """The same, the highest bit first."""
    bits = count
    for value in values:
        bits = bits << 18 | int(value) & 0x3FFFF
    return (bits << 2).to_bytes(8, "big")


class Ins:
    def __init__(self, interface, recording, speed, memory, dwell, move, lose):
        self.can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER,
                            b"".join(struct.pack("=II", i, 0xC00007FF) for i in (COMMAND, WRITE)))
        self.can.bind((interface,))
        self.can.setblocking(False)
        self.speed, self.memory, self.lose = speed, memory, lose
        with h5py.File(recording) as file:
            self.rate = float(file.attrs["sample_rate_hz"])
            angles = in_counts(file["delta_theta_rad"][:], 0.125e-6)
            velocities = in_counts(file["delta_v_mps"][:], 2e-6)
            outer = numpy.degrees(file["gimbal_outer_rad"][:])
            inner = numpy.degrees(file["gimbal_inner_rad"][:])
        # selfcal's x is minus our y, its y our x, its z our z; its outer angle is our inner one, its inner one minus our outer.
        self.samples = list(zip(numpy.stack([angles[:, 1], -angles[:, 0], angles[:, 2]], axis=1),
                                numpy.stack([velocities[:, 1], -velocities[:, 0], velocities[:, 2]], axis=1),
                                numpy.rint(numpy.stack([-inner, outer], axis=1) * 100).astype(int)))
        step = round((dwell + move) * self.rate)
        self.departures = range(round(dwell * self.rate), len(self.samples), step)
        self.arrivals = {at + round(move * self.rate): at for at in self.departures}
        self.set = [bytes(4)] * len(WORTH)
        self.power_cycles, self.next_state = 0, 0.0
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        self.ready_at = time.monotonic() + STARTING_S
        self.version = int.from_bytes(self.set[0], "little")
        self.streaming, self.at, self.target = False, 0, None
        self.remember()

    def remember(self):
        held = {name: struct.unpack("<f", bits)[0] if worth is None else struct.unpack("<i", bits)[0] * worth
                for name, worth, bits in zip(NAMES, WORTH, self.set, strict=True)}
        Path(self.memory + ".new").write_text(json.dumps(held), encoding="ascii")
        os.replace(self.memory + ".new", self.memory)

    def put(self, identifier, data):
        frame = struct.pack("=IB3x8s", identifier, len(data), data)
        while True:
            try:
                return self.can.send(frame)
            except OSError as error:
                if error.errno not in (11, 105):  # EAGAIN, ENOBUFS: the queue is full
                    raise
                time.sleep(0.001)

    # --- the gimbal
    def gimbal(self):
        return self.samples[min(self.at, len(self.samples) - 1)][2]

    def moving(self):
        return any(start <= self.at < end for end, start in self.arrivals.items()) and self.streaming

    def may_pass(self):
        """Whether the move that the data have next was commanded."""
        if self.at not in self.departures:
            return True
        end = self.samples[min(self.at + self.arrivals_after, len(self.samples) - 1)][2]
        return self.target is not None and abs((end - self.target + 18000) % 36000 - 18000).max() < 200

    @property
    def arrivals_after(self):
        return next(end - start for end, start in self.arrivals.items())

    # --- the bus
    def tell(self, now):
        if now >= self.next_state:
            self.next_state = now + STATE_EVERY_S
            state = STARTING if now < self.ready_at else MOVING if self.moving() else IDLE
            outer, inner = self.gimbal()
            self.put(STATE, struct.pack("<HHhh", state | (self.version & 0xFFF) << 4, self.power_cycles, int(outer), int(inner)))
            self.put(IDENTITY, struct.pack("<IH", SERIAL, SOFTWARE))

    def stream(self, now):
        due = min(int((now - self.origin) * self.speed * self.rate), self.at + BURST)
        while self.at < min(due, len(self.samples)):
            if not self.may_pass():
                self.origin = now - self.at / self.rate / self.speed
                return
            if self.at in self.departures:
                self.target = None
            angles, velocities, gimbal = self.samples[self.at]
            count = self.at & 0xFF
            self.put(ANGLES, upwards(count, angles))
            if self.at != self.lose:
                self.put(VELOCITIES, downwards(count, velocities))
            else:
                self.lose = -1
            self.put(GIMBAL, struct.pack("<BBhhxx", count, 2 * (25 + 40), *(int(g) for g in gimbal)))
            self.at += 1

    def take(self, identifier, data):
        """False: the power goes for a while."""
        if identifier == WRITE and len(data) == 5 and data[0] < len(self.set):
            self.set[data[0]] = data[1:]
            self.remember()
            self.put(TOLD, data)
        elif identifier != COMMAND or not data:
            return True
        elif data[0] == READ and len(data) == 2 and data[1] < len(self.set):
            self.put(TOLD, data[1:2] + self.set[data[1]])
        elif data[0] == MOVE and len(data) == 6:
            self.target = numpy.array(struct.unpack(">hh", data[2:6]))
        elif data[0] == START:
            self.streaming, self.at, self.origin = True, 0, time.monotonic()
        elif data[0] == STOP:
            self.streaming = False
        elif data[:2] == bytes([RESET, 0xA5]):
            return False
        return True

    def serve(self):
        while True:
            ready, _, _ = select.select([self.can], [], [], 0.005)
            now = time.monotonic()
            self.tell(now)
            while ready:
                try:
                    identifier, length, data = struct.unpack("=IB3x8s", self.can.recv(16))
                except BlockingIOError:
                    break
                if now >= self.ready_at and not self.take(identifier & 0x7FF, data[:length]):
                    time.sleep(AWAY_S)
                    self.power_on()
            if self.streaming:
                self.stream(time.monotonic())


def main():
    interface, recording, speed, memory, dwell, move, *lose = sys.argv[1:]
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    Ins(interface, recording, float(speed), memory, float(dwell), float(move), int(lose[0]) if lose else -1).serve()


if __name__ == "__main__":
    main()
