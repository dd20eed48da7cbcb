"""An INS in Python that speaks UDS and is turned move by move, written from the description of config/profiles/moves.toml alone: on the same
sensor data the 24 are those of our own INS."""
import json
import math
import unittest

import profile_case


class MovingIns(profile_case.UnderProfile):
    def test_an_ins_in_python(self):
        """Its time stands still until the move that its data have next is commanded: the same data as our own INS's."""
        ours = self.bench_of("selfcal.toml").start()
        own = self.calibrate(ours)
        ours.stop()
        times = [profile_case.DWELL_S, ours.ins_keys.get("rotation_s", 5.0)]
        unit, memory = self.bench_with("moving_ins.py", "moves.toml", lambda _: [], *times, speed=profile_case.SLOW)
        run = self.calibrate_or_tell(unit)
        self.assert_same(run, own, "an INS in Python that is turned move by move")
        held = json.loads(memory.read_text(encoding="ascii"))
        self.assertEqual(held["version"], 1)
        units = {"ug": 1e-3, "arcsec": math.pi / 648.0}  # in mg and mrad
        for parameter in run["result"]["parameters"]:
            value = parameter["value"] if parameter["determined"] and parameter["plausible"] else 0.0
            value *= units.get(parameter["unit"], 1.0)
            self.assertTrue(math.isclose(held["values"][parameter["name"]], value, rel_tol=1e-6, abs_tol=1e-9),
                            (parameter, held["values"][parameter["name"]]))
        print("the INS in Python holds what the run says, version", held["version"], flush=True)


if __name__ == "__main__":
    unittest.main()
