"""Numbered scenarios of a hostile machine: each is survived or refused with one clear line."""
import os
import random
import sqlite3
import subprocess
import time
import unittest
from pathlib import Path

import case
from case import bench


class Adversity(case.OnBench):
    def tmpfs(self, folder, size):
        folder.mkdir()
        subprocess.run(["mount", "-t", "tmpfs", "-o", f"size={size}", "tmpfs", folder], check=True)
        self.addCleanup(subprocess.run, ["umount", "-l", folder], check=False)

    def refused_start(self, unit, *words):
        """The service does not start, and says why."""
        done = subprocess.run([bench.BIN / "selfcald", "--config", unit.folder / "selfcald.toml"], capture_output=True,
                              text=True, timeout=20, check=False)
        self.assertNotEqual(done.returncode, 0)
        self.assert_one_line(done.stderr, *words)

    def test_01_disk_full_stops_a_run_before_it_begins(self):
        unit = self.bench(daemon={"free_space_mib": 8.0})
        self.tmpfs(unit.folder / "state", "4m")
        unit.start()
        done = unit.selfcal("run", unit.name, check=False)
        self.assertEqual(done.returncode, case.DEVICE_TROUBLE, done.stderr)
        self.assert_one_line(done.stderr, "free|space")

    def test_02_read_only_database(self):
        unit = self.bench()
        self.tmpfs(unit.folder / "state", "64m")
        unit.start_daemon()
        unit.stop()
        subprocess.run(["mount", "-o", "remount,ro", unit.folder / "state"], check=True)
        self.refused_start(unit, "selfcal.db|state")

    def test_03_damaged_database_page(self):
        unit = self.bench().start()
        unit.wait_for_end(unit.start_run("--schedule", unit.short, "--dry-run"))
        unit.stop()
        database = unit.folder / "state" / "selfcal.db"
        for log in database.parent.glob("selfcal.db-*"):
            log.unlink()
        # Every page but the first, whose header says that it is a database at all.
        with open(database, "r+b") as file:
            file.seek(4096)
            file.write(random.Random(3).randbytes(database.stat().st_size - 4096))
        self.refused_start(unit, "selfcal.db", "integrity|damaged|malformed|corrupt")

    @unittest.skipIf(os.environ.get("VCAN_RUN") != "uml", "the clock of the machine is not ours")
    def test_04_clock_set_back_by_a_year(self):
        unit = self.bench().start()
        run = unit.start_run("--schedule", unit.short, "--dry-run")
        unit.wait_until(lambda s: s["state"] == "rotating", "rotation")
        now = time.time()
        time.clock_settime(time.CLOCK_REALTIME, now - 365 * 86400)
        self.addCleanup(lambda: time.clock_settime(time.CLOCK_REALTIME, now))
        self.assertIn(unit.wait_for_end(run)["state"], ("completed", "refused"))

    def test_05_lcm_route_gone_and_back(self):
        unit = self.bench(speed=10.0).start()
        route = ["239.255.76.67/32", "dev", "lo", "src", "127.0.0.1"]
        run = unit.start_run("--schedule", unit.short, "--dry-run")
        subprocess.run(["ip", "route", "del", *route], check=True)
        time.sleep(1)
        subprocess.run(["ip", "route", "add", *route], check=True)
        self.assertIn(unit.wait_for_end(run)["state"], ("completed", "refused"))
        # Said once when it goes and once when it is back, however long that is.
        said = [line for line in unit.log("selfcald").splitlines() if "lcm" in line.lower()]
        self.assertLessEqual(len(said), 2, said)

    def test_06_message_bus_gone_and_back(self):
        unit = self.bench(speed=10.0)
        address = f"unix:path=/run/selfcal-test-{os.getpid()}"
        os.environ["SELFCAL_BUS"] = address
        self.addCleanup(os.environ.pop, "SELFCAL_BUS")

        def start_bus():
            bus = subprocess.Popen(["dbus-daemon", "--session", "--nofork", "--nopidfile", f"--address={address}"],
                                   stdin=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            self.addCleanup(bus.wait)
            self.addCleanup(bus.kill)
            end = time.monotonic() + 20
            while not Path(address.removeprefix("unix:path=")).is_socket() and time.monotonic() < end:
                time.sleep(0.05)
            return bus

        bus = start_bus()
        unit.start()
        run = unit.start_run("--schedule", unit.short, "--force", "short schedule")
        unit.wait_until(lambda s: s["state"] == "rotating", "rotation")
        bus.kill()
        bus.wait()
        Path(address.removeprefix("unix:path=")).unlink(missing_ok=True)

        def state():
            with sqlite3.connect(unit.folder / "state" / "selfcal.db") as database:
                return database.execute("SELECT state FROM runs WHERE id = ?", [run]).fetchone()[0]

        end = time.monotonic() + 120
        while state() not in ("completed", "failed", "aborted", "refused") and time.monotonic() < end:
            time.sleep(0.5)
        self.assertEqual(state(), "completed", unit.log("selfcald"))
        start_bus()
        end = time.monotonic() + 60
        while unit.selfcal("status", check=False).returncode != 0 and time.monotonic() < end:
            time.sleep(0.5)
        self.assertEqual(unit.document(run)["state"], "completed")
        lost = [line for line in unit.log("selfcald").splitlines() if "d-bus" in line.lower() and "lost" in line.lower()]
        self.assertLessEqual(len(lost), 1, "said once")

    def test_07_four_units_one_of_them_faulty(self):
        units = [self.bench(interface=f"vcan{i}", name=f"unit{i}", sim={"serial": f"TEST-000{i}"}) for i in range(4)]
        for unit in units:
            unit.start_ins()
        service = units[0]
        service.write_daemon_config(units, {})
        service.start_daemon()
        runs = [unit.start_run("--schedule", service.short, "--dry-run") for unit in units]
        time.sleep(0.5)
        units[2].kill_ins()
        endings = [service.wait_for_end(run) for run in runs]
        self.assertEqual(endings[2]["exit_status"], case.DEVICE_TROUBLE, endings[2])
        for ending in endings[:2] + endings[3:]:
            self.assertIn(ending["state"], ("completed", "refused"), ending)


if __name__ == "__main__":
    unittest.main()
