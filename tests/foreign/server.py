"""What the servers of this folder share, whatever they speak: refusals, checksums, a gimbal that turns by the clock, the dialogue."""
import signal
import struct
import sys
import time

import isotp

START_UP_S = 0.5
S3_S = 5.0


class Refused(Exception):
    """With the negative response code."""


def crc16(data):
    """CCITT: polynomial 0x1021, from 0xFFFF."""
    crc = 0xFFFF
    for byte in data:
        crc ^= byte << 8
        for _ in range(8):
            crc = (crc << 1 ^ 0x1021 if crc & 0x8000 else crc << 1) & 0xFFFF
    return crc


def _crc32c_table():
    for byte in range(256):
        for _ in range(8):
            byte = byte >> 1 ^ (0x82F63B78 if byte & 1 else 0)
        yield byte


_CRC32C = list(_crc32c_table())


def crc32c(data):
    """Castagnoli, reflected, initial value and final XOR 0xFFFFFFFF."""
    crc = 0xFFFFFFFF
    for byte in data:
        crc = crc >> 8 ^ _CRC32C[(crc ^ byte) & 0xFF]
    return crc ^ 0xFFFFFFFF


class Turning:
    """A gimbal that knows the one motion of its samples. Who derives from it has STARTING, IDLE, ROTATING, COMPLETE and ABORTED as it tells them,
    and SAMPLES_PER_PAGE; rate and samples; and, once a schedule was written, dwells_s and move_s."""

    speed = 1.0
    ready_at = 0.0
    rotation = stopped = None
    rested = True
    reset_wanted = False

    def at_rest(self):
        """After power was switched on."""
        self.ready_at = time.monotonic() + START_UP_S
        self.stopped, self.rested = None, True

    def turn(self):
        self.rotation, self.stopped, self.rested = time.monotonic(), None, False

    def stop(self):
        self.stopped = time.monotonic()

    def samples_so_far(self):
        if self.rotation is None:
            return 0
        end = self.stopped if self.stopped is not None else time.monotonic()
        return min(len(self.samples), int((end - self.rotation) * self.speed * self.rate))

    def state(self):
        if time.monotonic() < self.ready_at:
            return self.STARTING
        if self.stopped is not None:
            return self.ABORTED
        if self.rotation is None or self.rested:
            return self.IDLE
        return self.ROTATING if self.samples_so_far() < len(self.samples) else self.COMPLETE

    def pages_written(self):
        done = self.samples_so_far()
        over = self.state() != self.ROTATING
        return -(-done // self.SAMPLES_PER_PAGE) if over else done // self.SAMPLES_PER_PAGE

    def position(self):
        """1 is the first; a move belongs to the position that it leads to."""
        if self.state() != self.ROTATING:
            return 0
        elapsed, end = self.samples_so_far() / self.rate, 0.0
        for number, dwell in enumerate(self.dwells_s, 1):
            end += dwell
            if elapsed < end:
                return number
            end += self.move_s
        return len(self.dwells_s)


def serve(ins, interface, request_id, response_id, functional_id, wide=True):
    """Until the process is ended; `wide`: identifiers of 29 bits. `ins.answer(request)`: the response, empty for none, None where the power goes; raises Refused."""
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    bus = isotp.Transport(interface, request_id, response_id, functional_id, isotp.EXTENDED if wide else 0)
    print("ready", flush=True)
    heard = time.monotonic()
    while True:
        got = bus.receive(0.1)
        if ins.session != 1 and time.monotonic() - heard > S3_S:
            ins.enter(1)
        if got is None or not got[0] or time.monotonic() < ins.ready_at:
            continue
        request, for_all = got
        heard = time.monotonic()
        try:
            response = ins.answer(request)
        except Refused as refusal:
            response = b"" if for_all else bytes([0x7F, request[0], refusal.args[0]])
        except (IndexError, struct.error):  # a request that is too short to be read: incorrectMessageLengthOrInvalidFormat
            response = b"" if for_all else bytes([0x7F, request[0], 0x13])
        if response is None:
            time.sleep(ins.AWAY_S)
            ins.power_on()
        elif response:
            bus.send(response)
        if ins.reset_wanted:
            ins.reset_wanted = False
            ins.power_on()
