#!/usr/bin/python3
"""An INS of somebody else's without slots: usage memory_ins.py INTERFACE RECORDING SPEED MEMORY [CUT ...]

Written from what `selfcal device describe config/profiles/memory.toml` says, and from nothing else of ours. It turns by the clock,
its IMU's data are those of RECORDING, and it writes the set that it holds to MEMORY (JSON) whenever it changes. With CUT its power
goes when so many coefficients of a set have been written, of any but the first: that write is not answered. The next CUT is another set's.
"""
import json
import os
import struct
import sys
import zlib
from pathlib import Path

import h5py
import numpy

from server import Refused, Turning, serve

REQUEST, RESPONSE, FUNCTIONAL = 0x18DA51F5, 0x18DAF551, 0x18DB33F5
PAGE_BYTES, CRC_AT = 2048, 2044
MEMORY_AT, LONGEST_READ = 0x80000000, 512
SESSION, ROTATE = 0x60, 0x4201
# Of each coefficient: format, and what one count is worth.
SET = {0x4100: (">H", 1, "version")}
SET |= {0x4101 + k: (">i", 0.001, f"accel_bias_{a}") for k, a in enumerate("xyz")}
SET |= {0x4104 + k: (">i", 1e-6, f"gyro_drift_{a}") for k, a in enumerate("xyz")}
SET |= {0x4107 + k: (">i", 0.001, f"accel_scale_{a}") for k, a in enumerate("xyz")}
SET |= {0x410A + k: (">f", 1, f"accel_misalignment_{p}") for k, p in enumerate(("yx", "zx", "zy"))}
SET |= {0x410D + k: (">i", 0.001, f"gyro_scale_{a}") for k, a in enumerate("xyz")}
SET |= {0x4110 + k: (">f", 1, f"gyro_misalignment_{p}") for k, p in enumerate(("xy", "xz", "yx", "yz", "zx", "zy"))}


def in_counts(increments, worth):
    sums = numpy.rint(numpy.cumsum(increments, axis=0) / worth).astype(int)
    return numpy.diff(sums, axis=0, prepend=0)


