"""Whatever goes wrong on the way: one clear line, the documented exit status, the old coefficients in force, no hang."""
import subprocess
import time
import unittest

import case


def link(interface, state):
    subprocess.run(["ip", "link", "set", interface, state], check=True)


class Failures(case.OnBench):
    def rotating(self, unit, pages=1):
        """A run whose gimbal turns, with some pages pulled already."""
        run = unit.start_run("--schedule", unit.short, "--force", "short schedule")
        unit.wait_until(lambda s: s["state"] == "rotating" and s["pages_pulled"] >= pages, "rotation")
        return run

    def assert_failed(self, unit, run, status, *words):
        document = unit.wait_for_end(run, timeout=240)
        self.assertEqual(document["exit_status"], status, document)
        self.assert_one_line(document["reason"], *words)

    def test_power_lost_in_rotation(self):
        unit = self.bench().start()
        run = self.rotating(unit)
        unit.kill_ins()
        self.assert_failed(unit, run, case.DEVICE_TROUBLE, unit.interface)
        unit.truth_file.unlink()
        unit.start_ins()
        self.assert_old_coefficients(unit)

    def test_power_lost_in_transfer(self):
        # At 1000 Hz pages fill half the bus's time, so one is on its way at most moments.
        # Slow enough that whoever looks now and then sees the rotation: it takes 7 s.
        unit = self.bench(sim={"sample_rate_hz": 1000.0}, speed=10.0).start()
        run = self.rotating(unit, pages=30)
        unit.kill_ins()
        self.assert_failed(unit, run, case.DEVICE_TROUBLE, unit.interface)
        unit.truth_file.unlink()
        unit.start_ins()
        self.assert_old_coefficients(unit)

    def test_bus_away_for_a_while(self):
        unit = self.bench(ins={"lost_after_s": 20.0}, speed=2.0).start()
        self.addCleanup(link, unit.interface, "up")
        run = self.rotating(unit)
        link(unit.interface, "down")
        time.sleep(5)
        link(unit.interface, "up")
        document = unit.wait_for_end(run, timeout=240)
        self.assertIn(document["state"], ("completed", "refused"), document)
        self.assertTrue([e for e in document["events"] if "link" in e["text"].lower()], document["events"])

    def test_bus_away_for_good(self):
        unit = self.bench(ins={"lost_after_s": 2.0}).start()
        self.addCleanup(link, unit.interface, "up")
        run = self.rotating(unit)
        link(unit.interface, "down")
        self.assert_failed(unit, run, case.DEVICE_TROUBLE, unit.interface)
        link(unit.interface, "up")
        self.assert_old_coefficients(unit)

    def test_wrong_key(self):
        unit = self.bench()
        unit.start_ins()
        unit.key_file.write_text("00112233445566778899aabbccddeeff\n", encoding="ascii")
        unit.start_daemon()
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE, done.stderr)
        self.assert_one_line(done.stderr, "invalidkey|invalid key|0x35")
        self.assert_old_coefficients(unit)

    def test_every_request_refused(self):
        unit = self.bench(sim_options=["--fault", "nrc=0x22"]).start()
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE, done.stderr)
        self.assert_one_line(done.stderr, "conditionsnotcorrect", "0x22")

    def test_page_with_a_wrong_crc(self):
        unit = self.bench(sim_options=["--fault", "crc=2"]).start()
        document = unit.wait_for_end(unit.start_run("--schedule", unit.short))
        # Read again, and good then; the schedule is too short for an answer that may be written.
        self.assertEqual(document["exit_status"], case.ANSWER_IS_NO, document)
        self.assertTrue([e for e in document["events"] if "1 fetched again" in e["text"]], document["events"])
        self.assert_old_coefficients(unit)

    def test_nobody_there(self):
        unit = self.bench(ins={"request_timeout_s": 0.2, "lost_after_s": 1.0})
        unit.start_daemon()
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE)
        self.assert_one_line(done.stderr, unit.interface)

    def no_link(self, unit, *words):
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE, done.stderr)
        self.assert_one_line(done.stderr, *words)

    def short_patience(self):
        return {"request_timeout_s": 0.3, "lost_after_s": 2.0}

    def test_no_link_with_the_ins_switched_off(self):
        unit = self.bench(ins=self.short_patience())
        unit.start_daemon()
        self.no_link(unit, "no frame at all is on the bus")

    def test_no_link_with_a_wrong_request_id(self):
        unit = self.bench(ins=self.short_patience() | {"request_id": 0x641}).start()
        self.no_link(unit, "the ins is alive", "does not answer 0x641", "check request_id")

    def test_no_link_classic_against_fd(self):
        unit = self.bench(ins=self.short_patience(), sim_options=["--fd"]).start()
        self.no_link(unit, "as can fd, and fd = false is configured")

    def test_no_link_fd_against_classic(self):
        unit = self.bench(ins=self.short_patience() | {"fd": True}).start()
        self.no_link(unit, "the ins is alive", "fd = true is configured")

    def test_no_link_without_the_interface(self):
        unit = self.bench(ins=self.short_patience() | {"interface": "absent7"})
        unit.start_daemon()
        self.no_link(unit, "absent7", "no such device")

    def test_no_link_with_the_interface_down(self):
        unit = self.bench(ins=self.short_patience())
        self.addCleanup(link, unit.interface, "up")
        link(unit.interface, "down")
        unit.start_daemon()
        self.no_link(unit, unit.interface, "is down")

    def test_no_service(self):
        unit = self.bench()
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE)
        self.assert_one_line(done.stderr, "org.selfcal.manager1|selfcald")


if __name__ == "__main__":
    unittest.main()
