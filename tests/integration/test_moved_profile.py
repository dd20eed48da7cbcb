"""Our own INS with every number of its profile changed: identifiers of frames and data, routines, levels, places of fields, order of
bytes. It is calibrated to the same 24 by the same programs, and not one of the old numbers goes over the bus."""
import json
import subprocess
import threading
import tomllib
import unittest

import case
import profile_case

BYTES = {"8": 1, "16": 2, "24": 3, "32": 4, "64": 8}
NUMBERS = ("did", "serial", "software", "in_force", "inactive", "factory", "routine")


def bytes_of(field):
    one = field["length"] if field["type"] == "ascii" else BYTES[field["type"][1:]]
    return one * field.get("count", 1)


def turned_round(fields, length, shift):
    """The fields of `length` bytes in the opposite order, `shift` bytes further on."""
    for field in fields:
        field["at"] = length - field["at"] - bytes_of(field) + shift


class Mover:
    """Every identifier is another one, every record stands the other way round with bytes of no meaning before it."""

    def __init__(self):
        self.profile = tomllib.loads((profile_case.PROFILES / "selfcal.toml").read_text(encoding="utf-8"))
        self.fresh = iter(range(0x5A11, 0x7000, 0x1D))
        self.old, self.new = set(), set()

    def moved(self):
        p = self.profile
        p["name"] = "moved"
        p["byte_order"] = "little"
        p["bus"] |= {"request": 0x321, "response": 0x432, "functional": 0x7A5, "status": 0x123, "padding": 0x11}
        p["session"]["calibration"] = 0x42
        p["security"]["level"] = 5
        self.walk(p)
        for signals in (p["status"]["state"]["signals"], p["status"]["gimbal"]["signals"]):
            for signal in signals.values():
                signal["start"] = (signal["start"] + 8) % 64
        return self.text(p)

    def walk(self, table):
        for key in NUMBERS:
            if isinstance(table.get(key), int):
                self.old.add(table[key])
                table[key] = next(self.fresh)
                self.new.add(table[key])
        if "fields" in table:
            self.record(table)
        for key, value in table.items():
            if isinstance(value, dict) and key not in ("status", "fields", "each"):
                self.walk(value)

    @staticmethod
    def record(table):
        shift, each, checksum = 3, table.get("each"), table.get("checksum")
        fields = list(table["fields"].values())
        if each:
            head = each["at"]
            turned_round(fields + ([checksum] if checksum else []), head, shift)
            turned_round(each["fields"].values(), each["stride"], 1)
            each["at"], each["stride"] = head + shift, each["stride"] + 1
            if "bytes" in table:
                table["bytes"] += 100
        else:
            length = checksum["at"] if checksum else table["bytes"]
            turned_round(fields, length, shift)
            if checksum:
                checksum["at"] += shift
            table["bytes"] += shift
        for field in table["fields"].values():
            if "codes" in field:
                field["codes"] = {word: 0x30 + 3 * code for word, code in field["codes"].items()}
            if "constant" in field:
                field["constant"] ^= 0x55
        if checksum:
            checksum["to"] = table["bytes"] if each else checksum["at"]

    def text(self, table, path=""):
        plain = [f"{key} = {self.value(value)}\n" for key, value in table.items() if not isinstance(value, dict)]
        below = [self.text(value, f"{path}.{key}" if path else key)
                 for key, value in table.items() if isinstance(value, dict)]
        return (f"[{path}]\n" if path and plain else "") + "".join(plain) + "".join(below)

    @staticmethod
    def value(value):
        return str(value).lower() if isinstance(value, bool) else json.dumps(value)


class Log(threading.Thread):
    """`selfcal bus log` into a file."""

    def __init__(self, interface, file):
        super().__init__(daemon=True)
        self.out = open(file, "wb")
        self.process = subprocess.Popen([str(case.bench.BIN / "selfcal"), "bus", "log", interface], stdout=self.out,
                                        stderr=subprocess.DEVNULL)

    def end(self):
        self.process.terminate()
        self.process.wait()
        self.out.close()


class MovedProfile(profile_case.UnderProfile):
    def test_the_same_24_with_no_number_left(self):
        ours = self.bench_of("selfcal.toml", drift_check_s=60.0).start()
        own = self.calibrate(ours)
        ours.stop()

        mover = Mover()
        unit = self.bench_of("selfcal.toml", drift_check_s=60.0)
        profile = unit.folder / "moved.toml"
        profile.write_text(mover.moved(), encoding="utf-8")
        self.assertEqual(unit.selfcal("device", "lint", profile).stdout, f"{profile}: no fault\n")
        self.assertFalse(mover.old & mover.new)
        unit.ins_keys["profile"] = str(profile)
        unit.sim_options = ["--profile", profile]
        unit.write_daemon_config([unit], {})
        log = Log(unit.interface, unit.folder / "bus.log")
        self.addCleanup(log.end)
        unit.start()
        run = self.calibrate(unit)
        unit.stop()
        log.end()
        self.assertLess(run["drift_after_m"], run["drift_before_m"])
        self.assert_same(run, own, "all numbers moved")
        self.look_at(unit, profile, mover)

    def look_at(self, unit, profile, mover):
        file = unit.folder / "bus.log"
        with open(file, encoding="ascii") as lines:
            heard = {int(line.split()[2].partition("#")[0], 16) for line in lines}
        self.assertEqual(heard & {0x640, 0x648, 0x7DF, 0x650, 0x651}, set())
        self.assertLessEqual({0x321, 0x432, 0x123, 0x124}, heard)
        entries = json.loads(unit.selfcal("bus", "decode", "--profile", profile, "--json", file, check=False,
                                          timeout=120).stdout)["entries"]
        asked = [bytes.fromhex(entry["bytes"]) for entry in entries if entry["kind"] == "request"]
        numbers = {int.from_bytes(message[1:3], "big") for message in asked if message[0] in (0x22, 0x2E)}
        numbers |= {int.from_bytes(message[2:4], "big") for message in asked if message[0] == 0x31}
        self.assertLessEqual(numbers, mover.new)
        words = " ".join(entry["words"] for entry in entries)
        for name in ("identity.serial", "state", "schedule", "site", "directory", "sample_format", "coefficients.in_force",
                     "coefficients.inactive", "rotate", "erase", "commit", "navigation_check"):
            self.assertIn(f" {name} (0x", words)
        self.assertNotIn("unknown (0x", words)
        states = {entry["signals"]["State"] for entry in entries if entry["kind"] == "status" and "State" in entry["signals"]}
        self.assertLessEqual({1.0, 2.0, 3.0, 6.0}, states)  # idle, rotating, complete, checking
        print(f"{len(entries)} entries of the bus: {len(numbers)} identifiers, all moved", flush=True)


if __name__ == "__main__":
    unittest.main()
