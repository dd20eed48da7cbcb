"""Peers that nobody here wrote, on real SocketCAN: scapy's ISO-TP and UDS client against the virtual INS, our client
against scapy's ECU, the kernel's ISO-TP against ours where the kernel has it, and tshark over the log of a whole
calibration. Nothing here depends on the machine's speed: every time-out is stretched, and what an interpreter loses it
asks for again, as ISO 14229 lets it."""
import secrets
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import case
import h5py
from cryptography.hazmat.primitives.ciphers.algorithms import AES
from cryptography.hazmat.primitives.cmac import CMAC
from scapy.config import conf

conf.contribs["ISOTP"] = {"use-can-isotp-kernel-module": False}
conf.contribs["CANSocket"] = {"use-python-can": False}
from scapy.contrib.automotive.ecu import EcuAnsweringMachine, EcuResponse  # noqa: E402
from scapy.contrib.automotive.uds import UDS  # noqa: E402
from scapy.contrib.cansocket_native import NativeCANSocket  # noqa: E402
from scapy.contrib.isotp import ISOTPSoftSocket  # noqa: E402

PAGE, RING_START = 4096, 16 * 4096
REQUEST, RESPONSE = 0x640, 0x648
PATIENCE = 20.0   # times the standard's time-outs
WRONG_LENGTH, SECURITY_DENIED, OUT_OF_RANGE, INVALID_KEY, NOT_SUPPORTED = 0x13, 0x33, 0x31, 0x35, 0x11
WRONG_SESSION, WRONG_BLOCK = 0x7F, 0x73
# ISO-TP and UDS for every frame of the log; other frames are taken out of it before.
AS_UDS = ("-d", "can.subdissector,iso15765", "-d", "iso15765.subdissector,uds")


def isotp_socket(interface, transmit, receive, **more):
    link = NativeCANSocket(interface, can_filters=[{"can_id": receive, "can_mask": 0x7FF}])
    # Python takes what the kernel kept for it; the default of 278 frames is less than one long message.
    link.ins.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUFFORCE if hasattr(socket, "SO_RCVBUFFORCE") else 33, 4 << 20)
    made = ISOTPSoftSocket(link, tx_id=transmit, rx_id=receive, basecls=UDS, padding=True, **more)
    made.impl.fc_timeout = made.impl.cf_timeout = PATIENCE
    return made


def tshark(log, *arguments):
    done = subprocess.run(["tshark", "-r", str(log), *AS_UDS, *arguments], capture_output=True, text=True, check=True,
                          timeout=300)
    return done.stdout.split()


