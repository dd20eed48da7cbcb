"""A whole calibration under a profile: our own as a file, another one with the virtual INS, and an INS in Python that was written
from the description of that profile alone. On the same sensor data the 24 are the same."""
import concurrent.futures
import json
import math
import tempfile
import unittest
from pathlib import Path

import case
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

        run, checked = self.by_files()
        self.assert_same(run, own, "pages as files, by RequestFileTransfer")

        corrects = self.changed("example.toml", "corrects.toml", ("[coefficients]\n", "[coefficients]\nform = \"correction\"\n"))
        unit, memory = self.bench_with("uploading_ins.py", corrects, lambda u: [u.key_file])
        run = self.calibrate_or_tell(unit)
        self.assert_same(run, own, "an INS in Python that holds what it corrects with")
        held = json.loads(memory.read_text(encoding="ascii"))
        self.assertGreater(held["version"], 0)
        self.assert_corrects(held["values"], {p["name"]: p["value"] if p["determined"] and p["plausible"] else 0.0
                                              for p in run["result"]["parameters"]})
        print("the INS in Python holds what the run says, version", held["version"], flush=True)
        unit = self.bench_of(self.streaming(), interface="vcan2").start()
        self.assert_same(self.calibrate(unit), own, "samples streamed beside UDS")
        unit.stop()
        done = checked.result()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"holds +transfer\.page: .*\n(.*\n)*.* 0 fail")

    def streaming(self):
        """example.toml, its samples in frames while it turns: no pages, and no directory of them."""
        text = profile_case.streaming((profile_case.PROFILES / "example.toml").read_text(encoding="utf-8"))
        folder = tempfile.TemporaryDirectory(prefix="selfcal_profile.")
        self.addCleanup(folder.cleanup)
        path = Path(folder.name) / "streaming.toml"
        path.write_text(text, encoding="utf-8")
        return path

    def test_what_ends_a_stream(self):
        """A lost frame, and a restart of the service, which kept what came before: the run ends as failed, and the gimbal rests."""
        folder = Path(self.enterContext(tempfile.TemporaryDirectory(prefix="selfcal_faults.")))
        scenario = folder / "drop.toml"
        scenario.write_text("seed = 1\n[[fault]]\nkind = 'drop'\nprobability = 0.001\nstate = 'rotating'\n", encoding="ascii")
        for options, words in ((["--scenario", scenario], "of no use: .*(did not come|are missing)"),
                               ([], "kept none: it was started after the rotation began")):
            unit = self.bench_of(self.streaming(), interface="vcan3")
            unit.sim_options += options
            unit.start()
            run = unit.start_run("--schedule", "horizontal", "--force", "short dwell")
            if not options:
                unit.wait_until(lambda seen: seen["state"] == "rotating" and seen["pages_pulled"] >= 1, "rotation")
                unit.kill_daemon()
                unit.start_daemon()
            failed = unit.wait_for_end(run)
            self.assertEqual((failed["state"], failed["exit_status"]), ("failed", case.DEVICE_TROUBLE), failed["reason"])
            self.assert_one_line(failed["reason"], words)
            unit.wait_until(lambda _: "gimbal stopped at" in unit.log("sim_ins"), "the gimbal rests")
            unit.stop()

    def assert_corrects(self, held, errors):
        """One after the other, the sensors' errors and what the INS holds to correct them leave what was there: f and w of any size.
        In ppm and arcseconds; df and dw as the description of the profile has them."""
        ppm, arcsec = 1e-6, math.radians(1 / 3600)

        def terms(values, v, kind):
            if kind == "gyro":
                angles = {"xy": (0, 1), "xz": (0, 2), "yx": (1, 0), "yz": (1, 2), "zx": (2, 0), "zy": (2, 1)}
                out = [values[f"gyro_scale_{axis}"] * ppm * v[k] for k, axis in enumerate("xyz")]
            else:
                angles = {"yx": (1, 0), "zx": (2, 0), "zy": (2, 1)}
                out = [values[f"accel_scale_pos_{axis}"] * ppm * max(v[k], 0) + values[f"accel_scale_neg_{axis}"] * ppm * max(-v[k], 0)
                       for k, axis in enumerate("xyz")]
            for name, (row, column) in angles.items():
                out[row] += values[f"{kind}_misalignment_{name}"] * arcsec * v[column]
            return out

        held = held | {f"accel_scale_neg_{axis}": -held[f"minus_accel_scale_neg_{axis}"] for axis in "xyz"}
        for kind, bias, unit in (("accel", "accel_bias", 9.80665e-6), ("gyro", "gyro_drift", math.radians(1 / 3600))):
            biases = [errors[f"{bias}_{axis}"] for axis in "xyz"]
            for truth in ([9.8, -3.1, 5.2], [-9.8, 3.1, -5.2], [1.0, 0.5, -2.0]):
                said = [a + b + c * unit for a, b, c in zip(truth, terms(errors, truth, kind), biases, strict=True)]
                u = [a - held[f"{bias}_{axis}"] * unit for a, axis in zip(said, "xyz", strict=True)]
                found = [a + b for a, b in zip(u, terms(held, u, kind), strict=True)]
                for a, b in zip(found, truth, strict=True):  # 100 arcseconds times 300 ppm of difference between K+ and K-
                    self.assertAlmostEqual(a, b, delta=9.8 * 1.5e-7 if kind == "accel" else 1e-12)
            unlike = max(abs(held[f"{kind}_misalignment_{n}"]) for n in ("yx", "zx", "zy"))
            self.assertGreater(unlike, 1.0)  # arcseconds: it holds something

    def changed(self, profile, name, *replacements):
        """The profile with other text in some places, as a file of its own."""
        text = (profile_case.PROFILES / profile).read_text(encoding="utf-8")
        for old, new in replacements:
            self.assertEqual(text.count(old), 1, old)
            text = text.replace(old, new)
        folder = tempfile.TemporaryDirectory(prefix="selfcal_profile.")
        self.addCleanup(folder.cleanup)
        path = Path(folder.name) / name
        path.write_text(text, encoding="utf-8")
        return path

    def by_files(self):
        """example.toml with RequestFileTransfer in the place of RequestUpload, and a set of corrections. It must be what
        brought the pages. And what `device check` says of it, which takes its time."""
        profile = self.changed("example.toml", "files.toml", (
            "[upload]\naddress = \"byte\"\naddress_bytes = 3\nsize_bytes = 3\n", "[file]\nname = \"/raw/{run}/{page:6}.bin\"\n"), (
            "[coefficients]\n", "[coefficients]\nform = \"correction-first\"\n"), (
            "fields.gyro_scale = { at = 56, type = \"f64\", count = 3, unit = \"ppm\" }",
            "fields.gyro_scale = { at = 56, type = \"f64\", count = 3, nominal = 4.8e-7 }"))
        unit = self.bench_of(profile, interface="vcan1").start()
        run = self.calibrate(unit)
        command = ["device", "check", unit.interface, "--profile", profile, "--key-file", unit.key_file]
        beside = unit.selfcal(*command, check=False)
        self.assertEqual((beside.returncode, beside.stdout), (case.DEVICE_TROUBLE, ""))
        self.assert_one_line(beside.stderr, "somebody else speaks to the ins")  # the service answers first frames too
        unit.end_daemon()
        pool = concurrent.futures.ThreadPoolExecutor(1)
        self.addCleanup(pool.shutdown)
        return run, pool.submit(unit.selfcal, *command, check=False, timeout=120)


if __name__ == "__main__":
    unittest.main()
