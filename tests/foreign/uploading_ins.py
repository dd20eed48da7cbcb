#!/usr/bin/python3
"""An INS of somebody else's: usage uploading_ins.py INTERFACE RECORDING KEYFILE SPEED MEMORY

Written from what `selfcal device describe config/profiles/example.toml` says, and from nothing else of ours. It turns by the
clock, its IMU's data are those of RECORDING, and it writes the sets that it holds to MEMORY (JSON) whenever one changes.
"""
import json
import os
import struct
import subprocess
import sys
import zlib
from pathlib import Path

import h5py
import numpy

from server import Refused, Turning, crc16, serve

REQUEST, RESPONSE, FUNCTIONAL = 0x18DA2AF1, 0x18DAF12A, 0x18DB33F1
SLOT_A, SLOT_B, SLOT_FACTORY = 0, 1, 3
PAGE_BYTES = 1024
SET_BYTES = 204
# Of the 24 doubles in a set.
ORDER = ([f"gyro_drift_{a}" for a in "xyz"] + [f"accel_bias_{a}" for a in "xyz"] + [f"gyro_scale_{a}" for a in "xyz"]
         + [f"accel_scale_pos_{a}" for a in "xyz"] + [f"minus_accel_scale_neg_{a}" for a in "xyz"]
         + [f"gyro_misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")]
         + [f"accel_misalignment_{p}" for p in ("yx", "zx", "zy")])

OUT_OF_RANGE, CONDITIONS, DENIED, LENGTH, SEQUENCE, WRONG_KEY = 0x31, 0x22, 0x33, 0x13, 0x24, 0x35
NOT_SUPPORTED, SUB_FUNCTION, NOT_IN_SESSION, BLOCK_COUNTER, NOT_ERASED = 0x11, 0x12, 0x7F, 0x73, 0x72


def int24(value):
    return int(value).to_bytes(3, "little", signed=True)


def new_set(version, values=(0.0,) * 24):
    body = struct.pack("<II24d", version, 0, *values)
    return body + struct.pack("<I", zlib.crc32(body))