class ScapyAsTester(case.OnBench):
    def setUp(self):
        self.unit = self.bench(speed=20.0, sim={"serial": "PEER-0042", "sample_rate_hz": 1000.0},
                               sim_options=["--patience", PATIENCE])
        self.unit.start_ins()
        # Blocks of 8: an interpreter is no match for a bus.
        self.socket = isotp_socket(self.unit.interface, REQUEST, RESPONSE, bs=8)
        self.addCleanup(self.unit.stop)
        self.addCleanup(self.socket.close)

    def ask(self, request, tries=5):
        """The positive response's bytes, or the NRC as a number."""
        for _ in range(tries):
            answer = self.socket.sr1(UDS(bytes(request)), timeout=15, verbose=False)
            if answer is not None:
                break
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
        mac = CMAC(AES(bytes.fromhex(self.unit.key_file.read_text(encoding="ascii"))))
        mac.update(seed)
        self.assertEqual(self.ask(bytes([0x27, 2]) + mac.finalize(), tries=1), bytes([0x67, 2]))

    def test_identification_and_refusals(self):
        self.assertEqual(self.ask([0x22, 0xF1, 0x8C]).rstrip(b"\0"), b"\x62\xf1\x8cPEER-0042")
        self.assertEqual(self.ask([0x31, 1, 3, 1, 0, 0, 0, 1]), WRONG_SESSION)
        self.ask([0x10, 3])
        self.assertEqual(self.ask([0x31, 1, 3, 1, 0, 0, 0, 1]), SECURITY_DENIED)
        self.assertEqual(self.ask([0x22, 0x12, 0x34]), OUT_OF_RANGE)
        self.assertEqual(self.ask([0x22, 0xF1]), WRONG_LENGTH)
        self.assertEqual(self.ask([0x85, 1]), NOT_SUPPORTED)
        self.ask([0x27, 1])
        self.assertEqual(self.ask(bytes([0x27, 2]) + bytes(16), tries=1), INVALID_KEY)

    def test_upload_of_64_kib(self):
        self.unlock()
        schedule = bytes([1]) + struct.pack(">Iiii", 5000, 0, 0, 6000)   # one position, 6 s: 41 pages
        self.ask(bytes([0x2E, 2, 1]) + schedule)
        self.ask([0x31, 1, 3, 1, 0, 0, 0, 1], tries=1)
        end = time.monotonic() + 120
        while struct.unpack(">I", self.ask([0x22, 2, 0x20])[11:15])[0] < 16:
            self.assertLess(time.monotonic(), end, "no pages")
            time.sleep(0.1)
        size = 16 * PAGE
        opened = self.ask(bytes([0x35, 0, 0x44]) + struct.pack(">II", 0, size))
        self.assertEqual(opened[1] >> 4, 4)
        self.assertEqual(self.ask([0x36, 7]), WRONG_BLOCK)
        data, block = b"", 1
        while len(data) < size:
            answer = self.ask([0x36, block])   # ISO 14229: the same block may be asked for again
            self.assertIsInstance(answer, bytes, f"block {block}: {answer}")
            self.assertEqual(answer[1], block)
            data += answer[2:]
            block = (block + 1) & 0xFF
        self.ask([0x37])
        self.assertEqual(data, (self.unit.folder / "flash.bin").read_bytes()[RING_START:RING_START + size])


class ScapyAsInstrument(unittest.TestCase):
    def test_our_client_against_scapys_ecu(self):
        block, record = secrets.token_bytes(4093), secrets.token_bytes(300)
        heard = []

        def to(request, keep=False):
            def answers(_, heard_request):
                if keep and bytes(heard_request).startswith(request):
                    heard.append(bytes(heard_request))
                return bytes(heard_request).startswith(request)
            return answers

        known = [
            EcuResponse(responses=UDS(b"\x62\xf1\x8cSCAPY-1"), answers=to(b"\x22\xf1\x8c")),
            EcuResponse(responses=UDS(b"\x76\x01" + block), answers=to(b"\x36\x01")),
            EcuResponse(responses=UDS(b"\x6e\x02\x01"), answers=to(b"\x2e\x02\x01", keep=True)),
            # The answer after two response-pending.
            EcuResponse(responses=[UDS(b"\x7f\x31\x78"), UDS(b"\x7f\x31\x78"), UDS(b"\x71\x01\x03\x01")],
                        answers=to(b"\x31\x01\x03\x01")),
            EcuResponse(responses=UDS(b"\x7f\x31\x22"), answers=to(b"\x31\x01\x03\x02")),
        ]
        link = isotp_socket("vcan1", RESPONSE, REQUEST)
        self.addCleanup(link.close)
        ecu = EcuAnsweringMachine(supported_responses=known, main_socket=link, basecls=UDS, verbose=False)
        requests = ["22f18c", "3601", "2e0201" + record.hex(), "3101030100000001", "31010302", "2212ab"]
        listening = threading.Thread(target=ecu, kwargs={"count": len(requests), "timeout": 120}, daemon=True)
        listening.start()
        done = subprocess.run([case.bench.BIN / "uds_tester", "vcan1", "200", *requests], capture_output=True,
                              text=True, timeout=180, check=False)
        self.assertEqual((done.returncode, done.stderr), (0, ""))
        self.assertEqual(done.stdout.splitlines(), [
            "62f18c" + b"SCAPY-1".hex(),
            "7601" + block.hex(),
            "6e0201",
            "71010301",
            "negative conditionsNotCorrect (0x22)",
            "negative generalReject (0x10)",   # scapy's answer to whatever it does not know
        ])
        self.assertEqual(heard, [b"\x2e\x02\x01" + record])
        listening.join(30)


