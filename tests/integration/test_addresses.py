"""An INS without data identifiers (config/profiles/addresses.toml): a whole calibration of the virtual one and of one in Python, which was
written from the description of the profile alone; and the power of the latter goes in the middle of a set, which it holds byte by
byte: the old set is put back."""
import json
import math
import unittest

import profile_case


class Addresses(profile_case.UnderProfile):
    def test_addresses(self):
        ours = self.bench_of("selfcal.toml").start()
        own = self.calibrate(ours)
        ours.stop()
        virtual = self.bench_of("addresses.toml").start()
        self.assert_same(self.calibrate(virtual), own, "the virtual INS under addresses.toml")
        virtual.stop()

        unit, memory = self.bench_with("addressed_ins.py", "addresses.toml", lambda u: [u.key_file], 3)
        run = self.calibrate_or_tell(unit)
        self.assert_same(run, own, "an INS in Python without identifiers")
        self.assertEqual(run["serial"], "FOREIGN-6")
        held = json.loads(memory.read_text(encoding="ascii"))["held"]
        self.assertEqual(held["version"], 1)
        units = {"ug": 1e-3, "arcsec": math.pi / 0.648}  # in mg and urad
        for parameter in run["result"]["parameters"]:
            value = parameter["value"] if parameter["determined"] and parameter["plausible"] else 0.0
            value *= units.get(parameter["unit"], 1.0)
            self.assertTrue(math.isclose(held["values"][parameter["name"]], value, rel_tol=1e-9, abs_tol=1e-12),
                            (parameter, held["values"][parameter["name"]]))
        print("the INS without identifiers holds what the run says, version", held["version"], flush=True)

        failed = self.loses_power(unit, memory, cuts_left=0)
        self.assertEqual(json.loads(memory.read_text(encoding="ascii"))["held"], held)
        print("its power went in the middle of the second set:", failed["reason"], flush=True)


if __name__ == "__main__":
    unittest.main()
