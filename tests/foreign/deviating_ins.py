#!/usr/bin/python3
"""An INS that keeps to its interface, or departs from it in one place: usage deviating_ins.py INTERFACE KEYFILE [DEVIATION]

Written from what `selfcal device describe config/profiles/example.toml` says and from ISO 14229-1 and 15765-2. It does not turn; it
holds the raw data of a short run. DEVIATIONS tells what each deviation is, and which requirement of `selfcal device check` must name it.
"""
import os
import signal
import socket
import struct
import sys
import time
import zlib
from pathlib import Path

from cryptography.hazmat.primitives.ciphers import algorithms
from cryptography.hazmat.primitives.cmac import CMAC

from server import Refused, crc16

REQUEST, RESPONSE, FUNCTIONAL = 0x18DA2AF1, 0x18DAF12A, 0x18DB33F1
EXTENDED = 0x80000000
PAGE_BYTES, SAMPLES_PER_PAGE, PAGES, RUN = 1024, 38, 3, 7
LONGEST_BLOCK = 302
SET_BYTES = 204
N_BS_S = N_CR_S = 1.0
S3_S = 5.0
READ_ONLY = {0xFD00, 0xFD01, 0xFD10, 0xFD12, 0xFD20, 0xFD21, 0xFD30, 0xFD32}
WRITTEN = {0xFD11, 0xFD31}
ROTATE, ERASE, COMMIT, CHECK = 0xE001, 0xE010, 0xE011, 0xE020

DEVIATIONS = {
    "wrong_nrc": ("a service that is none is refused with 0x31", "service.unknown"),
    "length_unchecked": ("TesterPresent with a byte too many is answered", "present.too_long"),
    "late_without_pending": ("a record is told after 3 s without 0x78", "timing.p2"),
    "sequence_error_not_told": ("a key without a seed is called a wrong key", "security.sequence"),
    "suppress_ignored": ("the suppress bit of the sub-function is ignored", "present.suppressed"),
    "block_counter_unchecked": ("any block counter is served", "transfer.counter"),
    "block_counter_wrong": ("blocks are counted from 0 in the response", "transfer.block"),
    "padding_checked": ("requests that are not padded with 0x00 are ignored", "isotp.padding"),
    "sequence_from_zero": ("consecutive frames are numbered from 0", "isotp.sequence"),
    "block_size_ignored": ("the block size of flow control is ignored", "isotp.block_size"),
    "separation_ignored": ("STmin of flow control is ignored", "isotp.separation"),
    "wait_ends": ("flow control WAIT is taken for the end", "isotp.wait"),
    "late_flow_taken": ("flow control is waited for without an end", "isotp.n_bs"),
    "wrong_sequence_taken": ("a frame out of sequence is taken", "isotp.wrong_sequence"),
    "functional_refused": ("a service that is none is refused though all were asked", "functional.unknown"),
    "unknown_did_told": ("an identifier that is none is told, empty", "read.unknown"),
    "record_short": ("the state record is a byte short", "read.state"),
    "seed_constant": ("the seed is always the same", "security.fresh"),
    "lock_stays_open": ("entering a session leaves the lock open", "security.closes"),
    "session_for_ever": ("a session does not end by itself", "session.expires"),
    "present_does_not_keep": ("TesterPresent to all does not keep the session", "session.kept"),
    "routine_in_default_session": ("routines are served in the default session", "session.guards_routines"),
    "read_only_written": ("a record that is only read is written", "write.read_only"),
    "block_too_long": ("blocks are longer than was told", "transfer.block"),
    "set_checksum_unchecked": ("a set with a wrong checksum is taken", "set.checksum"),
    "range_unchecked": ("an upload of pages that are not there begins", "upload.range"),
    "page_checksum_wrong": ("the last two bytes of a page are not its checksum", "transfer.page"),
}


