"""A whole calibration under a profile: our own as a file, another one with the virtual INS, and an INS in Python that was written
from the description of that profile alone. On the same sensor data the 24 are the same."""
import concurrent.futures
import json
import math
import unittest

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
        done = checked.result()
        self.assertEqual(done.returncode, 0, done.stdout + done.stderr)
        self.assertRegex(done.stdout, r"holds +transfer\.page: .*\n(.*\n)*.* 0 fail")

    def by_files(self):
        """example.toml with RequestFileTransfer in the place of RequestUpload. It must be what brought the pages. And what
        `device check` says of it, which takes its time."""
        text = (profile_case.PROFILES / "example.toml").read_text(encoding="utf-8")
        upload = "[upload]\naddress = \"byte\"\naddress_bytes = 3\nsize_bytes = 3\n"
        self.assertEqual(text.count(upload), 1)
        unit = self.bench_of("example.toml", interface="vcan1")
        profile = unit.folder / "files.toml"
        profile.write_text(text.replace(upload, "[file]\nname = \"/raw/{run}/{page:6}.bin\"\n"), encoding="utf-8")
        unit.ins_keys["profile"] = str(profile)
        unit.sim_options = ["--profile", profile]
        unit.write_daemon_config([unit], {})
        unit.start()
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
