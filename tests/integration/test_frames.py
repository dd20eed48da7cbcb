"""An INS that speaks no UDS (config/profiles/frames.toml): it streams its samples in plain frames while it turns, and turns move by move.
A whole calibration with one in Python; and a frame of the stream that is lost is told, and nothing is made of the rest."""
import json
import math
import time
import unittest

import case
import profile_case

LOST = 5000  # of this sample a frame does not come


class Frames(profile_case.UnderProfile):
    def test_frames(self):
        ours = self.bench_of("selfcal.toml").start()
        own = self.calibrate(ours)
        ours.stop()

        times = [profile_case.DWELL_S, ours.ins_keys.get("rotation_s", 5.0)]
        unit, memory = self.bench_with("streaming_ins.py", "frames.toml", lambda _: [], *times, speed=profile_case.SLOW)
        run = self.calibrate_or_tell(unit)
        self.assert_same(run, own, "an INS that speaks no UDS")
        held = json.loads(memory.read_text(encoding="ascii"))
        self.assertEqual(held["version"], 1)
        for parameter in run["result"]["parameters"]:
            value = parameter["value"] if parameter["determined"] and parameter["plausible"] else 0.0
            micro = math.pi / 648000 * 1e6 if "misalignment" in parameter["name"] else 1.0  # arcseconds in urad
            self.assertTrue(math.isclose(held[parameter["name"]], value * micro, rel_tol=1e-6, abs_tol=6e-4),
                            (parameter, held[parameter["name"]]))
        print("the INS that speaks no UDS holds what the run says, version", held["version"], flush=True)
        self.stopped_in_the_middle(unit, memory, held)
        unit.stop()
        unit.foreign.terminate()
        unit.foreign.wait()

        unit, memory = self.bench_with("streaming_ins.py", "frames.toml", lambda _: [], *times, LOST, speed=profile_case.SLOW)
        failed = unit.wait_for_end(unit.start_run("--schedule", "horizontal", "--force", "short dwell"))
        self.assertEqual((failed["state"], failed["exit_status"]), ("failed", case.DEVICE_TROUBLE), failed["reason"])
        self.assert_one_line(failed["reason"], f"position 5: frame 0x301 of sample {LOST} did not come")
        self.assertEqual(json.loads(memory.read_text(encoding="ascii"))["version"], 0)

    def stopped_in_the_middle(self, unit, memory, held):
        run = unit.start_run("--schedule", "horizontal", "--force", "short dwell")
        unit.wait_until(lambda seen: seen["state"] == "rotating" and seen["pages_pulled"] >= 1, "rotation")
        time.sleep(1.0)
        unit.selfcal("abort", unit.name, "--reason", "test")
        ended = unit.wait_for_end(run)
        self.assertEqual(ended["state"], "aborted", ended["reason"])
        self.assertEqual(json.loads(memory.read_text(encoding="ascii")), held)


if __name__ == "__main__":
    unittest.main()