class Bus:
    """ISO 15765-2 of one server."""

    def __init__(self, interface, deviation):
        self.can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        filters = [(i | EXTENDED, 0xDFFFFFFF) for i in (REQUEST, FUNCTIONAL)]
        self.can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"".join(struct.pack("=II", *f) for f in filters))
        self.can.bind((interface,))
        self.deviation = deviation
        self.incoming = self.outgoing = None

    def put(self, data):
        self.can.send(struct.pack("=IB3x8s", RESPONSE | EXTENDED, 8, bytes(data).ljust(8, b"\0")))

    def receive(self, seconds):
        """(message, whether all were asked), or None."""
        self.can.settimeout(seconds)
        try:
            frame = self.can.recv(16)
        except TimeoutError:
            return None
        identifier, length = struct.unpack("=IB", frame[:5])
        return self.take(frame[8:8 + length], identifier & 0x1FFFFFFF == FUNCTIONAL)

    def take(self, data, for_all):
        kind = data[0] >> 4
        if kind == 0:
            length = data[0] & 0xF
            if not 0 < length < len(data) or (self.deviation == "padding_checked" and any(data[1 + length:])):
                return None
            self.incoming = None
            return data[1:1 + length], for_all
        if for_all:
            return None
        if kind == 1:
            length = (data[0] & 0xF) << 8 | data[1]
            if length > 7:
                self.incoming = [length, data[2:], 1, time.monotonic() + N_CR_S]
                self.put([0x30, 0, 0])
        elif kind == 2 and self.incoming:
            return self.take_consecutive(data)
        elif kind == 3 and self.outgoing:
            self.take_flow(data)
        return None

    def take_consecutive(self, data):
        length, message, sequence, deadline = self.incoming
        wrong = data[0] & 0xF != sequence % 16 and self.deviation != "wrong_sequence_taken"
        if wrong or time.monotonic() > deadline:
            self.incoming = None
            return None
        message += data[1:]
        if len(message) >= length:
            self.incoming = None
            return message[:length], False
        self.incoming = [length, message, sequence + 1, time.monotonic() + N_CR_S]
        return None

    def send(self, message):
        self.outgoing = None
        if len(message) <= 7:
            self.put([len(message), *message])
            return
        self.outgoing = [message[6:], 0 if self.deviation == "sequence_from_zero" else 1, time.monotonic() + N_BS_S]
        self.put([0x10 | len(message) >> 8, len(message) & 0xFF, *message[:6]])

    def take_flow(self, data):
        rest, sequence, deadline = self.outgoing
        status, block, separation = data[0] & 0xF, data[1], data[2]
        if time.monotonic() > deadline and self.deviation != "late_flow_taken":
            self.outgoing = None
        elif status == 1 and self.deviation != "wait_ends":
            self.outgoing[2] = time.monotonic() + N_BS_S
        elif status != 0:
            self.outgoing = None
        else:
            if self.deviation == "block_size_ignored":
                block = 0
            sent = 0
            while rest and (block == 0 or sent < block):
                if sent and separation and self.deviation != "separation_ignored":
                    time.sleep(separation / 1e3)
                self.put([0x20 | sequence % 16, *rest[:7]])
                rest, sequence, sent = rest[7:], sequence + 1, sent + 1
            self.outgoing = [rest, sequence, time.monotonic() + N_BS_S] if rest else None


