"""A whole calibration under a profile: our own as a file, another one with the virtual INS, and an INS in Python that was written
from the description of that profile alone. On the same sensor data the 24 are the same."""
import json
import math
import subprocess
import sys
import time
import unittest

import case

PROFILES = case.ROOT / "config" / "profiles"
FOREIGN = case.ROOT / "tests" / "foreign" / "uploading_ins.py"
SPEED, DWELL_S = 60.0, 20.0


class Profiles(case.OnBench):
    def calibrate(self, unit):
        run = unit.wait_for_end(unit.start_run("--schedule", "horizontal", "--force", "short dwell"))
        self.assertEqual((run["state"], run["exit_status"]), ("completed", case.DONE), run["reason"])
        return run

    def bench_of(self, profile, **ins):
        return self.bench(speed=SPEED, ins={"dwell_s": DWELL_S, "profile": str(PROFILES / profile)} | ins,
                          sim_options=["--profile", PROFILES / profile])

    def assert_same(self, run, own, what):
        """To a tenth of sigma: the same sensor data through other bytes. What differs is the gimbal's read-out, rounded to
        20 arcseconds twice, and the time of a page's temperature."""
        largest = max(abs(a["value"] - b["value"]) / b["sigma"]
                      for a, b in zip(run["result"]["parameters"], own["result"]["parameters"], strict=True))
        print(f"{what} against our own INS: 24 values, largest difference {largest:.1e} sigma", flush=True)
        self.assertLess(largest, 0.1)

    def test_each_profile_gives_the_same_24(self):
        ours = self.bench_of("selfcal.toml", drift_check_s=60.0).start()
        own = self.calibrate(ours)
        ours.stop()

        other = self.bench_of("example.toml", drift_check_s=60.0).start()
        run = self.calibrate(other)
        self.assertLess(run["drift_after_m"], run["drift_before_m"])
        other.stop()
        self.assert_same(run, own, "the virtual INS under example.toml")

        unit = self.bench_of("example.toml")
        recording = unit.folder / "direct.h5"
        unit.selfcal("simulate", "--config", unit.folder / "sim.toml", "--schedule", "horizontal", "--dwell", DWELL_S,
                     "--seed", unit.seed, "-o", recording)
        memory = unit.folder / "memory.json"
        log = open(unit.folder / "foreign.log", "wb")
        self.addCleanup(log.close)
        server = subprocess.Popen([sys.executable, "-B", FOREIGN, unit.interface, recording, unit.key_file, str(SPEED),
                                   memory], stdout=log, stderr=log)
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        end = time.monotonic() + 60
        while not memory.exists() and time.monotonic() < end:
            time.sleep(0.1)
        unit.start_daemon()
        try:
            run = self.calibrate(unit)
        except BaseException:
            print((unit.folder / "foreign.log").read_text(encoding="utf-8"), flush=True)
            raise
        self.assert_same(run, own, "an INS in Python")
        held = json.loads(memory.read_text(encoding="ascii"))
        self.assertGreater(held["version"], 0)
        for parameter in run["result"]["parameters"]:
            name = parameter["name"]
            value = -held["values"]["minus_" + name] if name.startswith("accel_scale_neg") else held["values"][name]
            expected = parameter["value"] if parameter["determined"] and parameter["plausible"] else 0.0
            self.assertTrue(math.isclose(value, expected, rel_tol=1e-9, abs_tol=1e-9), (parameter, value))
        print("the INS in Python holds what the run says, version", held["version"], flush=True)


if __name__ == "__main__":
    unittest.main()
