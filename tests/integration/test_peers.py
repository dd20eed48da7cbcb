"""The virtual INS against a tester that nobody here wrote: scapy's ISO-TP and UDS. Identification, unlock, upload of
64 KiB compared byte for byte with the FLASH, negative responses; and tshark reads the log of it without complaint."""
import os
import secrets
import struct
import subprocess
import tempfile
import time
import unittest
from pathlib import Path

from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC
from scapy.config import conf

conf.contribs["ISOTP"] = {"use-can-isotp-kernel-module": False}
conf.contribs["CANSocket"] = {"use-python-can": False}
from scapy.contrib.automotive.uds import UDS  # noqa: E402
from scapy.contrib.cansocket_native import NativeCANSocket  # noqa: E402
from scapy.contrib.isotp import ISOTPSoftSocket  # noqa: E402

BIN = Path(os.environ["SELFCAL_BIN"])
PAGE, RING_START = 4096, 16 * 4096
SECURITY_DENIED, OUT_OF_RANGE, INVALID_KEY, NOT_SUPPORTED = 0x33, 0x31, 0x35, 0x11


class ScapyTester(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="selfcal_peers.")
        here = Path(cls.folder.name)
        cls.flash, cls.log = here / "flash.bin", here / "bus.log"
        cls.key = secrets.token_bytes(16)
        (here / "ins.key").write_text(cls.key.hex() + "\n", encoding="ascii")
        (here / "sim.toml").write_text('serial = "PEER-0042"\nsample_rate_hz = 1000.0\n', encoding="ascii")
        # 640 and 648 alone: told to read ISO-TP, tshark takes the status frames for it too.
        with open(cls.log, "wb") as log:
            cls.candump = subprocess.Popen(["candump", "-L", "vcan0,640:7F7"], stdout=log)
        cls.ins = subprocess.Popen([BIN / "sim_ins", "--interface", "vcan0", "--config", here / "sim.toml", "--key",
                                    here / "ins.key", "--flash", cls.flash, "--speed", os.environ.get("PEER_SPEED", "2")])
        time.sleep(3)
        cls.socket = ISOTPSoftSocket(
            NativeCANSocket("vcan0", can_filters=[{"can_id": 0x648, "can_mask": 0x7FF}]), tx_id=0x640, rx_id=0x648,
            basecls=UDS, padding=True, bs=8)   # blocks: an interpreter does not keep up with a bus

    @classmethod
    def tearDownClass(cls):
        cls.socket.close()
        for process in (cls.ins, cls.candump):
            process.terminate()
            process.wait(10)
        cls.folder.cleanup()

    def ask(self, request, patience=6, again=0):
        """The positive response's bytes, or the NRC as a number."""
        answer = self.socket.sr1(UDS(bytes(request)), timeout=patience, verbose=False)
        while answer is not None and bytes(answer)[0] == 0x7F and bytes(answer)[2] == 0x78:
            answer = self.socket.sniff(count=1, timeout=patience)[0]
        if answer is None and again:
            return self.ask(request, patience, again - 1)
        self.assertIsNotNone(answer, f"no answer to {bytes(request).hex()}")
        answer = bytes(answer)
        if answer[0] == 0x7F:
            self.assertEqual(answer[1], request[0])
            return answer[2]
        self.assertEqual(answer[0], request[0] + 0x40)
        return answer

    def unlock(self):
        self.ask([0x10, 3])
        seed = self.ask([0x27, 1])[2:]
        mac = CMAC(AES(self.key))
        mac.update(seed)
        self.assertEqual(self.ask(bytes([0x27, 2]) + mac.finalize()), bytes([0x67, 2]))

    def test_1_identification(self):
        self.assertEqual(self.ask([0x22, 0xF1, 0x8C], again=5).rstrip(b"\0"), b"\x62\xf1\x8cPEER-0042")

    def test_2_refusals(self):
        self.ask([0x10, 3])
        self.assertEqual(self.ask([0x31, 1, 3, 1, 0, 0, 0, 1]), SECURITY_DENIED)
        self.assertEqual(self.ask([0x22, 0x12, 0x34]), OUT_OF_RANGE)
        self.assertEqual(self.ask([0x85, 1]), NOT_SUPPORTED)
        self.ask([0x27, 1])
        self.assertEqual(self.ask(bytes([0x27, 2]) + bytes(16)), INVALID_KEY)

    def test_3_upload_of_64_kib(self):
        self.unlock()
        schedule = bytes([1]) + struct.pack(">Iiii", 5000, 0, 0, 6000)   # one position, 6 s: 41 pages
        self.ask(bytes([0x2E, 2, 1]) + schedule)
        self.ask([0x31, 1, 3, 1, 0, 0, 0, 1])
        end = time.monotonic() + 30
        while struct.unpack(">I", self.ask([0x22, 2, 0x20])[11:15])[0] < 16:
            self.assertLess(time.monotonic(), end, "no pages")
            time.sleep(0.1)
        size = 16 * PAGE
        opened = self.ask(bytes([0x35, 0, 0x44]) + struct.pack(">II", 0, size))
        self.assertEqual(opened[1] >> 4, 4)
        data, block = b"", 1
        while len(data) < size:
            answer = self.ask([0x36, block], patience=3, again=3)   # ISO 14229: the same block may be asked for again
            self.assertEqual(answer[1], block)
            data += answer[2:]
            block = (block + 1) & 0xFF
        self.ask([0x37])
        self.assertEqual(data, self.flash.read_bytes()[RING_START:RING_START + size])

    def test_4_tshark_finds_nothing_malformed(self):
        time.sleep(0.5)
        command = ["tshark", "-r", str(self.log), "-d", "can.subdissector,iso15765", "-d",
                   "iso15765.subdissector,uds"]
        services = subprocess.run([*command, "-Y", "uds", "-T", "fields", "-e", "uds.sid"], capture_output=True,
                                  text=True, check=True).stdout.split()
        self.assertGreater(len(services), 30)   # 17 blocks and more, asked and answered
        broken = subprocess.run([*command, "-Y", "_ws.malformed"], capture_output=True, text=True, check=True).stdout
        self.assertEqual(broken, "")


if __name__ == "__main__":
    unittest.main()
