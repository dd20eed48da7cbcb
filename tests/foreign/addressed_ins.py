#!/usr/bin/python3
"""An INS of somebody else's without data identifiers: usage addressed_ins.py INTERFACE RECORDING KEYFILE SPEED MEMORY [CUT ...]

Written from what `selfcal device describe config/profiles/addresses.toml` says, and from nothing else of ours. All that it tells and takes
are bytes of its memory. It turns by the clock, its IMU's data are those of RECORDING, and it writes the set that it holds to MEMORY
(JSON) whenever that changes. With CUT its power goes when so many parts of a set have been written, of any but the first: that write is
not answered. The next CUT is another set's.
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

from server import Refused, Turning, crc32c, serve

REQUEST, RESPONSE, FUNCTIONAL = 0x5A0, 0x5A8, 0x7DF
SESSION, SEED, ROTATE = 0x42, 0x03, 0x2001
FORMAT, LONGEST_READ, LONGEST_WRITE = 0x13, 64, 48
SERIAL, SOFTWARE, STATE, SCHEDULE, SITE, DIRECTORY, SAMPLES, SET = (0x40000, 0x40010, 0x40100, 0x40200, 0x40400, 0x40500, 0x40600, 0x48000)
BYTES = {SERIAL: 16, SOFTWARE: 12, STATE: 12, SCHEDULE: 260, SITE: 24, DIRECTORY: 20, SAMPLES: 12, SET: 204}
PAGE_BYTES, CRC_AT = 2048, 2044
ANGLE_URAD, VELOCITY_MMPS = 1 / 16, 1 / 512  # what one count is worth
NAMES = ([f"gyro_misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")] + [f"gyro_scale_{a}" for a in "xyz"]
         + [f"gyro_drift_{a}" for a in "xyz"] + [f"accel_misalignment_{p}" for p in ("yx", "zx", "zy")]
         + [f"accel_scale_neg_{a}" for a in "xyz"] + [f"accel_scale_pos_{a}" for a in "xyz"] + [f"accel_bias_{a}" for a in "xyz"])


def in_counts(increments, worth):
    sums = numpy.rint(numpy.cumsum(increments, axis=0) / worth).astype(int)
    return numpy.diff(sums, axis=0, prepend=0)


def angle24(degrees):
    return (round(float(degrees) % 360 * 1e4) % 3600000).to_bytes(3, "big")


class Ins(Turning):
    STARTING, IDLE, ROTATING, COMPLETE, ABORTED = 0x100, 0x101, 0x200, 0x201, 0x202
    SAMPLES_PER_PAGE = 67
    AWAY_S = 1.0

    def __init__(self, recording, key, speed, memory, cuts):
        self.key, self.speed, self.memory, self.cuts = key, speed, memory, cuts
        with h5py.File(recording) as file:
            self.rate = float(file.attrs["sample_rate_hz"])
            angles = in_counts(file["delta_theta_rad"][:], ANGLE_URAD * 1e-6)
            velocities = in_counts(file["delta_v_mps"][:], VELOCITY_MMPS * 1e-3)
            outer = numpy.degrees(file["gimbal_outer_rad"][:])
            inner = numpy.degrees(file["gimbal_inner_rad"][:])
        # selfcal's x is our -x, its y our z, its z our y; its outer angle is our inner one, its inner one minus our outer.
        self.samples = [angle24(-i) + angle24(o) + struct.pack(">6i", -v[0], v[2], v[1], -a[0], a[2], a[1])
                        for o, i, v, a in zip(outer, inner, velocities, angles)]
        body = bytes(200)
        self.set = body + struct.pack(">I", crc32c(body))
        self.sets_written, self.parts, self.part_of_schedule = 0, 0, b""
        self.power_cycles, self.run_id, self.schedule = 0, 0, None
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        self.at_rest()
        self.enter(1)
        self.version, = struct.unpack(">I", self.set[:4])
        self.remember()

    def enter(self, session):
        self.session, self.open, self.seed, self.upload = session, False, None, None

    def remember(self):
        version, *values = struct.unpack(">I24d", self.set[:196])
        whole = struct.unpack(">I", self.set[200:])[0] == crc32c(self.set[:200])
        held = {"version": version, "values": dict(zip(NAMES, values, strict=True))} if whole else None
        Path(self.memory + ".new").write_text(json.dumps({"cuts_left": len(self.cuts), "held": held}), encoding="ascii")
        os.replace(self.memory + ".new", self.memory)

    # --- data
    def page(self, number):
        first = number * self.SAMPLES_PER_PAGE
        samples = self.samples[first:min(first + self.SAMPLES_PER_PAGE, self.samples_so_far())]
        head = struct.pack(">IIHh", self.run_id, number, len(samples), 250).ljust(16, b"\0")
        body = (head + b"".join(samples)).ljust(CRC_AT, b"\0")
        return body + struct.pack(">I", zlib.crc32(body))

    # --- memory
    def told(self, place):
        if place == SERIAL:
            return b"FOREIGN-6".ljust(16)
        if place == SOFTWARE:
            return b"python 6".ljust(12, b"\xFF")
        if place == STATE:
            return struct.pack(">HBBII", self.state(), 0, self.version & 0xFF, self.run_id, self.power_cycles)
        if place == SCHEDULE:
            if not self.schedule:
                raise Refused(0x22)
            return self.schedule
        if place == SITE:
            return struct.pack(">3d", numpy.radians(116.0), numpy.radians(40.0), 50.0)
        if place == DIRECTORY:
            written, over = self.pages_written(), self.state() != self.ROTATING
            samples = self.samples_so_far() if over else written * self.SAMPLES_PER_PAGE
            return struct.pack(">4IHxx", self.run_id, samples, written, -(-len(self.samples) // self.SAMPLES_PER_PAGE), over)
        return struct.pack(">3f", self.rate, ANGLE_URAD, VELOCITY_MMPS) if place == SAMPLES else self.set

    def place_of(self, request):
        """Record, first byte in it, number of bytes."""
        if request[1] != FORMAT:
            raise Refused(0x31)
        address, size = int.from_bytes(request[2:5], "big"), request[5]
        for place, length in BYTES.items():
            if place <= address and address + size <= place + length and size > 0:
                return place, address - place, size
        raise Refused(0x31)

    def read(self, request):
        if len(request) != 6:
            raise Refused(0x13)
        place, at, size = self.place_of(request)
        if size > LONGEST_READ:
            raise Refused(0x31)
        return b"\x63" + self.told(place)[at:at + size]

    def write(self, request):
        """None: the power goes before it is answered."""
        if len(request) < 7:
            raise Refused(0x13)
        place, at, size = self.place_of(request)
        if len(request) != 6 + size:
            raise Refused(0x13)
        if place not in (SCHEDULE, SET) or size > LONGEST_WRITE:
            raise Refused(0x31)
        if not self.open:
            raise Refused(0x33)
        data = bytes(request[6:])
        if place == SCHEDULE:
            self.take_schedule(at, data)
        elif self.take_set(at, data):
            return None
        return b"\x7D" + request[1:6]

    def take_schedule(self, at, data):
        self.part_of_schedule = self.part_of_schedule[:at] + data
        record = self.part_of_schedule
        if len(record) < BYTES[SCHEDULE]:
            return
        count, move_ms = struct.unpack(">HH", record[:4])
        if count > 32:
            raise Refused(0x31)
        dwells = [struct.unpack(">I", record[4 + 8 * k:8 + 8 * k])[0] / 1000 for k in range(count)]
        seconds = sum(dwells) + (count - 1) * move_ms / 1000
        if round(seconds * self.rate) != len(self.samples):  # this gimbal knows one motion
            raise Refused(0x31)
        self.schedule, self.dwells_s, self.move_s = record, dwells, move_ms / 1000

    def take_set(self, at, data):
        """Byte by byte over what was there. True: the power goes."""
        self.set = self.set[:at] + data + self.set[at + len(data):]
        self.parts += 1
        if at + len(data) == BYTES[SET]:
            self.sets_written, self.parts = self.sets_written + 1, 0
        goes = bool(self.sets_written > 0 and self.cuts and self.parts == self.cuts[0])
        if goes:
            del self.cuts[0]
        self.remember()
        return goes

    # --- services
    def rotate(self, action, option):
        if action == 1:
            if len(option) != 4:
                raise Refused(0x13)
            if not self.schedule or self.state() == self.ROTATING:
                raise Refused(0x22)
            self.run_id, = struct.unpack(">I", option)
            self.turn()
        elif action == 2:
            self.stop()
        elif action == 3:
            return struct.pack(">HHI", self.state(), self.position(), self.run_id)
        else:
            raise Refused(0x12)
        return b""

    def unlock(self, request):
        if request[1] == SEED:
            self.seed = bytes(16) if self.open else os.urandom(16)
            return b"\x67" + request[1:2] + self.seed
        if request[1] != SEED + 1:
            raise Refused(0x12)
        if self.seed is None:
            raise Refused(0x24)
        mac = subprocess.run(["openssl", "mac", "-cipher", "AES-128-CBC", "-macopt", "hexkey:" + self.key, "-binary", "CMAC"],
                             input=self.seed, capture_output=True, check=True).stdout
        self.seed, self.open = None, mac == request[2:]
        if not self.open:
            raise Refused(0x35)
        return b"\x67" + request[1:2]

    def answer(self, request):
        service = request[0]
        if service in (0x11, 0x27, 0x31, 0x35, 0x36, 0x37, 0x3D) and self.session == 1:
            raise Refused(0x7F)
        if service == 0x10 and request[1] in (1, SESSION):
            self.enter(request[1])
            return bytes([0x50, request[1]]) + struct.pack(">HH", 50, 500)
        if service == 0x3E:
            return b"" if request[1] & 0x80 else b"\x7E\0"
        if service == 0x23:
            return self.read(request)
        if service == 0x3D:
            return self.write(request)
        if service == 0x27:
            return self.unlock(request)
        if service in (0x11, 0x31) and not self.open:
            raise Refused(0x33)
        if service == 0x31 and struct.unpack(">H", request[2:4])[0] == ROTATE:
            return b"\x71" + request[1:4] + self.rotate(request[1], request[4:])
        if service == 0x35:
            return self.begin_upload(request)
        if service == 0x36:
            return self.transfer(request[1])
        if service == 0x37:
            self.upload = None
            return b"\x77"
        if service == 0x11:
            self.reset_wanted = True
            return b"\x51\x01"
        raise Refused({0x10: 0x12, 0x31: 0x31}.get(service, 0x11))

    def begin_upload(self, request):
        if request[1:3] != b"\0\x44" or len(request) != 11:
            raise Refused(0x31)
        address, size = struct.unpack(">II", request[3:])
        if address % PAGE_BYTES or size % PAGE_BYTES or address + size > self.pages_written() * PAGE_BYTES:
            raise Refused(0x31)
        first = address // PAGE_BYTES
        self.upload = {"pages": range(first, first + size // PAGE_BYTES), "done": 0, "block": 0, "last": b""}
        return b"\x75\x40" + struct.pack(">I", PAGE_BYTES + 2)

    def transfer(self, block):
        upload = self.upload
        if upload is None:
            raise Refused(0x24)
        if block == (upload["block"] + 1) % 256:
            if upload["done"] == len(upload["pages"]):
                raise Refused(0x24)
            upload["last"] = self.page(upload["pages"][upload["done"]])
            upload["done"] += 1
            upload["block"] = block
        elif block != upload["block"] or not upload["last"]:
            raise Refused(0x73)
        return bytes([0x76, block]) + upload["last"]


def main():
    interface, recording, key_file, speed, memory, *cuts = sys.argv[1:]
    key = Path(key_file).read_text(encoding="ascii").strip()
    serve(Ins(recording, key, float(speed), memory, [int(cut) for cut in cuts]), interface, REQUEST, RESPONSE, FUNCTIONAL, wide=False)


if __name__ == "__main__":
    main()
