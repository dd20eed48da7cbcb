"""A recording of another test set enters the history as a run: with its source and operator, in the unit's past and in the outbox of
the depot; it never passes for a calibration over the bus, and a killed service takes it up again."""
import json
import os
import pwd
import sqlite3
import subprocess
import time
import unittest

import case
from case import bench

SERIAL = "TEST-0001"


class ImportAsRun(case.OnBench):
    def recorded(self, unit, seed, *more):
        """As another test set would hand it over: CSV with its attributes."""
        recording = unit.folder / f"lab-{seed}.h5"
        unit.selfcal("simulate", "--config", unit.folder / "sim.toml", "--seed", seed, *more, "-o", recording)
        unit.selfcal("export", recording, "-o", recording.with_suffix(".csv"))
        recording.unlink()
        return recording.with_suffix(".csv")

    @staticmethod
    def command(csv, *more):
        return [bench.BIN / "selfcal", "import", csv, "-o", csv.with_suffix(".h5"), "--as-run", "--source", "Lab B, table 3", "--json", *more]

    def imported(self, csv, *more, status=case.DONE):
        done = subprocess.run(self.command(csv, *more), capture_output=True, text=True, check=False, timeout=120)
        self.assertEqual(done.returncode, status, done.stderr)
        return json.loads(done.stdout)

    def asked(self, unit, question):
        with sqlite3.connect(unit.folder / "state" / "selfcal.db") as database:
            return database.execute(question).fetchall()

    def test_it_is_a_run_like_any_other(self):
        unit = self.bench().start()
        csv = self.recorded(unit, 3)
        run = self.imported(csv)
        self.assertEqual((run["kind"], run["serial"], run["state"]), ("recording", SERIAL, "completed"))
        self.assertEqual(run["user"], pwd.getpwuid(os.getuid()).pw_name)
        self.assertRegex(run["source"], r"^Lab B, table 3, lab-3\.csv, SHA-256 [0-9a-f]{64}$")
        direct = json.loads(unit.selfcal("estimate", csv.with_suffix(".h5"), "--json").stdout)
        self.assertEqual(run["result"]["parameters"], direct["parameters"])  # to the last bit
        self.assertEqual(self.asked(unit, "SELECT run, answer FROM outbox"), [(run["run"], "")])
        self.never_on_the_bus(unit, run)

        refused = self.imported(self.recorded(unit, 4, "--dwell", 20), status=case.ANSWER_IS_NO)  # too short: not determined
        self.assertEqual(refused["state"], "refused")
        history = json.loads(unit.selfcal("history", SERIAL, "--json").stdout)
        self.assertEqual([r["kind"] for r in history["runs"]], ["recording", "recording"])
        for parameter, estimated in zip(history["parameters"], direct["parameters"], strict=True):
            self.assertEqual([(v["run"], v["value"]) for v in parameter["values"]], [(run["run"], estimated["value"])])
        print("an imported run:", unit.selfcal("history", SERIAL).stdout.splitlines()[1], flush=True)

    def never_on_the_bus(self, unit, run):
        """What an operator reads says so, and what would write or undo it declines."""
        for words in (unit.selfcal("show", run["run"]).stdout, run["summary"]["verdict"]):
            self.assertRegex(words.lower(), "not calibrated over the bus")
        page = unit.folder / "page.html"
        unit.selfcal("report", run["run"], "-o", page)
        self.assertIn("Not calibrated over the bus", page.read_text(encoding="utf-8"))
        self.assertFalse(run["in_force"]["now"])
        self.assertIsNone(run["coefficients"]["proposed"])
        self.assertEqual(unit.status()["last_calibration"], None)
        for command in (["amend", run["run"]], ["rollback", SERIAL, "--reason", "test"]):
            declined = unit.selfcal(*command, check=False)
            self.assertNotEqual(declined.returncode, 0)
            self.assert_one_line(declined.stderr, "imported|no completed calibration")

    def test_what_cannot_be_a_run_is_declined(self):
        unit = self.bench().start()
        csv = self.recorded(unit, 3, "--dwell", 20)
        for more, words in ((["--serial", "OTHER-1"], "of ins \"test-0001\", not of \"other-1\""), (["--ins", "nobody"], "no ins \"nobody\"")):
            done = subprocess.run(self.command(csv, *more), capture_output=True, text=True, check=False, timeout=60)
            self.assertNotEqual(done.returncode, 0)
            self.assert_one_line(done.stderr, words)
        self.assertEqual(self.asked(unit, "SELECT count(*) FROM parameters"), [(0,)])

    def test_a_killed_service_takes_it_up_again(self):
        unit = self.bench().start()
        lab = unit.folder / "lab.h5"
        unit.selfcal("simulate", "--config", unit.folder / "sim.toml", "--seed", 5, "-o", lab)
        operator = subprocess.Popen([bench.BIN / "selfcal", "import", lab, "--as-run"], stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        self.addCleanup(operator.wait)
        recording = unit.folder / "state" / "runs" / "1" / "recording.h5"
        end = time.monotonic() + 60
        while not recording.exists():
            self.assertLess(time.monotonic(), end)
            time.sleep(0.002)
        unit.kill_daemon()
        self.assertEqual(self.asked(unit, "SELECT state FROM runs"), [("estimating",)])
        unit.start_daemon()
        run = unit.wait_for_end(1)
        self.assertEqual((run["state"], run["kind"]), ("completed", "recording"))
        self.assertEqual([e["text"] for e in run["events"] if e["kind"] == "imported"][1:], ["taken up again"])


if __name__ == "__main__":
    unittest.main()
