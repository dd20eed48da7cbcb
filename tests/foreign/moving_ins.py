#!/usr/bin/python3
"""An INS of somebody else's that is told each position by itself: usage moving_ins.py INTERFACE RECORDING SPEED MEMORY DWELL MOVE

Written from what `selfcal device describe config/profiles/moves.toml` says, and from nothing else of ours. Its IMU's data are those of
RECORDING, which has the moves of one schedule: its time stands still where a move is due and not commanded, and it refuses any other
one. Whenever the set that it holds changes it writes it to MEMORY (JSON).
"""
import json
import os
import struct
import sys
import time
from pathlib import Path

import h5py
import numpy

from server import START_UP_S, Refused, crc32c, serve

REQUEST, RESPONSE, FUNCTIONAL = 0x1C0A0301, 0x1C0A0302, 0x1C0AFF01
SESSION, ROTATE, MOVE = 0x41, 0x0A20, 0x0A21
STARTING, IDLE, ROTATING, COMPLETE = 0, 1, 5, 6
PAGE_BYTES, CRC_AT, SAMPLES_PER_PAGE = 1024, 1020, 31
MEMORY_AT, LONGEST_READ = 0x200000, 1024
ANGLE_URAD, VELOCITY_MMPS = 1 / 16, 1 / 512  # what one count is worth
SET, SET_BYTES = 0x0A10, 100
NAMES = ([f"accel_bias_{a}" for a in "xyz"] + [f"gyro_drift_{a}" for a in "xyz"]
         + [f"accel_scale_{s}_{a}" for s in ("pos", "neg") for a in "xyz"] + [f"accel_misalignment_{p}" for p in ("yx", "zx", "zy")]
         + [f"gyro_scale_{a}" for a in "xyz"] + [f"gyro_misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")])


def in_counts(increments, worth):
    sums = numpy.rint(numpy.cumsum(increments, axis=0) / worth).astype(int)
    return numpy.diff(sums, axis=0, prepend=0)


def in_half_turns(degrees):
    return (degrees + 180.0) % 360.0 - 180.0