class Ins(Turning):
    STARTING, IDLE, ROTATING, COMPLETE, ABORTED = 8, 1, 2, 3, 10
    SAMPLES_PER_PAGE = 38

    def __init__(self, recording, key, speed, memory):
        self.key, self.speed, self.memory = key, speed, memory
        with h5py.File(recording) as file:
            self.rate = float(file.attrs["sample_rate_hz"])
            # What this INS counts in: a tenth of an arcsecond, a micrometre per second times two.
            self.angle_lsb, self.velocity_lsb = 0.1 / 3600 * numpy.pi / 180, 2e-6
            angles = numpy.rint(file["delta_theta_rad"][:] / self.angle_lsb).astype(int)
            velocities = numpy.rint(file["delta_v_mps"][:] / self.velocity_lsb).astype(int)
            outer = numpy.degrees(file["gimbal_outer_rad"][:])
            inner = numpy.degrees(file["gimbal_inner_rad"][:])
        # selfcal's x is our y, its y our -x, its z our z; its inner angle is minus ours.
        turned = [(-a[1], a[0], a[2]) for a in angles], [(-v[1], v[0], v[2]) for v in velocities]
        self.samples = [struct.pack("<ii", round(-(i % 360) * 1e5), round(o % 360 * 1e5)) + b"".join(map(int24, (*v, *a)))
                        for a, v, o, i in zip(*turned, outer, inner)]
        self.slots = {SLOT_FACTORY: new_set(0), SLOT_A: None, SLOT_B: None}
        self.committed = set()
        self.power_cycles, self.run_id, self.schedule = 0, 0, None
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        valid = [slot for slot in (SLOT_A, SLOT_B) if slot in self.committed]
        self.slot = max(valid, key=lambda s: struct.unpack("<I", self.slots[s][:4])[0], default=SLOT_FACTORY)
        self.inactive = SLOT_B if self.slot == SLOT_A else SLOT_A
        self.at_rest()
        self.enter(1)
        self.remember()

    def enter(self, session):
        self.session, self.open, self.seed, self.upload = session, False, None, None

    def remember(self):
        held = self.slots[self.slot]
        values = struct.unpack("<24d", held[8:200])
        text = json.dumps({"version": struct.unpack("<I", held[:4])[0], "values": dict(zip(ORDER, values))})
        Path(self.memory + ".new").write_text(text, encoding="ascii")
        os.replace(self.memory + ".new", self.memory)

    # --- data
    def page(self, number):
        first = number * self.SAMPLES_PER_PAGE
        samples = self.samples[first:min(first + self.SAMPLES_PER_PAGE, self.samples_so_far())]
        last = number + 1 == self.pages_written() and self.state() != self.ROTATING
        head = number.to_bytes(3, "little") + struct.pack("<BIhBx", len(samples), self.run_id, round(25.0 / 0.0625), int(last))
        body = (head + b"".join(samples)).ljust(PAGE_BYTES - 2, b"\0")
        return body + struct.pack("<H", crc16(body))

    # --- records
    def state_record(self):
        version = struct.unpack("<I", self.slots[self.slot][:4])[0]
        return struct.pack("<HHII", self.state() | self.slot << 4, version, self.run_id, self.power_cycles)

    def directory(self):
        written = self.pages_written()
        over = self.state() != self.ROTATING
        expected = -(-len(self.samples) // self.SAMPLES_PER_PAGE)
        samples = self.samples_so_far() if over else written * self.SAMPLES_PER_PAGE
        return (bytes([0x5A if over else 0xA5]) + struct.pack("<I", self.run_id) + written.to_bytes(3, "little")
                + expected.to_bytes(3, "little") + struct.pack("<HI", 0, samples))

    def read(self, did):
        if did == 0xFD00:
            return b"FOREIGN-1"
        if did == 0xFD01:
            return b"python 1"
        if did == 0xFD10:
            return self.state_record()
        if did == 0xFD11 and self.schedule:
            return self.schedule
        if did == 0xFD12:
            return struct.pack("<iii", round(40.0e7), round(116.0e7), 5000)
        if did == 0xFD20:
            return self.directory()
        if did == 0xFD21:
            return struct.pack("<fdd", self.rate, 0.1, 2e-3)
        if did in (0xFD30, 0xFD31, 0xFD32):
            held = self.slots[{0xFD30: self.slot, 0xFD31: self.inactive, 0xFD32: SLOT_FACTORY}[did]]
            if held:
                return held
        raise Refused(CONDITIONS if did in (0xFD11, 0xFD31) else OUT_OF_RANGE)

    def write(self, did, record):
        if did not in (0xFD11, 0xFD31):
            raise Refused(OUT_OF_RANGE)
        if not self.open:
            raise Refused(DENIED)
        if did == 0xFD11:
            tenths, count = struct.unpack("<HH", record[:4])
            if len(record) != 4 + 8 * count:
                raise Refused(LENGTH)
            dwells = [struct.unpack("<I", record[8 + 8 * k:12 + 8 * k])[0] for k in range(count)]
            seconds = sum(dwells) / 1000 + (count - 1) * tenths / 10
            if round(seconds * self.rate) != len(self.samples):  # this gimbal knows one motion
                raise Refused(OUT_OF_RANGE)
            self.schedule, self.dwells_s, self.move_s = record, [d / 1000 for d in dwells], tenths / 10
            return
        if len(record) != SET_BYTES:
            raise Refused(LENGTH)
        if zlib.crc32(record[:200]) != struct.unpack("<I", record[200:])[0]:
            raise Refused(OUT_OF_RANGE)
        if self.slots[self.inactive] is not None:
            raise Refused(NOT_ERASED)
        self.slots[self.inactive] = bytes(record)

    def routine(self, action, number, option):
        if number not in (0xE001, 0xE010, 0xE011):
            raise Refused(OUT_OF_RANGE)
        if not self.open:
            raise Refused(DENIED)
        if number == 0xE001:
            return self.rotate(action, option)
        if action != 1:
            raise Refused(SUB_FUNCTION)
        if number == 0xE010:
            self.slots[self.inactive] = None
            self.committed.discard(self.inactive)
        else:
            held = self.slots[self.inactive]
            if held is None or option != held[200:]:
                raise Refused(OUT_OF_RANGE)
            self.committed.add(self.inactive)
        return b""

    def rotate(self, action, option):
        if action == 1:
            if len(option) != 5:
                raise Refused(LENGTH)
            if option[0] != 0x55:
                raise Refused(OUT_OF_RANGE)
            if not self.schedule or self.state() == self.ROTATING:
                raise Refused(CONDITIONS)
            self.run_id, = struct.unpack("<I", option[1:])
            self.turn()
        elif action == 2:
            self.stop()
        else:
            return struct.pack("<BBI", self.state(), self.position(), self.run_id)
        return b""

    # --- services
    def answer(self, request):
        service = request[0]
        if service in (0x11, 0x27, 0x2E, 0x31, 0x35, 0x36, 0x37) and self.session == 1:
            raise Refused(NOT_IN_SESSION)
        if service == 0x10:
            self.enter(request[1])
            return bytes([0x50, request[1]]) + struct.pack(">HH", 50, 500)
        if service == 0x3E:
            return b"" if request[1] & 0x80 else b"\x7E\0"
        if service == 0x22:
            return b"\x62" + request[1:3] + self.read(struct.unpack(">H", request[1:3])[0])
        if service == 0x27 and request[1] == 0x11:
            self.seed = bytes(16) if self.open else os.urandom(16)
            return b"\x67\x11" + self.seed
        if service == 0x27 and request[1] == 0x12:
            if self.seed is None:
                raise Refused(SEQUENCE)
            mac = subprocess.run(["openssl", "mac", "-cipher", "AES-128-CBC", "-macopt", "hexkey:" + self.key, "-binary", "CMAC"],
                                 input=self.seed, capture_output=True, check=True).stdout
            self.seed, self.open = None, mac == request[2:]
            if not self.open:
                raise Refused(WRONG_KEY)
            return b"\x67\x12"
        if service == 0x2E:
            self.write(struct.unpack(">H", request[1:3])[0], request[3:])
            return b"\x6E" + request[1:3]
        if service == 0x31:
            return b"\x71" + request[1:4] + self.routine(request[1], struct.unpack(">H", request[2:4])[0], request[4:])
        if service == 0x35:
            if request[1:3] != b"\0\x33" or len(request) != 9:
                raise Refused(OUT_OF_RANGE)
            address, size = int.from_bytes(request[3:6], "big"), int.from_bytes(request[6:9], "big")
            if address % PAGE_BYTES or size % PAGE_BYTES or address + size > self.pages_written() * PAGE_BYTES:
                raise Refused(OUT_OF_RANGE)
            first = address // PAGE_BYTES
            self.upload = {"pages": range(first, first + size // PAGE_BYTES), "done": 0, "block": 0, "last": b""}
            return b"\x75\x40" + struct.pack(">I", PAGE_BYTES + 2)
        if service == 0x36:
            return self.transfer(request[1])
        if service == 0x37:
            self.upload = None
            return b"\x77"
        if service == 0x11:
            self.reset_wanted = True
            return b"\x51\x01"
        raise Refused(NOT_SUPPORTED)

    def transfer(self, block):
        upload = self.upload
        if upload is None:
            raise Refused(SEQUENCE)
        if block == (upload["block"] + 1) % 256:
            if upload["done"] == len(upload["pages"]):
                raise Refused(SEQUENCE)
            upload["last"] = self.page(upload["pages"][upload["done"]])
            upload["done"] += 1
            upload["block"] = block
        elif block != upload["block"] or not upload["last"]:
            raise Refused(BLOCK_COUNTER)
        return bytes([0x76, block]) + upload["last"]


def main():
    interface, recording, key_file, speed, memory = sys.argv[1:]
    key = Path(key_file).read_text(encoding="ascii").strip()
    serve(Ins(recording, key, float(speed), memory), interface, REQUEST, RESPONSE, FUNCTIONAL)


if __name__ == "__main__":
    main()
