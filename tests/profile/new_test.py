#!/usr/bin/python3
"""`selfcal device new`: at a terminal it asks, elsewhere it takes options; either way lint finds no fault. Usage: new_test.py SELFCAL"""
import itertools
import os
import pty
import subprocess
import sys
import tempfile
import tomllib
import unittest
from pathlib import Path

SELFCAL = sys.argv.pop(1)


def new(*options, answers=None):
    """Status, standard output and what was asked; with `answers` at a terminal."""
    command = [SELFCAL, "device", "new", *options]
    if answers is None:
        done = subprocess.run(command, stdin=subprocess.DEVNULL, capture_output=True, text=True, timeout=60, check=False)
        return done.returncode, done.stdout, done.stderr
    ours, theirs = pty.openpty()
    process = subprocess.Popen(command, stdin=theirs, stdout=subprocess.PIPE, stderr=theirs)
    os.close(theirs)
    os.write(ours, "".join(line + "\n" for line in answers).encode("ascii"))
    profile = process.stdout.read().decode("utf-8")
    process.stdout.close()
    status = process.wait(60)
    asked = b""
    try:
        while part := os.read(ours, 4096):
            asked += part
    except OSError:  # the other end is closed
        pass
    os.close(ours)
    return status, profile, asked.decode("utf-8")


class New(unittest.TestCase):
    def read(self, text):
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder) / "new.toml"
            file.write_text(text, encoding="utf-8")
            lint = subprocess.run([SELFCAL, "device", "lint", file], capture_output=True, text=True, timeout=60, check=False)
        self.assertEqual((lint.returncode, lint.stdout.endswith("no fault\n")), (0, True), lint.stdout)
        return tomllib.loads(text)

    def test_questions(self):
        status, text, asked = new(answers=["north", "normal-fixed", "51", "", "little", "none", "memory", "moves", "stream", "one", "correction"])
        self.assertEqual(status, 0, asked)
        profile = self.read(text)
        self.assertEqual((profile["name"], profile["byte_order"], profile["security"]["method"]), ("north", "little", "none"))
        self.assertEqual((profile["bus"]["addressing"], profile["bus"]["ins_address"], profile["bus"]["tester_address"]),
                         ("normal-fixed", 0x51, 0xF1))
        self.assertEqual((profile["coefficients"]["slots"], profile["coefficients"]["form"]), (False, "correction"))
        for place in (profile["state"], profile["move"], profile["identity"]["serial"], profile["coefficients"]["in_force"]):
            self.assertIn("memory", place)
        self.assertEqual(len(profile["stream"]["sample"]), 4)
        for question in ("Name", "Addressing", "Address of the INS", "Byte order", "lock", "records", "gimbal", "raw data", "Sets", "24"):
            self.assertIn(question, asked)

    def test_a_wrong_answer_is_asked_again(self):
        status, text, asked = new(answers=["", "wireless", "normal", "800", "700", "708", "", "", "", "", "", "", "", ""])
        self.assertEqual(status, 0, asked)
        profile = self.read(text)
        self.assertEqual((profile["bus"]["request"], profile["bus"]["response"], profile["bus"]["functional"]), (0x700, 0x708, 0x7DF))
        self.assertIn("wireless: one of those words", asked)
        self.assertIn("800: hexadecimal, 0 to 7FF", asked)

    def test_options(self):
        status, text, errors = new("--name", "south", "--addressing", "normal-29", "--request-id", "18DA2AF1", "--response-id",
                                   "18DAF12A", "--functional-id", "18DB33F1", "--byte-order", "little")
        self.assertEqual((status, errors), (0, ""))
        profile = self.read(text)
        self.assertEqual((profile["name"], profile["bus"]["request"]), ("south", 0x18DA2AF1))

    def test_each_way_of_an_ins(self):
        """Every draft passes lint, and has the tables of what was asked for."""
        ways = itertools.product(("identifier", "memory"), ("schedule", "moves"), ("upload", "memory", "file", "stream"), ("two", "one"))
        others = itertools.cycle(itertools.product(("aes-cmac", "program", "none"), ("errors", "correction", "correction-first"),
                                                   ("normal", "normal-29", "normal-fixed"), ("big", "little")))
        drafts = 0
        for (records, rotation, raw_data, sets), (security, form, addressing, order) in zip(ways, others):
            with self.subTest(records=records, rotation=rotation, raw_data=raw_data, sets=sets, security=security, form=form):
                status, text, errors = new("--records", records, "--rotation", rotation, "--raw-data", raw_data, "--sets", sets, "--security",
                                           security, "--form", form, "--addressing", addressing, "--byte-order", order)
                self.assertEqual((status, errors), (0, ""))
                profile = self.read(text)
                self.assertEqual("memory" in profile["state"], records == "memory")
                self.assertEqual(("move" in profile, "schedule" in profile), (rotation == "moves", rotation == "schedule"))
                self.assertEqual("address" in profile.get("memory", {}), raw_data == "memory")
                self.assertEqual([name for name in ("upload", "file", "stream") if name in profile], [raw_data] if raw_data != "memory" else [])
                self.assertEqual(profile["coefficients"].get("slots", True), sets == "two")
                self.assertEqual((profile["coefficients"].get("form", "errors"), profile["security"]["method"]), (form, security))
                drafts += 1
        self.assertEqual(drafts, 32)
        print(f"{drafts} drafts, lint finds no fault in any", flush=True)

    def test_without_anything_it_is_our_own_ins(self):
        status, text, errors = new()
        self.assertEqual((status, errors), (0, ""))
        own = tomllib.loads((Path(__file__).parents[2] / "config" / "profiles" / "selfcal.toml").read_text(encoding="utf-8"))
        self.assertEqual(self.read(text), own | {"name": "my_ins"})

    def test_options_that_are_no_profile(self):
        status, text, errors = new("--request-id", "640", "--response-id", "640")
        self.assertEqual((status, text), (2, ""))
        self.assertIn("bus.response: identifier 0x0640 is that of bus.request already", errors)


if __name__ == "__main__":
    unittest.main()
