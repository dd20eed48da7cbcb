#!/usr/bin/python3
"""memory_ins.py with a lock of its own algorithm: usage as there. The key to a seed of 6 bytes has 4: each bit of the seed that is set turns
a word by one bit to the left, and every byte is mixed into it. What opens it is a program of the user's: key_of_locked.py."""
import os
import struct
import sys

import memory_ins
from server import Refused, serve

GIVE, TAKE = 0x05, 0x06
WORD = 0x5EC0DE17


def key_to(seed):
    word = WORD
    for byte in seed:
        turn = byte.bit_count()
        word = ((word << turn | word >> 32 - turn) & 0xFFFFFFFF) ^ byte * 0x01010101
    return struct.pack(">I", word)


class Ins(memory_ins.Ins):
    opened, seed = False, None

    def enter(self, session):
        super().enter(session)
        self.opened, self.seed = False, None

    def answer(self, request):
        if request[0] == 0x27:
            return self.security(request)
        if request[0] in (0x11, 0x23, 0x2E, 0x31) and self.session != 1 and not self.opened:
            raise Refused(0x33)
        return super().answer(request)

    def security(self, request):
        if self.session == 1:
            raise Refused(0x7F)
        if request[1] == GIVE and len(request) == 2:
            self.seed = bytes(6) if self.opened else os.urandom(6)
            return bytes([0x67, GIVE]) + self.seed
        if request[1] == TAKE and self.seed is None:
            raise Refused(0x24)
        if request[1] != TAKE or len(request) != 6:
            raise Refused(0x13 if request[1] in (GIVE, TAKE) else 0x12)
        seed, self.seed = self.seed, None
        self.opened = request[2:] == key_to(seed)
        if not self.opened:
            raise Refused(0x35)
        return bytes([0x67, TAKE])


def main():
    interface, recording, speed, memory = sys.argv[1:]
    ins = Ins(recording, float(speed), memory, [])
    serve(ins, interface, memory_ins.REQUEST, memory_ins.RESPONSE, memory_ins.FUNCTIONAL)


if __name__ == "__main__":
    main()
