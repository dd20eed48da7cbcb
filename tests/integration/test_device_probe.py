"""`selfcal device probe` finds what is there, and sends nothing but TesterPresent, the default session and reading."""
import json
import socket
import struct
import subprocess
import tempfile
import threading
import time
import unittest
from pathlib import Path

import case
import profile_case

PROFILES = case.ROOT / "config" / "profiles"
RECEIVE_BUFFER_FORCE = 33  # SO_RCVBUFFORCE, which Python does not name


class Bus(threading.Thread):
    """Every frame of an interface, to the last one that was sent before `end`."""

    def __init__(self, interface):
        super().__init__(daemon=True)
        self.can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.can.setsockopt(socket.SOL_SOCKET, RECEIVE_BUFFER_FORCE, 4 << 20)  # a busy machine loses none
        self.can.bind((interface,))
        self.can.settimeout(0.2)
        self.frames, self.over = [], False

    def run(self):
        while True:
            over = self.over  # before the frame is waited for: silence counts from then
            try:
                frame = self.can.recv(16)
            except TimeoutError:
                if over:
                    return
                continue
            identifier, length = struct.unpack("=IB", frame[:5])
            self.frames.append((identifier, frame[8:8 + length]))

    def end(self):
        self.over = True
        self.join()
        self.can.close()
        return self.frames


def sent_by_tester(frames, answering):
    """Frames on identifiers other than those of nodes that answer or speak by themselves."""
    return [(i, d) for i, d in frames if i not in answering]


def harmless(data):
    """A single frame with one of the three requests, or flow control."""
    if data[0] >> 4 == 3:
        return True
    request = data[1:1 + data[0]]
    return data[0] >> 4 == 0 and (request in (b"\x3E\x00", b"\x10\x01") or (len(request) == 3 and request[0] == 0x22))


class DeviceProbe(unittest.TestCase):
    def probe(self, *options):
        done = subprocess.run([case.bench.BIN / "selfcal", "device", "probe", "vcan0", "--json", *map(str, options)],
                              capture_output=True, text=True, timeout=200, check=False)
        if not done.stdout:
            raise AssertionError(done.stderr)
        self.assertFalse(case.schema_validator.text_faults(done.stdout))
        return done.returncode, json.loads(done.stdout)

    def setUp(self):
        folder = tempfile.TemporaryDirectory(prefix="selfcal_probe.")
        self.addCleanup(folder.cleanup)
        self.folder = Path(folder.name)
        self.key = self.folder / "ins.key"
        self.key.touch(mode=0o600)
        self.key.write_text("00" * 16 + "\n", encoding="ascii")

    def start_ins(self, profile):
        server = subprocess.Popen([case.bench.BIN / "sim_ins", "--interface", "vcan0", "--key", self.key, "--profile",
                                   PROFILES / profile, "--flash", self.folder / f"{Path(profile).name}.flash"],
                                  stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)

    def test_two_ins_on_one_bus(self):
        """One at the address asked first, one that only its normal fixed address gives away."""
        self.start_ins("selfcal.toml")
        self.start_ins("example.toml")
        time.sleep(2.0)
        bus = Bus("vcan0")
        bus.start()
        status, document = self.probe()
        frames = bus.end()
        self.assertEqual(status, 0)
        self.assertEqual([(f["request_id"], f["response_id"], f["extended_id"]) for f in document["found"]],
                         [(0x640, 0x648, False), (0x18DA2AF1, 0x18DAF12A, True)])
        self.assertEqual([h["id"] for h in document["heard"]], [0x650, 0x651])
        records = {d["did"]: bytes.fromhex(d["record"]) for d in document["found"][0]["dids"]}
        self.assertEqual(set(records), {0xF18C, 0xF195})
        self.assertEqual(records[0xF195], b"sim_ins 1.0")
        self.assertEqual(document["found"][1]["dids"], [])

        extended = socket.CAN_EFF_FLAG
        sent = sent_by_tester(frames, {0x648, 0x650, 0x651, 0x18DAF12A | extended})
        services = {}
        for identifier, data in sent:
            self.assertTrue(harmless(data), f"{identifier:X}: {data.hex(' ')}")
            services[data[1]] = services.get(data[1], 0) + (data[0] >> 4 == 0)
        print(f"{len(sent)} frames of the tester:", ", ".join(f"service {s:02X} {n} times" for s, n in sorted(services.items())),
              "and no other", flush=True)
        self.assertGreater(len(sent), 256 + 2 * 32)
        # The control: what a calibration sends is not harmless.
        for forbidden in (b"\x02\x10\x03", b"\x02\x27\x01", b"\x04\x2E\xF1\x8C\x00", b"\x04\x31\x01\x02\x00", b"\x10\x12\x27\x02"):
            self.assertFalse(harmless(forbidden))

    def test_identifiers_in_a_range(self):
        self.start_ins("example.toml")
        time.sleep(2.0)
        status, document = self.probe("--profile", PROFILES / "example.toml", "--only", "--first-did", "FD00", "--last-did",
                                      "FD32", "--listen", "0.1")
        self.assertEqual(status, 0)
        told = {d["did"] for d in document["found"][0]["dids"]}
        self.assertEqual(told, {0xFD00, 0xFD01, 0xFD10, 0xFD11, 0xFD12, 0xFD20, 0xFD21, 0xFD30, 0xFD31, 0xFD32})

    def test_records_in_memory(self):
        """Those that the profile has, part by part, and no other address."""
        self.start_ins("addresses.toml")
        time.sleep(2.0)
        bus = Bus("vcan0")
        bus.start()
        status, document = self.probe("--profile", PROFILES / "addresses.toml", "--only", "--listen", "0.1")
        frames = bus.end()
        self.assertEqual(status, 0)
        told = {place["name"]: place for place in document["found"][0]["memory"]}
        self.assertEqual({name: len(bytes.fromhex(place.get("record", ""))) for name, place in told.items()},
                         {"identity.serial": 16, "identity.software": 12, "state": 12, "schedule": 0, "site": 24, "directory": 20,
                          "sample_format": 12, "coefficients.in_force": 204})
        self.assertEqual(told["schedule"]["nrc"], 0x22)  # none was written
        asked = [data for _, data in sent_by_tester(frames, {0x5A8}) if not harmless(data)]
        self.assertEqual(sorted(data[:7].hex() for data in asked), sorted(
            ["06231304000010", "0623130400100c", "0623130401000c", "06231304020040", "06231304040018", "06231304050014", "0623130406000c"]
            + [f"06231304{at:04x}{size:02x}" for at, size in ((0x8000, 64), (0x8040, 64), (0x8080, 64), (0x80C0, 12))]))

    def test_behind_an_address_byte(self):
        profile = self.folder / "extended.toml"
        profile.write_text(profile_case.addressed(profile_case.EXTENDED), encoding="utf-8")
        self.start_ins(profile)
        time.sleep(2.0)
        status, document = self.probe("--profile", profile, "--only", "--listen", "0.1")
        self.assertEqual(status, 0)
        found, = document["found"]
        self.assertEqual((found["request_id"], found["request_address"], found["response_id"], found["response_address"]),
                         (0x6F1, 0x12, 0x612, 0xF1))
        self.assertEqual({d["did"] for d in found["dids"]}, {0xF18C, 0xF195})

    def test_an_empty_bus(self):
        status, document = self.probe("--only", "--listen", "0.1")
        self.assertEqual((status, document["found"], document["heard"]), (case.ANSWER_IS_NO, [], []))


if __name__ == "__main__":
    unittest.main()
