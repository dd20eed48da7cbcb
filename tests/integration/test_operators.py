"""Who may do what, and what happens when two want the same."""
import os
import signal
import subprocess
import time
import unittest

import case
from case import bench


class Operators(case.OnBench):
    def test_second_operator_is_told_who_is_first(self):
        unit = self.bench(speed=5.0).start()
        run = unit.start_run("--schedule", unit.short, "--dry-run")
        second = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(second.returncode, case.DEVICE_TROUBLE)
        self.assert_one_line(second.stderr, "busy", f"run {run}", "since")
        unit.selfcal("abort", unit.name, "--reason", "test")
        self.assertEqual(unit.wait_for_end(run)["state"], "aborted")

    def test_interrupt_stops_safely(self):
        unit = self.bench(speed=5.0).start()
        operator = subprocess.Popen([bench.BIN / "selfcal", "run", unit.name, "--schedule", unit.short],
                                    stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
        unit.wait_until(lambda s: s["state"] == "rotating" and s["pages_pulled"] >= 1, "rotation")
        operator.send_signal(signal.SIGINT)
        _, words = operator.communicate(timeout=30)
        self.assertEqual(operator.returncode, case.ANSWER_IS_NO, words)
        self.assertEqual(unit.document(1)["state"], "aborted")
        self.assert_old_coefficients(unit)

    def test_status_tells_how_the_bus_is(self):
        """An INS that answers, one that is off, an interface that is down. It is asked every 6 s at the most."""
        unit = self.bench().start()
        self.addCleanup(subprocess.run, ["ip", "link", "set", unit.interface, "up"], check=False)
        self.await_status(unit, f"bus               {unit.interface}: up, the INS answers\n")
        unit.kill_ins()
        self.await_status(unit, f"{unit.interface}: up, no answer to 0x640: no frame at all is on the bus")
        subprocess.run(["ip", "link", "set", unit.interface, "down"], check=True)
        self.await_status(unit, f"{unit.interface}: down (ip link set {unit.interface} up)")

    def await_status(self, unit, words, seconds=30.0):
        end = time.monotonic() + seconds
        while words not in (text := unit.selfcal("status").stdout):
            self.assertLess(time.monotonic(), end, f"'{words}' expected: {text}")
            time.sleep(0.5)
        print(text, end="", flush=True)

    @unittest.skipIf(os.getuid() != 0 or os.environ.get("VCAN_RUN") != "uml", "needs other users: user-mode Linux")
    def test_an_outsider_may_look_but_not_act(self):
        unit = self.bench().start()
        # The build may lie where nobody else may look.
        outsider = ["setpriv", "--reuid", "65534", "--regid", "65534", "--clear-groups"]
        call = ["dbus-send", f"--bus={os.environ['DBUS_SYSTEM_BUS_ADDRESS']}", "--print-reply",
                "--dest=org.selfcal.Manager1", "/org/selfcal/Manager"]
        look = subprocess.run([*outsider, *call, "org.selfcal.Manager1.History", "string:"], capture_output=True,
                              text=True, check=False)
        self.assertEqual(look.returncode, 0, look.stderr)
        act = subprocess.run([*outsider, *call, "org.selfcal.Manager1.Abort", "string:unit", "string:no"],
                             capture_output=True, text=True, check=False)
        self.assertNotEqual(act.returncode, 0)
        self.assertIn("AccessDenied", act.stderr)


class Restarts(case.OnBench):
    def test_killed_service_takes_up_its_run(self):
        """kill -9 at several instants of one run: it ends as if nothing had been."""
        unit = self.bench(speed=4.0).start()
        run = unit.start_run("--schedule", unit.short, "--dry-run")
        for _ in range(3):
            time.sleep(1.5)
            unit.kill_daemon()
            unit.start_daemon()
        document = unit.wait_for_end(run)
        self.assertIn(document["state"], ("completed", "refused"), document)
        rotations = [e for e in document["events"] if e["text"].startswith("rotating")]
        self.assertEqual(len(rotations), 1, "never a second rotation on top of the first")

    def test_an_abort_in_the_navigation_check_leaves_an_ins_that_obeys(self):
        """The check would take minutes; the service is killed within it, then within its end, and run again at once."""
        unit = self.bench(ins={"drift_check_s": 3600.0}).start()
        run = unit.start_run("--schedule", unit.short, "--force", "test")
        unit.wait_until(lambda s: s["state"] == "checking_old", "navigation check")
        unit.kill_daemon()
        unit.start_daemon()
        unit.selfcal("abort", unit.name, "--reason", "test")
        unit.kill_daemon()
        unit.start_daemon()
        document = unit.wait_for_end(run, timeout=240)
        self.assertEqual(document["state"], "aborted", document)
        self.assert_old_coefficients(unit)
        after = unit.start_run("--schedule", unit.short, "--force", "test", "--dry-run")
        self.assertEqual(unit.wait_for_end(after, timeout=240)["state"], "completed")


if __name__ == "__main__":
    unittest.main()