class Ins:
    # Of every service: whether the default session has it, and the bytes of the shortest request.
    SERVICES = {0x10: (True, 2), 0x11: (False, 2), 0x22: (True, 3), 0x27: (False, 2), 0x2E: (False, 4), 0x31: (False, 4),
                0x35: (False, 9), 0x36: (False, 2), 0x37: (False, 1), 0x3E: (True, 2)}

    def __init__(self, key, deviation):
        self.key, self.deviation = key, deviation
        self.schedule, self.inactive = None, None
        values = [1e-3 * k for k in range(24)]
        body = struct.pack("<II24d", 0, 0, *values)
        self.in_force = body + struct.pack("<I", zlib.crc32(body))
        self.power_cycles = 0
        self.power_on()

    def power_on(self):
        self.power_cycles += 1
        self.session, self.open, self.seed, self.upload = 1, False, None, None

    def enter(self, session):
        self.session, self.seed, self.upload = session, None, None
        if self.deviation != "lock_stays_open":
            self.open = False

    def page(self, number):
        sample = struct.pack("<ii", 0, 9000000) + b"\x01\0\0" * 6
        head = number.to_bytes(3, "little") + struct.pack("<BIhBx", SAMPLES_PER_PAGE, RUN, 400, int(number == PAGES - 1))
        body = (head + sample * SAMPLES_PER_PAGE).ljust(PAGE_BYTES - 2, b"\0")
        return body + struct.pack("<H", crc16(body) ^ (self.deviation == "page_checksum_wrong"))

    def read(self, did):
        if did == 0xFD01 and self.deviation == "late_without_pending":
            time.sleep(3.0)
        if did == 0xFD11 and self.schedule is None or did == 0xFD31 and self.inactive is None:
            raise Refused(0x22)
        records = {
            0xFD00: b"DEVIATING", 0xFD01: b"python 1",
            0xFD10: struct.pack("<HHII", 1 | 3 << 4, 0, RUN, self.power_cycles), 0xFD11: self.schedule,
            0xFD12: struct.pack("<iii", 400000000, 1160000000, 5000),
            0xFD20: struct.pack("<BI", 0x5A, RUN) + 2 * PAGES.to_bytes(3, "little") + struct.pack("<HI", 0, PAGES * SAMPLES_PER_PAGE),
            0xFD21: struct.pack("<fdd", 50.0, 0.1, 2e-3), 0xFD30: self.in_force, 0xFD31: self.inactive, 0xFD32: self.in_force}
        if did in records:
            return records[did][:-1] if did == 0xFD10 and self.deviation == "record_short" else records[did]
        if self.deviation == "unknown_did_told":
            return b""
        raise Refused(0x31)

    def write(self, did, record):
        if did in READ_ONLY and self.deviation == "read_only_written":
            return
        if did not in WRITTEN:
            raise Refused(0x31)
        if not self.open:
            raise Refused(0x33)
        if did == 0xFD11:
            count = struct.unpack("<H", record[2:4])[0] if len(record) >= 4 else -1
            if len(record) != 4 + 8 * count:
                raise Refused(0x13)
            self.schedule = record
            return
        if len(record) != SET_BYTES:
            raise Refused(0x13)
        if zlib.crc32(record[:200]) != struct.unpack("<I", record[200:])[0] and self.deviation != "set_checksum_unchecked":
            raise Refused(0x31)
        if self.inactive is not None:
            raise Refused(0x72)
        self.inactive = record

    def routine(self, action, number, option):
        if number not in (ROTATE, ERASE, COMMIT, CHECK):
            raise Refused(0x31)
        if not self.open and not (self.session == 1 and self.deviation == "routine_in_default_session"):
            raise Refused(0x33)
        if action not in (1, 2, 3) or (action != 1 and number in (ERASE, COMMIT)):
            raise Refused(0x12)
        if action == 3:
            return struct.pack("<BBI", 1, 0, RUN)
        if number == ERASE:
            if option:
                raise Refused(0x13)
            self.inactive = None
        elif number == COMMIT:
            if len(option) != 4:
                raise Refused(0x13)
            if self.inactive is None or option != self.inactive[200:]:
                raise Refused(0x31)
        else:
            raise Refused(0x22)  # this one does not turn
        return b""

    def security(self, request):
        if request[1] == 0x11:
            if len(request) != 2:
                raise Refused(0x13)
            self.seed = b"\x5A" * 16 if self.deviation == "seed_constant" else os.urandom(16)
            if self.open:
                self.seed = bytes(16)
            return b"\x67\x11" + self.seed
        if request[1] != 0x12:
            raise Refused(0x12)
        if self.seed is None:
            raise Refused(0x35 if self.deviation == "sequence_error_not_told" else 0x24)
        if len(request) != 18:
            raise Refused(0x13)
        self.seed, self.open = None, self.key_to(self.seed) == request[2:]
        if not self.open:
            raise Refused(0x35)
        return b"\x67\x12"

    def key_to(self, seed):
        mac = CMAC(algorithms.AES(bytes.fromhex(self.key)))
        mac.update(seed)
        return mac.finalize()

    def begin_upload(self, request):
        address, size = int.from_bytes(request[3:6], "big"), int.from_bytes(request[6:9], "big")
        beyond = address + size > PAGES * PAGE_BYTES and self.deviation != "range_unchecked"
        if request[1:3] != b"\0\x33" or size == 0 or address % PAGE_BYTES or size % PAGE_BYTES or beyond:
            raise Refused(0x31)
        data = b"".join(self.page(k) for k in range(address // PAGE_BYTES, (address + size) // PAGE_BYTES))
        step = LONGEST_BLOCK - (1 if self.deviation == "block_too_long" else 2)
        self.upload = [[data[k:k + step] for k in range(0, len(data), step)], 0]
        return b"\x75\x40" + struct.pack(">I", LONGEST_BLOCK)

    def transfer(self, request):
        if self.upload is None:
            raise Refused(0x24)
        blocks, done = self.upload
        if request[1] == done + 1 or self.deviation == "block_counter_unchecked":
            if done == len(blocks):
                raise Refused(0x24)
            done += 1
            self.upload[1] = done
        elif request[1] != done or done == 0:
            raise Refused(0x73)
        told = request[1] - 1 if self.deviation == "block_counter_wrong" else request[1]
        return bytes([0x76, told]) + blocks[done - 1]

    def answer(self, request):
        service, suppress = request[0], False
        if service not in self.SERVICES:
            raise Refused(0x31 if self.deviation == "wrong_nrc" else 0x11)
        in_default, shortest = self.SERVICES[service]
        exempt = service == 0x31 and self.deviation == "routine_in_default_session"
        if self.session == 1 and not in_default and not exempt:
            raise Refused(0x7F)
        if len(request) < shortest:
            raise Refused(0x13)
        if service in (0x10, 0x11, 0x27, 0x31, 0x3E):
            suppress = bool(request[1] & 0x80)
            request = bytes([service, request[1] & 0x7F]) + request[2:]
        response = self.positive(request)
        return b"" if suppress and self.deviation != "suppress_ignored" else response

    def positive(self, request):
        service = request[0]
        if service == 0x10:
            if request[1] not in (1, 3):
                raise Refused(0x12)
            if len(request) != 2:
                raise Refused(0x13)
            self.enter(request[1])
            return bytes([0x50, request[1]]) + struct.pack(">HH", 50, 500)
        if service == 0x3E:
            if request[1] != 0:
                raise Refused(0x12)
            if len(request) != 2 and self.deviation != "length_unchecked":
                raise Refused(0x13)
            return b"\x7E\0"
        if service == 0x22:
            if len(request) != 3:
                raise Refused(0x13)
            return b"\x62" + request[1:3] + self.read(struct.unpack(">H", request[1:3])[0])
        if service == 0x27:
            return self.security(request)
        if service == 0x2E:
            self.write(struct.unpack(">H", request[1:3])[0], request[3:])
            return b"\x6E" + request[1:3]
        if service == 0x31:
            return b"\x71" + request[1:4] + self.routine(request[1], struct.unpack(">H", request[2:4])[0], request[4:])
        if service == 0x35:
            if len(request) != 9:
                raise Refused(0x13)
            return self.begin_upload(request)
        if service == 0x36:
            return self.transfer(request)
        if service == 0x37:
            if self.upload is None:
                raise Refused(0x24)
            self.upload = None
            return b"\x77"
        if not self.open:
            raise Refused(0x33)
        if request[1] != 1:
            raise Refused(0x12)
        self.reset_wanted = True
        return b"\x51\x01"

    reset_wanted = False


def main():
    interface, key_file, *more = sys.argv[1:]
    deviation = more[0] if more else None
    if deviation is not None and deviation not in DEVIATIONS:
        sys.exit(f"no such deviation: {deviation}")
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(0))
    ins = Ins(Path(key_file).read_text(encoding="ascii").strip(), deviation)
    ins.key_to(bytes(16))  # the first one loads a library, which takes its time
    bus = Bus(interface, deviation)
    print("ready", flush=True)
    heard = time.monotonic()
    while True:
        got = bus.receive(0.1)
        if time.monotonic() - heard > S3_S and ins.session != 1 and deviation != "session_for_ever":
            ins.enter(1)
        if got is None:
            continue
        request, for_all = got
        if not (for_all and deviation == "present_does_not_keep"):
            heard = time.monotonic()
        try:
            response = ins.answer(request)
        except Refused as refusal:
            code = refusal.args[0]
            unheard = for_all and code in (0x11, 0x12, 0x31, 0x7E, 0x7F) and deviation != "functional_refused"
            response = b"" if unheard else bytes([0x7F, request[0], code])
        if response:
            bus.send(response)
        heard = max(heard, time.monotonic()) if not for_all else heard
        if ins.reset_wanted:
            ins.reset_wanted = False
            time.sleep(0.3)
            ins.power_on()


if __name__ == "__main__":
    main()
