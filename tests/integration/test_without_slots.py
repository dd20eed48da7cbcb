"""An INS without slots (config/profiles/memory.toml): a whole calibration with the virtual INS and with one in Python, and its power goes
in the middle of a set, once while the service is there and once while that is killed too: the old set is put back."""
import json
import math
import unittest

import profile_case


class WithoutSlots(profile_case.UnderProfile):
    def test_without_slots(self):
        """One set, an identifier for each coefficient, one scale factor, raw data from memory; and its power goes in a write."""
        ours = self.bench_of("selfcal.toml").start()
        own = self.calibrate(ours)
        ours.stop()
        virtual = self.bench_of("memory.toml").start()
        self.assert_same(self.calibrate(virtual), own, "the virtual INS under memory.toml")
        virtual.stop()

        unit, memory = self.bench_with("memory_ins.py", "memory.toml", lambda _: [], 10, 4)
        run = self.calibrate_or_tell(unit)
        self.assert_same(run, own, "an INS in Python without slots")
        held = json.loads(memory.read_text(encoding="ascii"))["held"]
        self.assertEqual(held["version"], 1)
        for parameter in run["result"]["parameters"]:
            name, value = parameter["name"], parameter["value"]
            if name.startswith("accel_scale"):
                by_name = {p["name"]: p["value"] for p in run["result"]["parameters"]}
                name = "accel_scale_" + name[-1]
                value = (by_name["accel_scale_pos_" + name[-1]] - by_name["accel_scale_neg_" + name[-1]]) / 2
            if not (parameter["determined"] and parameter["plausible"]):
                value = 0.0
            self.assertTrue(math.isclose(held[name], value, rel_tol=1e-6, abs_tol=6e-4), (parameter, held[name]))
        print("the INS without slots holds what the run says, version", held["version"], flush=True)

        failed = self.loses_power(unit, memory, cuts_left=1)
        self.assertEqual(json.loads(memory.read_text(encoding="ascii"))["held"], held)
        print("its power went in the middle of the second set:", failed["reason"], flush=True)

        failed = self.loses_power(unit, memory, cuts_left=0, while_away=lambda: (unit.kill_daemon(), unit.start_daemon()))
        self.assertEqual(json.loads(memory.read_text(encoding="ascii"))["held"], held)
        print("its power went in the middle of the third set, and the service was killed:", failed["reason"], flush=True)


if __name__ == "__main__":
    unittest.main()
