"""The INS is locked and in its default session whenever no run needs it: seven ways for a run to end, each with the log of
the bus (candump) as the witness: `Unlocked` (bit 5) and `Session` (bits 6 and 7; 1: default) in the INS's own state
frame, 0x650."""
import signal
import subprocess
import time
import unittest

import case

STATE_FRAME, TESTER_PRESENT, DEFAULT_SESSION = "650", "7DF#023E80", 1
S3 = 5.0  # seconds: ISO 14229-2; sim_ins keeps it in real time
SOON = 1.0
SPOILT_PAGE = """[[fault]]
kind = "spoilt_page"
value = 1
amount = 1000
"""


class BusLog:
    """candump -L into a file, while the test lasts."""

    def __init__(self, test, unit):
        self.file = unit.folder / "can.log"
        with open(self.file, "w", encoding="ascii") as output:
            self.process = subprocess.Popen(["candump", "-L", "-r", "16000000", f"{unit.interface},640:7F0,650:7FF,7DF:7FF"],
                                            stdout=output)
        test.addCleanup(self.process.wait)
        test.addCleanup(self.process.kill)

    def frames(self):
        """(stamp, identifier, data) of every whole line so far."""
        for line in self.file.read_text(encoding="ascii").splitlines():
            fields = line.split()
            if len(fields) >= 3 and "#" in fields[2]:
                identifier, data = fields[2].split("#")[:2]
                yield float(fields[0].strip("()")), identifier, data

    def open(self):
        """(stamp, whether it is unlocked or in another session than the default one) of every state frame."""
        return [(stamp, bool(first & 0x20) or first >> 6 != DEFAULT_SESSION)
                for stamp, first in ((stamp, bytes.fromhex(data)[0]) for stamp, identifier, data in self.frames()
                                     if identifier == STATE_FRAME and len(data) == 16)]


class SessionLifetime(case.OnBench):
    def begin(self, *options, **settings):
        unit = self.bench(speed=settings.pop("speed", 20.0), **settings).start()
        log = BusLog(self, unit)
        time.sleep(0.3)
        return unit, log, unit.start_run("--schedule", unit.short, *options)

    def rotating(self, unit):
        unit.wait_until(lambda s: s["state"] == "rotating" and s["pages_pulled"] >= 1, "rotation")

    def assert_locked(self, unit, log, ended, within=SOON, how=""):
        """From `within` seconds after `ended` on, and for as long as S3 lasts, nothing unlocks it or keeps a session."""
        time.sleep(max(0.0, ended + within + S3 + 0.5 - time.time()))
        bits = log.open()
        self.assertTrue(any(bit for _, bit in bits), "the run never had a session: this log shows nothing")
        after = [(stamp, bit) for stamp, bit in bits if stamp > ended + within]
        self.assertGreater(len(after), 10, "no state frames after the end")
        self.assertFalse([stamp - ended for stamp, bit in after if bit], "unlocked or in a session, seconds after the end")
        alive = [stamp - ended for stamp, identifier, data in log.frames()
                 if stamp > ended + within and f"{identifier}#{data}".startswith(TESTER_PRESENT)]
        self.assertFalse(alive, "TesterPresent without a run")
        last = max((stamp for stamp, bit in bits if bit), default=ended)
        print(f"{how}: last state frame with a session or Unlocked=1 at {last - ended:+.2f} s of the end", flush=True)

    def assert_ended(self, unit, log, run, state, how):
        document = unit.wait_for_end(run, timeout=240)
        ended = time.time()
        self.assertEqual(document["state"], state, document["reason"])
        self.assert_locked(unit, log, ended, how=how)

    def test_done(self):
        unit, log, run = self.begin("--force", "short schedule")
        self.assert_ended(unit, log, run, "completed", "done")

    def test_refused(self):
        unit, log, run = self.begin()
        self.assert_ended(unit, log, run, "refused", "refused")

    def test_aborted(self):
        unit, log, run = self.begin(speed=5.0)
        self.rotating(unit)
        unit.selfcal("abort", unit.name, "--reason", "test")
        self.assert_ended(unit, log, run, "aborted", "aborted")

    def test_failed(self):
        unit = self.bench()
        (unit.folder / "spoilt.toml").write_text(SPOILT_PAGE, encoding="ascii")
        unit.sim_options += ["--scenario", unit.folder / "spoilt.toml"]
        unit.start()
        log = BusLog(self, unit)
        time.sleep(0.3)
        self.assert_ended(unit, log, unit.start_run("--schedule", unit.short), "failed", "failed")

    def test_rolled_back(self):
        unit, log, run = self.begin("--force", "short schedule")
        serial = unit.wait_for_end(run)["serial"]
        unit.selfcal("rollback", serial, "--reason", "test")
        document = unit.document(run + 1)
        self.assertEqual(document["state"], "completed", document)
        self.assert_locked(unit, log, time.time(), how="rolled back")

    def test_link_lost(self):
        unit, log, run = self.begin(speed=2.0, ins={"lost_after_s": 2.0})
        self.addCleanup(subprocess.run, ["ip", "link", "set", unit.interface, "up"], check=False)
        self.rotating(unit)
        subprocess.run(["ip", "link", "set", unit.interface, "down"], check=True)
        cut = time.time()  # the command takes its time on a busy machine; nothing is heard after it
        document = unit.wait_for_end(run, timeout=240)
        self.assertEqual(document["state"], "failed", document)
        subprocess.run(["ip", "link", "set", unit.interface, "up"], check=True)
        again = BusLog(self, unit)
        time.sleep(max(3.0, cut + S3 + SOON + 3.0 - time.time()))
        before, after = log.open(), again.open()
        self.assertTrue(any(bit for _, bit in before))
        late = [(stamp - cut, bit) for stamp, bit in after if stamp > cut + S3 + SOON]
        self.assertGreater(len(late), 5)
        self.assertFalse([since for since, bit in late if bit], "S3 has not ended the session, seconds after the cut")
        print("link lost: Unlocked=0 and default session when the bus is back", flush=True)

    def test_service_stopped(self):
        unit, log, _ = self.begin(speed=2.0)
        self.rotating(unit)
        unit.daemon_process.send_signal(signal.SIGTERM)
        unit.daemon_process.wait(10)
        self.assert_locked(unit, log, time.time(), how="service stopped (SIGTERM)")

    def test_service_killed_and_restarted(self):
        unit, log, run = self.begin("--dry-run", speed=2.0)
        self.rotating(unit)
        unit.kill_daemon()
        killed = time.time()
        self.assert_locked(unit, log, killed, within=S3 + SOON, how="service killed")
        unit.start_daemon()  # takes up its run, with a session of its own, and ends it
        document = unit.wait_for_end(run, timeout=240)
        self.assertIn(document["state"], ("completed", "refused"), document)
        self.assert_locked(unit, log, time.time(), how="killed and restarted")
        unit.kill_daemon()
        unit.start_daemon()  # idle: no session at all
        self.assert_locked(unit, log, time.time(), within=0.0, how="restarted and idle")


if __name__ == "__main__":
    unittest.main()
