"""A day of INS time, many calibrations, one service: does anything grow?"""
import argparse
import math
import sys
import tempfile
import time

import watch

import bench  # noqa: E402

# Beyond the first tenth of the runs, memory may still take up SQLite's page cache, 2000 KiB by default, and the history
# that a trend needs, some 25 values a run; an object that is kept per run (the samples of one: 1 MB) is far above that.
GROWTH_KIB = 3000
CPU_RATIO = 1.5


# The horizontal schedule, as short as it may be: all its turns, 13,250 samples. Between two runs the INS idles, and the
# service listens to it: as on a bench, and frames of a longer dwell would try nothing else.
DWELL_S = 10.0
ROTATION_S = 18 * DWELL_S + 17 * 5.0


class Soak:
    def __init__(self, folder, runs, speed, day_s, minutes):
        self.runs = runs
        self.end = time.monotonic() + 60 * minutes
        self.idle_s = max(0.0, day_s / runs - ROTATION_S) / speed   # of ours
        self.unit = bench.Bench(folder, speed=speed, sim={"serial": "SOAK-0001", "sample_rate_hz": 50.0},
                                ins={"drift_check_s": 0.0, "fd": True, "dwell_s": DWELL_S}, sim_options=["--fd"],
                                daemon={"recordings_quota_mib": 10.0})
        self.rows = []

    def go(self):
        self.unit.start()
        process = watch.Process(self.unit.daemon_process.pid)
        log = watch.ServiceLog(self.unit)
        cpu = process.cpu_s()
        while len(self.rows) < self.runs and time.monotonic() < self.end:
            log.forget()
            run = self.unit.start_run("--force", "soak")
            log.wait_for_end(run)
            state = self.unit.document(run)["state"]
            time.sleep(self.idle_s)   # what the run's end has left to do is done then
            used = process.cpu_s() - cpu
            cpu += used
            self.rows.append({"run": run, "rss": process.rss_kib(), "fds": process.descriptors(),
                              "threads": process.threads(), "cpu": used, "state": state})
            row = self.rows[-1]
            print(f"{run:5}{row['rss']:12}{row['fds']:6}{row['threads']:9}{used:9.2f}   {row['state']}", flush=True)

    def complaints(self):
        tenth = max(1, len(self.rows) // 10)
        early, late = self.rows[tenth - 1], self.rows[-1]
        cpu_early = sum(row["cpu"] for row in self.rows[:tenth]) / tenth
        cpu_late = sum(row["cpu"] for row in self.rows[-tenth:]) / tenth
        growth = late["rss"] - early["rss"]
        print(f"from run {early['run']} to run {late['run']}: RSS {early['rss']} -> {late['rss']} KiB ({growth:+}, limit "
              f"{GROWTH_KIB}), descriptors {early['fds']} -> {late['fds']}, threads {early['threads']} -> "
              f"{late['threads']}, CPU per run of the last {tenth} against the first: {cpu_late / cpu_early:.2f} "
              f"(limit {CPU_RATIO})")
        if growth > GROWTH_KIB:
            yield f"memory grew by {growth} KiB"
        if late["fds"] != early["fds"]:
            yield f"{late['fds'] - early['fds']:+} descriptors"
        if late["threads"] != early["threads"]:
            yield f"{late['threads'] - early['threads']:+} threads"
        if cpu_late > CPU_RATIO * cpu_early:
            yield "a run costs more and more"
        ended = [row for row in self.rows if row["state"] != "completed"]
        if ended:
            yield f"{len(ended)} runs did not complete, the first of them run {ended[0]['run']}: {ended[0]['state']}"


def main():
    parser = argparse.ArgumentParser(prog="tests/service/soak", description=__doc__)
    parser.add_argument("--runs", type=int, default=100)
    parser.add_argument("--hours", type=float, default=24.0, help="of INS time, all runs together (default 24)")
    parser.add_argument("--speed", type=float, default=400.0, help="the INS's clock, times real time (default 400)")
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin no run after so long; figures are printed")
    options = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="selfcal_soak.") as folder:
        soak = Soak(folder, options.runs, options.speed, options.hours * 3600.0, options.minutes)
        try:
            print(f"{'run':>5}{'RSS KiB':>12}{'fds':>6}{'threads':>9}{'CPU s':>9}", flush=True)
            soak.go()
        finally:
            soak.unit.stop()
        complaints = list(soak.complaints()) + watch.database_faults(soak.unit.folder / "state")
    done = len(soak.rows)
    print(f"{done} of {options.runs} runs, {options.hours * done / options.runs:g} of {options.hours:g} h of INS time in "
          f"{time.monotonic() - began:.0f} s")
    for complaint in complaints:
        print(f"soak: {complaint}")
    return 1 if complaints else 0


if __name__ == "__main__":
    sys.exit(main())
