"""A whole calibration under a profile: our own as a file, another one with the virtual INS, and an INS in Python that was written
from the description of that profile alone. On the same sensor data the 24 are the same."""
import json
import math
import unittest

import profile_case


class Profiles(profile_case.UnderProfile):
    def test_each_profile_gives_the_same_24(self):
        ours = self.bench_of("selfcal.toml", drift_check_s=60.0).start()
        own = self.calibrate(ours)
        ours.stop()

        other = self.bench_of("example.toml", drift_check_s=60.0).start()
        run = self.calibrate(other)
        self.assertLess(run["drift_after_m"], run["drift_before_m"])
        other.stop()
        self.assert_same(run, own, "the virtual INS under example.toml")

        unit, memory = self.bench_with("uploading_ins.py", "example.toml", lambda u: [u.key_file])
        run = self.calibrate_or_tell(unit)
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
