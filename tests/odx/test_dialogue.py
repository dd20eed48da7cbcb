"""The PDX of an INS against a recorded dialogue: all that passed on the bus in a whole calibration, and reads of what it did not ask for. Every
identifier and routine of the archive decodes to what our own codec makes of it. Written after ISO 15765-2 and 22901-1."""
import json
import math
import subprocess
import sys
import time
import tomllib
import unittest
from pathlib import Path

from cryptography.hazmat.primitives.ciphers import algorithms
from cryptography.hazmat.primitives.cmac import CMAC

sys.path[:0] = [str(Path(__file__).resolve().parents[1] / folder) for folder in ("integration", "foreign")]

import isotp  # noqa: E402
import profile_case  # noqa: E402
import read_pdx  # noqa: E402

BIN = profile_case.case.bench.BIN
ID_MASK = 0x1FFFFFFF
NOBODY = 0x7  # an identifier that no profile has
ECHOED = {0x62: 3, 0x6E: 3, 0x71: 4, 0x76: 2}  # bytes that a response repeats of its request, service included
# In the order of the record that has them all.
NAMES = ([f"accel_bias_{a}" for a in "xyz"] + [f"gyro_drift_{a}" for a in "xyz"]
         + [f"accel_scale_{s}_{a}" for s in ("pos", "neg") for a in "xyz"] + [f"accel_misalignment_{p}" for p in ("yx", "zx", "zy")]
         + [f"gyro_scale_{a}" for a in "xyz"] + [f"gyro_misalignment_{p}" for p in ("xy", "xz", "yx", "yz", "zx", "zy")])


def messages_of(log, *identifiers):
    """(identifier, message) of what `candump -L` wrote, in the order in which they ended."""
    open_ones = {}
    for line in log.splitlines():
        identifier, _, digits = line.split()[2].partition("#")
        identifier, data = int(identifier, 16) & ID_MASK, bytes.fromhex(digits)
        if identifier not in identifiers:
            continue
        kind = data[0] >> 4
        if kind == 0:
            yield identifier, data[1:1 + data[0]]
        elif kind == 1:
            open_ones[identifier] = ((data[0] & 0xF) << 8 | data[1], bytearray(data[2:]))
        elif kind == 2 and identifier in open_ones:
            size, held = open_ones[identifier]
            held += data[1:]
            if len(held) >= size:
                yield identifier, bytes(open_ones.pop(identifier)[1][:size])


def pairs(messages, request_id):
    """Each request with its answer; response-pending is none yet. Who listens sees each sender's frames in their order, but not
    always an answer before the request that it caused."""
    messages = list(messages)
    requests = [m for identifier, m in messages if identifier == request_id]
    at = 0
    for identifier, message in messages:
        if identifier == request_id or message[:1] == b"\x7f" and message[2:] == b"\x78":
            continue
        begin = message[1:2] if message[0] == 0x7F else bytes([message[0] - 0x40]) + message[1:ECHOED.get(message[0], 1)]
        found = next((k for k in range(at, min(at + 4, len(requests))) if requests[k].startswith(begin)), None)
        if found is not None:  # else its request was not seen
            yield requests[found], message
            at = found + 1