class Ins(Turning):
    STARTING, IDLE, ROTATING, COMPLETE, ABORTED = 1, 2, 3, 4, 5
    SAMPLES_PER_PAGE = 63
    AWAY_S = 1.0

    def __init__(self, recording, speed, memory, cuts):
        self.speed, self.memory, self.cuts = speed, memory, cuts
        with h5py.File(recording) as file:
            self.rate = float(file.attrs["sample_rate_hz"])
            # What this INS counts in: a sixteenth of a microradian, two micrometres per second. What is left is carried on.
            angles = in_counts(file["delta_theta_rad"][:], 1e-6 / 16)
            velocities = in_counts(file["delta_v_mps"][:], 2e-6)
            outer = numpy.degrees(file["gimbal_outer_rad"][:])
            inner = numpy.degrees(file["gimbal_inner_rad"][:])
        # selfcal's x is our z, its y our x, its z our y; its outer angle is minus our inner one, its inner one our outer.
        self.samples = [struct.pack(">6i2f", a[1], a[2], a[0], v[1], v[2], v[0], i, -o)
                        for a, v, o, i in zip(angles, velocities, outer, inner)]
        self.set = {did: struct.pack(form, 0) for did, (form, _, _) in SET.items()}
        self.sets_written, self.writes = 0, 0
        self.power_cycles, self.run_id, self.schedule = 0, 0, None
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        self.at_rest()
        self.enter(1)
        self.version = struct.unpack(">H", self.set[0x4100])[0]
        self.remember()

    def enter(self, session):
        self.session = session

    def remember(self):
        held = {name: struct.unpack(form, self.set[did])[0] * worth for did, (form, worth, name) in SET.items()}
        Path(self.memory + ".new").write_text(json.dumps({"cuts_left": len(self.cuts), "held": held}), encoding="ascii")
        os.replace(self.memory + ".new", self.memory)

    # --- data
    def page(self, number):
        first = number * self.SAMPLES_PER_PAGE
        samples = self.samples[first:min(first + self.SAMPLES_PER_PAGE, self.samples_so_far())]
        head = struct.pack(">IIHBx", self.run_id, number, len(samples), round((25.0 + 40.0) / 0.5))
        body = (head + b"".join(samples)).ljust(CRC_AT, b"\0")
        return body + struct.pack(">I", zlib.crc32(body))

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
            return b"FOREIGN-2"
        if did == 0xF189:
            return b"python 2"
        if did == 0x4001:
            return struct.pack(">BBHIH", self.state(), 0, self.version, self.run_id, self.power_cycles)
        if did == 0x4002 and self.schedule:
            return self.schedule
        if did == 0x4003:
            written, over = self.pages_written(), self.state() != self.ROTATING
            samples = self.samples_so_far() if over else written * self.SAMPLES_PER_PAGE
            return struct.pack(">IIIIB", self.run_id, written, -(-len(self.samples) // self.SAMPLES_PER_PAGE), samples, over)
        if did == 0x4004:
            return struct.pack(">Idd", round(self.rate * 1000), 1 / 16, 2e-3)
        if did in SET:
            return self.set[did]
        raise Refused(0x22 if did == 0x4002 else 0x31)

    def write(self, did, record):
        """False: the power goes before it is answered."""
        if did == 0x4002:
            count, move_ms = struct.unpack(">BH", record[:3])
            if len(record) != 3 + 6 * count:
                raise Refused(0x13)
            dwells = [struct.unpack(">H", record[7 + 6 * k:9 + 6 * k])[0] / 10 for k in range(count)]
            seconds = sum(dwells) + (count - 1) * move_ms / 1000
            if round(seconds * self.rate) != len(self.samples):  # this gimbal knows one motion
                raise Refused(0x31)
            self.schedule, self.dwells_s, self.move_s = record, dwells, move_ms / 1000
        elif did in SET:
            if len(record) != struct.calcsize(SET[did][0]):
                raise Refused(0x13)
            self.set[did] = bytes(record)
            self.writes += 1
            if did == 0x4100:
                self.sets_written, self.writes = self.sets_written + 1, 0
            power_goes = self.sets_written > 0 and self.cuts and self.writes == self.cuts[0]
            if power_goes:
                del self.cuts[0]
            self.remember()
            return not power_goes
        else:
            raise Refused(0x31)
        return True

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
        else:
            return struct.pack(">BBI", self.state(), self.position(), self.run_id)
        return b""

    # --- services
    def answer(self, request):
        """None: the power goes."""
        service = request[0]
        if service in (0x11, 0x23, 0x2E, 0x31) and self.session == 1:
            raise Refused(0x7F)
        if service == 0x10 and request[1] in (1, SESSION):
            self.enter(request[1])
            return bytes([0x50, request[1]]) + struct.pack(">HH", 50, 500)
        if service == 0x3E:
            return b"" if request[1] & 0x80 else b"\x7E\0"
        if service == 0x22:
            return b"\x62" + request[1:3] + self.read(struct.unpack(">H", request[1:3])[0])
        if service == 0x23:
            if request[1] != 0x24 or len(request) != 8:
                raise Refused(0x31)
            return b"\x63" + self.memory_at(*struct.unpack(">IH", request[2:]))
        if service == 0x2E:
            return b"\x6E" + request[1:3] if self.write(struct.unpack(">H", request[1:3])[0], request[3:]) else None
        if service == 0x31 and struct.unpack(">H", request[2:4])[0] == ROTATE:
            return b"\x71" + request[1:4] + self.rotate(request[1], request[4:])
        if service == 0x11:
            self.reset_wanted = True
            return b"\x51\x01"
        raise Refused({0x10: 0x12, 0x31: 0x31}.get(service, 0x11))


def main():
    interface, recording, speed, memory, *cuts = sys.argv[1:]
    serve(Ins(recording, float(speed), memory, [int(cut) for cut in cuts]), interface, REQUEST, RESPONSE, FUNCTIONAL)


if __name__ == "__main__":
    main()