class KernelAsTester(case.OnBench):
    def setUp(self):
        try:
            socket.socket(socket.AF_CAN, socket.SOCK_DGRAM, socket.CAN_ISOTP).close()
        except OSError as error:
            self.skipTest(f"this kernel has no can-isotp: {error}")

    def test_isotpsend_and_isotprecv(self):
        unit = self.bench(interface="vcan2", sim={"serial": "KERNEL-1"}, sim_options=["--patience", PATIENCE])
        unit.start_ins()
        time.sleep(1.0)   # an INS that starts hears nothing
        ids = ["-s", f"{REQUEST:X}", "-d", f"{RESPONSE:X}", "-p", "CC:CC"]
        receiver = subprocess.Popen(["isotprecv", *ids, unit.interface], stdout=subprocess.PIPE, text=True)
        time.sleep(0.5)
        subprocess.run(["isotpsend", *ids, unit.interface], input="22 F1 8C\n", text=True, check=True, timeout=60)
        heard, _ = receiver.communicate(timeout=60)
        self.assertEqual(bytes.fromhex(heard), b"\x62\xf1\x8cKERNEL-1")


class TsharkReadsTheLog(case.OnBench):
    def logged_run(self, speed):
        """The document of a whole run and the log of it, or no log where the logger told that it was too slow."""
        unit = self.bench(interface="vcan3", speed=speed).start()
        log = unit.folder / "whole.log"
        with open(log, "w", encoding="ascii") as output:
            logger = subprocess.Popen([case.bench.BIN / "selfcal", "bus", "log", unit.interface], stdout=output)
            try:
                end = time.monotonic() + 60
                while log.stat().st_size == 0:   # it has started when the first status frames are there
                    self.assertLess(time.monotonic(), end, "the logger writes nothing")
                    time.sleep(0.1)
                run = unit.wait_for_end(unit.start_run("--schedule", unit.short, "--force", "peers"), timeout=400.0)
            finally:
                logger.terminate()
                logger.wait(60)
        unit.stop()
        self.assertEqual(run["state"], "completed", run["reason"])
        return run, log if logger.returncode == 0 else None

    def test_nothing_malformed_in_a_whole_calibration(self):
        run, whole = self.logged_run(speed=20.0)
        if whole is None:
            run, whole = self.logged_run(speed=4.0)
        self.assertIsNotNone(whole, "the logger lost frames")
        # Told to read ISO-TP, tshark takes the status frames for it too.
        lines = [line for line in whole.read_text(encoding="ascii").splitlines()
                 if line.split()[2].split("#")[0] in (f"{REQUEST:X}", f"{RESPONSE:X}")]
        with h5py.File(run["recording"]) as pulled:
            samples = len(pulled["time_s"])
        self.assertGreater(samples, 60 * 50)   # the estimator takes nothing shorter than a minute
        self.assertGreater(len(lines), samples * 28 / 7, "frames are missing in the log")   # 28 bytes a sample, 7 a frame
        log = whole.with_name("uds.log")
        log.write_text("\n".join(lines) + "\n", encoding="ascii")
        services = {int(sid, 0) & ~0x40 for sid in tshark(log, "-Y", "uds", "-T", "fields", "-e", "uds.sid")}
        self.assertLessEqual({0x10, 0x22, 0x27, 0x2E, 0x31, 0x35, 0x36, 0x37}, services)
        self.assertEqual(tshark(log, "-Y", "_ws.malformed || iso15765.message_type.bad || iso15765.fragment.error"), [])
        # The negative control: one length byte spoilt, so that a read request holds half an identifier.
        at = next(i for i, line in enumerate(lines) if line.split("#")[1].startswith("0322"))
        lines[at] = lines[at].replace("#0322", "#0222")
        log.write_text("\n".join(lines) + "\n", encoding="ascii")
        self.assertNotEqual(tshark(log, "-Y", "_ws.malformed"), [])


if __name__ == "__main__":
    unittest.main()