class Dialogue(profile_case.UnderProfile):
    def ask_the_rest(self, unit, request_id, response_id, extended, session, level):
        """What the service has no need of: every identifier again, results and ends of what is over, TesterPresent."""
        bus = isotp.Transport(unit.interface, response_id, request_id, NOBODY, isotp.EXTENDED if extended else 0)

        def ask(request):
            bus.send(bytes(request))
            while (got := bus.receive(2.0)) is not None and got[0][:1] == b"\x7f" and got[0][2:] == b"\x78":
                pass
            self.assertIsNotNone(got, bytes(request).hex())
            return got[0]

        for did in self.numbers(0x22):
            ask([0x22, did >> 8, did & 0xFF])
        ask([0x3E, 0])
        ask([0x10, session])
        if level:
            mac = CMAC(algorithms.AES(bytes.fromhex(unit.key_file.read_text(encoding="ascii").strip())))
            mac.update(ask([0x27, level])[2:])
            self.assertEqual(ask([0x27, level + 1, *mac.finalize()])[0], 0x67)
        for routine in set(self.numbers(0x31)):
            for action in (2, 3):
                ask([0x31, action, routine >> 8, routine & 0xFF])
        bus.can.close()

    @staticmethod
    def let_finish(log):
        """Nothing is sent any more, but the recorder may be behind by what its socket holds: it is done when it writes no more."""
        size = -1
        for _ in range(60):
            if log.stat().st_size == size:
                return
            size = log.stat().st_size
            time.sleep(1.0)

    def record(self, name):
        """The messages of a whole calibration under a profile."""
        unit = self.bench_of(f"{name}.toml", drift_check_s=60.0) if name != "memory" else self.bench_of("memory.toml")
        profile = tomllib.loads((profile_case.PROFILES / f"{name}.toml").read_text(encoding="utf-8"))
        bus = profile["bus"]
        normal = bus["addressing"] == "normal"
        request, response = (bus["request"], bus["response"]) if normal else [
            0x18DA0000 | a << 8 | b for a, b in ((bus["ins_address"], bus["tester_address"]), (bus["tester_address"], bus["ins_address"]))]
        log = unit.folder / "bus.log"
        with open(log, "wb") as out:
            recorder = subprocess.Popen(["candump", "-L", "-r", str(32 << 20), unit.interface], stdout=out)
        try:
            unit.start()
            run = unit.wait_for_end(unit.start_run("--schedule", unit.short, "--force", "short schedule"))
            self.assertEqual(run["state"], "completed", run["reason"])
            unit.end_daemon()
            self.ask_the_rest(unit, request, response, not normal, profile.get("session", {}).get("calibration", 3),
                              profile["security"].get("level", 0))
            unit.stop()
            self.let_finish(log)
        finally:
            recorder.terminate()
            recorder.wait()
        return list(pairs(messages_of(log.read_text(encoding="ascii"), request, response), request))

    def numbers(self, service):
        """Identifiers (0x22) or routines (0x31) that the archive knows."""
        at = 1 if service == 0x22 else 2
        for request in self.pdx.layer.iter("REQUEST"):
            values = {int(p.findtext("BYTE-POSITION")): p.findtext("CODED-VALUE") for p in request.iter("PARAM")}
            if values[0] == str(service):
                yield int(values[at])

    def ours(self, profile, lines):
        done = subprocess.run([BIN / "decode_by_profile", profile], input="\n".join(lines) + "\n", capture_output=True, text=True, check=True)
        return [json.loads(line) for line in done.stdout.splitlines()]

    @staticmethod
    def flat(record):
        """As our codec names them: a list for each name."""
        values = {}
        for name, value in record.items():
            if isinstance(value, list):
                for item in value:
                    for inner, number in Dialogue.flat(item).items():
                        values.setdefault(inner, []).extend(number)
                values[name] = [len(value)]
            else:
                values[name] = [value]
        for name in [n for n in values if n.endswith("_high")]:
            values[name[:-5]] = [values.pop(name)[0] * 2**32 + values.pop(name[:-5] + "_low")[0]]
        return values

    def compare(self, record, own):
        theirs = self.flat(record)
        for name, numbers in own.items():
            if name in theirs and len(theirs[name]) == len(numbers):
                told = theirs[name]
            else:  # elements by names of their own
                group = NAMES if name == "values" else [n for n in NAMES if n.startswith(name + "_")] or sorted(
                    n for n in theirs if n.startswith(name + "_"))
                told = [theirs[n][0] for n in group]
            self.assertEqual(len(told), len(numbers), name)
            for a, b in zip(told, numbers):
                same = a == b if isinstance(b, str) else math.isclose(a, b, rel_tol=1e-12, abs_tol=1e-300)
                self.assertTrue(same, f"{name}: {a} by the archive, {b} by ours")
        return sum(len(numbers) for numbers in own.values())

    def check(self, name):
        profile = profile_case.PROFILES / f"{name}.toml"
        archive = Path(self.enterContext(profile_case.case.tempfile.TemporaryDirectory())) / "ins.pdx"
        subprocess.run([BIN / "selfcal", "device", "odx", profile, "-o", archive], check=True, capture_output=True)
        self.pdx = read_pdx.Pdx(archive)
        dialogue = self.record(name)
        seen, lines, records = {}, [], []
        for request, response in dialogue:
            for decode, message in ((lambda: self.pdx.decode_request(request), request),
                                    (lambda: self.pdx.decode_response(response, request), response)):
                try:
                    service, values = decode()
                except read_pdx.Other:  # a routine that has no such action is refused, and no service of the archive
                    self.assertEqual((request[0], response[0]), (0x31, 0x7F), (request.hex(), response.hex()))
                    continue
                seen[service] = seen.get(service, 0) + 1
                kind, number = ("did", message[1:3]) if message[0] in (0x62, 0x2E) else (
                    "option" if message[0] == 0x31 else "result", message[2:4])
                record = values.get("record", values.get("option"))
                if isinstance(record, dict):
                    lines.append(f"{kind} {number.hex()} {message[3 if kind == 'did' else 4:].hex()}")
                    records.append(record)
        compared = sum(self.compare(record, own) for record, own in zip(records, self.ours(profile, lines), strict=True))
        unseen = set(self.pdx.services) - set(seen)
        print(f"{name}: {len(dialogue)} exchanges, {len(records)} records with {compared} values, the same by the archive and by ours; "
              f"not in the dialogue: {', '.join(sorted(unseen)) or 'none'}", flush=True)
        self.assertFalse(unseen)

    def test_our_own(self):
        self.check("selfcal")

    def test_another_byte_order(self):
        self.check("example")

    def test_field_by_field(self):
        self.check("memory")


if __name__ == "__main__":
    unittest.main()