class Ins:
    AWAY_S = 1.0

    def __init__(self, recording, speed, memory, dwell_s, move_s):
        self.speed, self.memory = speed, memory
        with h5py.File(recording) as file:
            self.rate = float(file.attrs["sample_rate_hz"])
            angles = in_counts(file["delta_theta_rad"][:], ANGLE_URAD * 1e-6)
            velocities = in_counts(file["delta_v_mps"][:], VELOCITY_MMPS * 1e-3)
            outer = numpy.degrees(file["gimbal_outer_rad"][:])
            inner = numpy.degrees(file["gimbal_inner_rad"][:])
        # selfcal's x is our y, its y our z, its z our x; its outer angle is minus our inner one, its inner one minus our outer.
        self.gimbal = numpy.stack([-inner, -outer], axis=1)
        self.samples = [struct.pack("<2f6i", *g, v[2], v[0], v[1], a[2], a[0], a[1]) for g, v, a in zip(self.gimbal, velocities, angles)]
        step, self.move_samples = round((dwell_s + move_s) * self.rate), round(move_s * self.rate)
        self.departures = list(range(round(dwell_s * self.rate), len(self.samples), step))
        self.set, self.power_cycles, self.run_id = bytes(SET_BYTES), 0, 0
        self.reset_wanted = False
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        self.ready_at = time.monotonic() + START_UP_S
        self.version, = struct.unpack_from("<I", self.set)
        self.recording, self.ended, self.at = False, False, 0
        self.enter(1)
        self.remember()

    def enter(self, session):
        self.session = session

    def remember(self):
        version, *values = struct.unpack("<I24f", self.set)
        held = {"version": version, "values": dict(zip(NAMES, values, strict=True))}
        Path(self.memory + ".new").write_text(json.dumps(held), encoding="ascii")
        os.replace(self.memory + ".new", self.memory)

    # --- the gimbal, and the samples so far
    def advance(self):
        if not self.recording:
            return
        now = time.monotonic()
        due = min(int((now - self.origin) * self.speed * self.rate), len(self.samples))
        while self.to_go and due >= self.to_go[0]:
            if not self.commanded:
                self.at, self.origin = self.to_go[0], now - self.to_go[0] / self.rate / self.speed
                return
            del self.to_go[0]
            self.commanded = False
        self.at = due

    def moving(self):
        return self.recording and (self.commanded or any(0 < self.at - start < self.move_samples for start in self.departures))

    def angles(self):
        return self.gimbal[min(self.at, len(self.gimbal) - 1)]

    def move_to(self, option):
        if len(option) != 8:
            raise Refused(0x13)
        inner, outer = (int.from_bytes(option[k:k + 3], "little", signed=True) * 1e-4 for k in (2, 5))
        if option[0] != 2 or max(abs(inner), abs(outer)) > 360.0:
            raise Refused(0x31)
        self.advance()
        if self.moving():
            raise Refused(0x22)
        end = 0
        if self.recording:
            if not self.to_go:
                raise Refused(0x31)
            end = self.to_go[0] + self.move_samples
        if abs(in_half_turns(self.gimbal[min(end, len(self.gimbal) - 1)] - [outer, inner])).max() > 1.0:
            raise Refused(0x31)  # this gimbal knows one motion
        self.commanded = self.recording

    def rotate(self, action, option):
        if action == 1:
            if len(option) != 4:
                raise Refused(0x13)
            if self.recording:
                raise Refused(0x22)
            self.run_id, = struct.unpack("<I", option)
            self.recording, self.ended, self.commanded, self.at = True, False, False, 0
            self.origin, self.to_go = time.monotonic(), list(self.departures)
        elif action == 2:
            if not self.recording:
                raise Refused(0x24)
            self.advance()
            self.recording, self.ended = False, True
            print(f"ended with {self.at} of {len(self.samples)} samples", flush=True)
        elif action == 3:
            return struct.pack("<BBI", self.state(), 0, self.run_id)
        else:
            raise Refused(0x12)
        return b""

    def state(self):
        if time.monotonic() < self.ready_at:
            return STARTING
        return ROTATING if self.recording else COMPLETE if self.ended else IDLE

    # --- raw data
    def pages_written(self):
        return self.at // SAMPLES_PER_PAGE if self.recording else -(-self.at // SAMPLES_PER_PAGE)

    def page(self, number):
        samples = self.samples[number * SAMPLES_PER_PAGE:min((number + 1) * SAMPLES_PER_PAGE, self.at)]
        head = struct.pack("<IIBbxx", self.run_id, number, len(samples), 25)
        body = (head + b"".join(samples)).ljust(CRC_AT, b"\0")
        return body + struct.pack("<I", crc32c(body))

    def memory_at(self, address, size):
        begin = address - MEMORY_AT
        if not 0 < size <= LONGEST_READ or begin < 0 or begin + size > self.pages_written() * PAGE_BYTES:
            raise Refused(0x31)
        first, last = begin // PAGE_BYTES, (begin + size - 1) // PAGE_BYTES
        data = b"".join(self.page(number) for number in range(first, last + 1))
        return data[begin - first * PAGE_BYTES:][:size]

    # --- records
    def read(self, did):
        if did == 0xF18C:
            return b"FOREIGN-5"
        if did == 0xF195:
            return b"python 5"
        if did == 0x0A01:
            outer, inner = (round(float(angle) * 100) for angle in in_half_turns(self.angles()))
            return struct.pack("<BBHIHhh", self.state() | self.moving() << 7, 0, self.version, self.run_id, self.power_cycles,
                               outer, inner) + b"\xFF\xFF"
        if did == 0x0A03:
            samples = self.pages_written() * SAMPLES_PER_PAGE if self.recording else self.at
            return struct.pack("<IIIB", self.run_id, self.pages_written(), samples, 0 if self.recording else 255)
        if did == 0x0A04:
            return struct.pack("<fff", self.rate, ANGLE_URAD, VELOCITY_MMPS)
        if did == SET:
            return self.set
        raise Refused(0x31)

    def write(self, did, record):
        if did != SET:
            raise Refused(0x31)
        if len(record) != SET_BYTES:
            raise Refused(0x13)
        self.set = bytes(record)
        self.remember()

    # --- services
    def answer(self, request):
        service = request[0]
        self.advance()
        if service in (0x11, 0x23, 0x2E, 0x31) and self.session == 1:
            raise Refused(0x7F)
        if service == 0x10 and request[1] in (1, SESSION):
            self.enter(request[1])
            return bytes([0x50, request[1]]) + struct.pack(">HH", 50, 500)
        if service == 0x3E:
            return b"" if request[1] & 0x80 else b"\x7E\0"
        if service == 0x22 and len(request) == 3:
            return b"\x62" + request[1:3] + self.read(struct.unpack(">H", request[1:3])[0])
        if service == 0x23:
            if request[1] != 0x24 or len(request) != 8:
                raise Refused(0x31)
            return b"\x63" + self.memory_at(*struct.unpack(">IH", request[2:]))
        if service == 0x2E:
            self.write(struct.unpack(">H", request[1:3])[0], request[3:])
            return b"\x6E" + request[1:3]
        if service == 0x31:
            routine, = struct.unpack(">H", request[2:4])
            if routine == ROTATE:
                return b"\x71" + request[1:4] + self.rotate(request[1], request[4:])
            if routine == MOVE and request[1] == 1:
                self.move_to(request[4:])
                return b"\x71" + request[1:4]
            raise Refused(0x12 if routine == MOVE else 0x31)
        if service == 0x11:
            self.reset_wanted = True
            return b"\x51\x01"
        raise Refused({0x10: 0x12, 0x22: 0x13}.get(service, 0x11))


def main():
    interface, recording, speed, memory, dwell_s, move_s = sys.argv[1:]
    serve(Ins(recording, float(speed), memory, float(dwell_s), float(move_s)), interface, REQUEST, RESPONSE, FUNCTIONAL)


if __name__ == "__main__":
    main()
