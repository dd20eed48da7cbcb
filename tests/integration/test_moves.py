"""The virtual INS as one that speaks UDS and is turned move by move (config/profiles/moves.toml): whole calibrations, moves by a routine and
by a write, over by angle and by state; and what goes wrong on the way ends the run with one line."""
import tempfile
import unittest
from pathlib import Path

import case
import profile_case

BY_ANGLE = """routine = 0x0A21
there = "angle"
tolerance_deg = 1.5
rest_deg = 0.05
"""
BY_STATE = """did = 0x0A05
there = "state"
"""


class Moves(profile_case.UnderProfile):
    def virtual(self, *options, profile=None):
        unit = self.bench_of("moves.toml", speed=profile_case.SLOW)
        if profile is not None:
            file = unit.folder / "other.toml"
            file.write_text(profile, encoding="utf-8")
            unit.ins_keys["profile"] = str(file)
            unit.sim_options = ["--profile", file]
            unit.write_daemon_config([unit], {})
        unit.sim_options += options
        return unit.start()

    def assert_true(self, unit, run, what):
        """Against the truth: how long a dwell lasts is a matter of when its move was over, so that its noise falls on other moments than
        under a schedule. 24 values: 5 sigma are missed once in 70,000 runs."""
        truth = unit.truth()
        worst = max(abs(p["value"] - truth[p["name"]]) / p["sigma"] for p in run["result"]["parameters"])
        print(f"{what} against its truth: worst of 24 {worst:.1f} sigma", flush=True)
        self.assertLess(worst, 5.0)

    def fails(self, unit, *words):
        failed = unit.wait_for_end(unit.start_run("--schedule", unit.short, "--force", "short dwell"))
        self.assertEqual((failed["state"], failed["exit_status"]), ("failed", case.DEVICE_TROUBLE), failed["reason"])
        self.assert_one_line(failed["reason"], *words)
        return failed

    def test_calibration(self):
        unit = self.virtual()
        self.assert_true(unit, self.calibrate(unit), "the virtual INS under moves.toml")
        self.interrupted(unit)

    def test_by_a_write_by_state_and_streamed(self):
        text = (profile_case.PROFILES / "moves.toml").read_text(encoding="utf-8")
        self.assertEqual(text.count(BY_ANGLE), 1)
        unit = self.virtual(profile=profile_case.streaming(text.replace(BY_ANGLE, BY_STATE)))
        self.assert_true(unit, self.calibrate(unit), "moves by a write, over by state, and samples streamed")
        unit.end_daemon()
        done = unit.selfcal("device", "check", unit.interface, "--profile", unit.folder / "other.toml", "--write", check=False, timeout=120)
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"holds +move\.taken: .*\n(.*\n)*.* 0 fail")

    def interrupted(self, unit):
        """An abort in the middle; and a service that is killed loses the rotation, says so and stops it."""
        for what in ("abort", "kill"):
            run = unit.start_run("--schedule", unit.short, "--force", "short dwell")
            unit.wait_until(lambda seen: seen["state"] == "rotating" and seen["pages_pulled"] >= 10, "rotation")
            if what == "abort":
                unit.selfcal("abort", unit.name, "--reason", "test")
            else:
                unit.kill_daemon()
                unit.start_daemon()
            ended = unit.wait_for_end(run)
            self.assertEqual(ended["state"], "aborted" if what == "abort" else "failed", ended["reason"])
            self.assert_one_line(ended["reason"], "test" if what == "abort" else "the rotation is lost: the ins is aborted")
            unit.end_daemon()  # nobody else may ask
            told = unit.selfcal("device", "probe", unit.interface, "--profile", profile_case.PROFILES / "moves.toml", "--only", "--listen", 0.2,
                                "--first-did", "0A01", "--last-did", "0A01")
            self.assertRegex(told.stdout, r"0A01 +16 bytes: [0-7]6 ")  # complete, and the gimbal at rest
            unit.start_daemon()

    def test_a_lost_frame_ends_a_stream(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="selfcal_faults.")))
        scenario = folder / "drop.toml"
        scenario.write_text("seed = 1\n[[fault]]\nkind = 'drop'\nprobability = 0.001\nat_s = 10\nstate = 'rotating'\n", encoding="ascii")
        text = (profile_case.PROFILES / "moves.toml").read_text(encoding="utf-8")
        unit = self.virtual("--scenario", scenario, profile=profile_case.streaming(text))
        self.fails(unit, "the samples are of no use: .*(did not come|are missing)")
        unit.wait_until(lambda _: "gimbal stopped at" in unit.log("sim_ins"), "the gimbal rests")

    def test_faults(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="selfcal_faults.")))
        for k, (fault, words) in enumerate((("kind = 'stuck_gimbal'\nvalue = 3", "at position 4: position 4 is not reached within 60 s: the gimbal is at"),
                                            ("kind = 'nrc'\nvalue = 0x22\nat_s = 30\nstate = 'rotating'", "conditionsnotcorrect"),
                                            ("kind = 'reset'\nat_s = 30\nstate = 'rotating'", "it is idle|the ins is|power"))):
            with self.subTest(fault):
                scenario = folder / f"{k}.toml"
                scenario.write_text(f"seed = 1\n[[fault]]\n{fault}\n", encoding="ascii")
                unit = self.virtual("--scenario", scenario)
                try:
                    self.fails(unit, words)
                finally:
                    unit.stop()


if __name__ == "__main__":
    unittest.main()
