"""The virtual INS as one that speaks no UDS (config/profiles/frames.toml): a whole calibration, and its faults."""
import socket
import struct
import tempfile
import unittest
from pathlib import Path

import case
import profile_case

STATE = 0x310


class VirtualFrames(profile_case.UnderProfile):
    def virtual(self, *options):
        unit = self.bench_of("frames.toml", sim={"noise": profile_case.FRAMES_COUNTS})
        unit.sim_options += options
        return unit.start()

    def version_in_force(self, unit):
        with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as can:
            can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", STATE, 0xC00007FF))
            can.bind((unit.interface,))
            can.settimeout(5.0)
            return int.from_bytes(can.recv(16)[8:10], "little") >> 4

    def test_calibration(self):
        """It is commanded move by move, so that its noise falls on other moments than under a schedule: held against its truth."""
        unit = self.virtual()
        run = self.calibrate(unit)
        truth = unit.truth()
        # 24 values: 5 sigma are missed once in 70,000 runs.
        worst = max(abs(p["value"] - truth[p["name"]]) / p["sigma"] for p in run["result"]["parameters"])
        print(f"the virtual INS under frames.toml against its truth: worst of 24 {worst:.1f} sigma", flush=True)
        self.assertLess(worst, 5.0)
        self.assertEqual(self.version_in_force(unit), 1)

    def test_faults(self):
        folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="selfcal_faults.")))
        # After a reset its samples stop, and its state frame says that it starts: whichever comes first ends the run.
        restarted = "no sample came|power|the ins is starting"
        for k, (fault, words) in enumerate((("kind = 'stuck_gimbal'\nvalue = 3", "position 4 is not reached within 30 s"),
                                            ("kind = 'drop'\nprobability = 0.001", "did not come|are missing"),
                                            ("kind = 'reset'\nat_s = 60\nstate = 'rotating'", restarted))):
            with self.subTest(fault):
                scenario = folder / f"{k}.toml"
                scenario.write_text(f"seed = 1\n[[fault]]\n{fault}\n", encoding="ascii")
                unit = self.virtual("--scenario", scenario)
                failed = unit.wait_for_end(unit.start_run("--schedule", "horizontal", "--force", "short dwell"))
                self.assertEqual((failed["state"], failed["exit_status"]), ("failed", case.DEVICE_TROUBLE), failed["reason"])
                self.assert_one_line(failed["reason"], words)
                self.assertEqual(self.version_in_force(unit), 0)
                unit.stop()


if __name__ == "__main__":
    unittest.main()
