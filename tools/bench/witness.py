"""A second opinion on what the INS holds: reads its coefficients over CAN, classic or FD, with nothing of our C++
code, so that a fault common to service and virtual INS does not hide."""
import math
import socket
import struct
import time

REQUEST, RESPONSE = 0x640, 0x648
COEFFICIENTS_IN_FORCE = 0x0210

MICRO_G, ARCSECOND = 9.80665e-6, math.pi / 648000
# Order of the record, which is the order of the 24 parameters, in SI per unit of the interfaces.
NAMES_AND_UNITS = (
    [(f"accel_bias_{a}", MICRO_G) for a in "xyz"]
    + [(f"gyro_drift_{a}", math.pi / 180 / 3600) for a in "xyz"]
    + [(f"accel_scale_{s}_{a}", 1e-6) for s in ("pos", "neg") for a in "xyz"]
    + [(f"accel_misalignment_{p}", ARCSECOND) for p in ("yx", "zx", "zy")]
    + [(f"gyro_scale_{a}", 1e-6) for a in "xyz"]
    + [(f"gyro_misalignment_{p}", ARCSECOND) for p in ("xy", "xz", "yx", "yz", "zx", "zy")]
)


class Silence(Exception):
    """The INS did not answer, or not so that it can be understood."""


def _receive(can, end):
    while True:
        can.settimeout(max(0.01, end - time.monotonic()))
        try:
            frame = can.recv(72)  # struct canfd_frame; a classic frame is 16 bytes
        except TimeoutError as error:
            raise Silence("no answer") from error
        identifier, length = struct.unpack("=IB", frame[:5])
        if identifier & 0x1FFFFFFF == RESPONSE:
            return frame[8:8 + length]


def _send(can, payload):
    can.send(struct.pack("=IB3x8s", REQUEST, 8, bytes(payload).ljust(8, b"\xaa")))


def read_did(interface, did, seconds=5.0):
    """ReadDataByIdentifier: the record's bytes."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as can:
        can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", RESPONSE, 0x1FFFFFFF))
        can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FD_FRAMES, 1)
        can.bind((interface,))
        _send(can, [3, 0x22, did >> 8, did & 0xFF])
        end = time.monotonic() + seconds
        while True:
            frame = _receive(can, end)
            if frame[0] == 0:  # single frame longer than classic CAN can carry
                answer = frame[2:2 + frame[1]]
            elif frame[0] >> 4 == 0:
                answer = frame[1:1 + frame[0]]
            else:
                length = (frame[0] & 0xF) << 8 | frame[1]
                answer = bytearray(frame[2:])
                _send(can, [0x30, 0, 0])  # clear to send all of it
                count = 1
                while len(answer) < length:
                    frame = _receive(can, end)
                    if frame[0] != 0x20 | count % 16:
                        raise Silence(f"frame {frame.hex()} where number {count % 16} was due")
                    answer += frame[1:]
                    count += 1
                answer = bytes(answer[:length])
            if answer[:3] == bytes([0x7F, 0x22, 0x78]):
                continue  # asks for patience
            if answer[:3] != bytes([0x62, did >> 8, did & 0xFF]):
                raise Silence(f"answer {answer[:8].hex()} to a request for DID {did:#06x}")
            return answer[3:]


def coefficients_in_force(interface, patience_s=20.0):
    """(version, {name: value in the interfaces' unit}). Asks again for a while: an INS that starts, or whose bus has
    just come back, does not answer yet."""
    give_up = time.monotonic() + patience_s
    while True:
        try:
            record = read_did(interface, COEFFICIENTS_IN_FORCE, seconds=1.0)
            break
        except (Silence, OSError):
            if time.monotonic() > give_up:
                raise
            time.sleep(0.2)
    if len(record) != 260 or record[:4] != b"SCCO":
        raise Silence(f"a coefficient record of {len(record)} bytes that begins with {record[:4].hex()}")
    version, = struct.unpack(">I", record[8:12])
    values = struct.unpack(">24d", record[52:244])
    return version, {name: value / unit for (name, unit), value in zip(NAMES_AND_UNITS, values)}
