"""Extended and mixed addressing (ISO 15765-2): a whole calibration with the virtual INS under each, with every frame's first byte looked
at, and scapy's ISO-TP, which nobody here wrote, against the same INS."""
import socket
import struct
import threading
import unittest

from scapy.config import conf

conf.contribs["ISOTP"] = {"use-can-isotp-kernel-module": False}

from scapy.contrib.cansocket_native import NativeCANSocket  # noqa: E402
from scapy.contrib.isotp import ISOTPSoftSocket  # noqa: E402

import profile_case  # noqa: E402

EXTENDED_ID = 0x80000000
RECEIVE_BUFFER_FORCE = 33  # SO_RCVBUFFORCE, which Python does not name


class Listener(threading.Thread):
    """Counts, of each identifier and first byte, the frames on the bus."""

    def __init__(self, interface):
        super().__init__(daemon=True)
        self.can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.can.setsockopt(socket.SOL_SOCKET, RECEIVE_BUFFER_FORCE, 4 << 20)
        self.can.bind((interface,))
        self.can.settimeout(0.2)
        self.heard, self.going = {}, True

    def run(self):
        while self.going:
            try:
                frame = self.can.recv(16)
            except TimeoutError:
                continue
            key = struct.unpack("=I", frame[:4])[0], frame[8]
            self.heard[key] = self.heard.get(key, 0) + 1

    def end(self):
        self.going = False
        self.join()
        self.can.close()
        return self.heard


class Addressing(profile_case.UnderProfile):
    def under(self, bus):
        unit = self.bench_of("selfcal.toml")
        profile = unit.folder / "addressed.toml"
        profile.write_text(profile_case.addressed(bus), encoding="utf-8")
        unit.ins_keys["profile"] = str(profile)
        unit.sim_options = ["--profile", profile]
        unit.write_daemon_config([unit], {})
        return unit.start()

    def calibrated(self, bus, status, allowed, wanted):
        unit = self.under(bus)
        listener = Listener(unit.interface)
        listener.start()
        run = self.calibrate(unit)
        heard = listener.end()
        diagnostic = {key: count for key, count in heard.items() if key[0] & ~EXTENDED_ID not in (status, status + 1)}
        self.assertEqual({key for key in diagnostic if key not in allowed}, set(), diagnostic)
        for key in wanted:
            self.assertGreater(diagnostic.get(key, 0), 0, diagnostic)
        print("frames by identifier and first byte:", {f"{i:08X} {b:02X}": n for (i, b), n in diagnostic.items()}, flush=True)
        return unit, run

    def test_addressing(self):
        ours = self.bench_of("selfcal.toml").start()
        own = self.calibrate(ours)
        ours.stop()

        requests, responses, to_all = (0x6F1, 0x12), (0x612, 0xF1), (0x6F1, 0xDF)
        unit, run = self.calibrated(profile_case.EXTENDED, 0x650, {requests, responses, to_all}, {requests, responses, to_all})
        self.assert_same(run, own, "extended addressing")
        self.scapy_reads(unit)
        unit.stop()

        of_mixed = {(i | EXTENDED_ID, 0x5C) for i in (0x18CE2AF1, 0x18CEF12A, 0x18CD33F1)}
        unit, run = self.calibrated(profile_case.MIXED, 0x650, of_mixed, of_mixed)
        self.assert_same(run, own, "mixed addressing of 29 bits")
        unit.stop()

    def scapy_reads(self, unit):
        link = NativeCANSocket(unit.interface, can_filters=[{"can_id": 0x612, "can_mask": 0x7FF}])
        peer = ISOTPSoftSocket(link, tx_id=0x6F1, rx_id=0x612, ext_address=0x12, rx_ext_address=0xF1, padding=True, bs=8)
        self.addCleanup(peer.close)
        for did, length in ((0xF18C, None), (0x0210, 263)):  # a single frame or two, and the set in force
            peer.send(bytes([0x22, did >> 8, did & 0xFF]))
            answers = peer.sniff(count=1, timeout=10)
            self.assertEqual(len(answers), 1, f"no answer for {did:04X}")
            data = bytes(answers[0])
            self.assertEqual(data[:3], bytes([0x62, did >> 8, did & 0xFF]))
            if length:
                self.assertEqual(len(data), length)
        self.assertEqual(data[3:7], b"SCCO")
        print("scapy reads the set in force by extended addressing:", len(data), "bytes", flush=True)


if __name__ == "__main__":
    unittest.main()
