"""An INS whose lock a program of the user's own opens: a whole calibration, and every way in which such a program can fail."""
import json
import os
import time
import unittest

import profile_case

LOCK = """method = "program"
program = "key"
seed_bytes = 6
key_bytes = 4
level = 5
limit_s = 6.0"""  # Python takes a second to begin, several beside other tests

# What the program is, and what the run must say.
FAILURES = (
    ("for ever silent, deaf to signals", "trap '' TERM INT HUP\nwhile :; do :; done", "no key within 6 s"),
    ("for ever loud", "while :; do echo 00; done", "writes more than the 8 digits of a key"),
    ("with its words on the wrong stream", "while :; do echo 00 >&2; done", "no key within 6 s"),
    ("that begins another process", "/bin/true; /bin/true\nexit 7", "ended with status 2: .*[Cc]annot fork"),
    ("that fails", "echo unknown unit >&2\nexit 3", "ended with status 3: unknown unit"),
    ("without a word", "exit 0", "wrote nothing"),
    ("with other words", "echo hello", "are not pairs of hexadecimal digits"),
    ("with a short key", "echo 010203", "wrote a key of 3 bytes, 4 are expected"),
)


class KeyProgram(profile_case.UnderProfile):
    def test_key_program(self):
        folder = profile_case.PROFILES
        text = (folder / "memory.toml").read_text(encoding="utf-8")
        self.assertEqual(text.count('method = "none"'), 1)
        unit, memory = self.bench_with("locked_ins.py", "memory.toml", lambda _: [], start=False)
        os.chmod(unit.folder, 0o755)  # run by root, it is nobody who opens the program
        profile, self.program = unit.folder / "locked.toml", unit.folder / "key"
        profile.write_text(text.replace('method = "none"', LOCK), encoding="utf-8")
        self.become((profile_case.FOREIGN / "key_of_locked.py").read_text(encoding="ascii"))
        unit.ins_keys["profile"] = str(profile)
        del unit.ins_keys["key_file"]
        unit.write_daemon_config([unit], {})
        unit.start_daemon()

        run = self.calibrate_or_tell(unit)
        held = json.loads(memory.read_text(encoding="ascii"))["held"]
        self.assertEqual(held["version"], 1)
        print("a lock of the user's own:", run["state"], "and the INS holds version", held["version"], flush=True)

        for what, body, cause in FAILURES:
            with self.subTest(what):
                self.become(f"#!/bin/sh\n{body}\n")
                self.fails(unit, cause)
        self.become("#!/bin/sh\necho 01020304\n")
        self.assertIn("invalidKey", self.reason(unit))
        self.program.chmod(0o644)
        self.fails(unit, "cannot be run: Permission denied")
        self.program.chmod(0o777)
        self.fails(unit, "others may write it")
        self.program.unlink()
        self.fails(unit, "No such file or directory")
        self.assertEqual(json.loads(memory.read_text(encoding="ascii"))["held"], held)

    def become(self, text):
        self.program.unlink(missing_ok=True)
        self.program.write_text(text, encoding="ascii")
        self.program.chmod(0o755)

    def reason(self, unit):
        """Of a run that fails for its lock; meanwhile the service answers."""
        begin = time.monotonic()
        unit.selfcal("status", "--json")
        usual_s = time.monotonic() - begin  # on this machine, with what else it does
        run = unit.start_run("--schedule", "horizontal", "--force", "short dwell")
        begin = time.monotonic()
        unit.selfcal("status", "--json")
        self.assertLess(time.monotonic() - begin, 1.5 + 5 * usual_s, "the service does not answer while the program runs")
        ended = unit.wait_for_end(run)
        self.assertEqual(ended["state"], "failed", ended)
        self.assertLess(time.monotonic() - begin, 40)
        return ended["reason"]

    def fails(self, unit, cause):
        reason = self.reason(unit)
        self.assert_one_line(reason, f"key program {self.program}: .*{cause}".lower())


if __name__ == "__main__":
    unittest.main()
