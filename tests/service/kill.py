"""kill -9 of the service at random instants of calibrations in compressed time: what becomes of the runs?"""
import argparse
import collections
import math
import random
import re
import sys
import tempfile
import time

import watch

import bench  # noqa: E402
import case  # noqa: E402
import witness  # noqa: E402

SPEED = 20.0
# In which a run can be found; half of the kills aim at one of them, drawn evenly, so that short ones are hit as well.
STATES = ("connecting", "unlocking", "scheduling", "starting", "rotating", "draining", "estimating", "judging",
          "checking_old", "erasing", "writing", "verifying", "committing", "resetting", "confirming", "checking_new")
AIMED_WITHIN_S = 0.05
RUN_S = 8.0            # about what a run takes at this speed
KILLS_IN_A_RUN = (1, 9)   # wanted; a run may be over before


class Trial:
    def __init__(self, folder, seed):
        self.draw = random.Random(seed)
        self.unit = bench.Bench(folder, speed=SPEED, seed=seed, sim={"serial": "KILL-0001", "sample_rate_hz": 50.0},
                                ins={"drift_check_s": 30.0, "fd": True}, sim_options=["--fd"])
        (self.unit.folder / "short.toml").write_text(case.SHORT_SCHEDULE, encoding="ascii")
        self.state_directory = self.unit.folder / "state"
        self.killed_in, self.ends, self.faults = collections.Counter(), collections.Counter(), []
        self.version, self.held = 0, None
        self.log_begin = 0   # of the run, in the service's log

    def start(self):
        self.unit.start()
        self.version, self.held = witness.coefficients_in_force(self.unit.interface)

    # --- what the service wrote, read where it is new only: reading must not cost the processor that is tried ---------
    def log_of_this_run(self):
        with open(self.unit.folder / "selfcald.log", encoding="utf-8", errors="replace") as file:
            file.seek(self.log_begin)
            return file.read()

    @staticmethod
    def ended(run, log):
        return re.search(rf"run {run}: ({'|'.join(watch.FINAL)}): ", log)

    def wait_for_end(self, run):
        end = time.monotonic() + 600
        while not self.ended(run, self.log_of_this_run()) and time.monotonic() < end:
            time.sleep(0.1)
        return self.unit.wait_for_end(run, timeout=60)

    # --- kills -------------------------------------------------------------------------------------------------
    def await_instant(self, run):
        """Waits for a moment of the run. False if the run was over before it came."""
        aimed = self.draw.random() < 0.5
        wanted = self.draw.choice(STATES)
        instant = time.monotonic() + self.draw.uniform(0.0, RUN_S)
        delay = self.draw.uniform(0.0, AIMED_WITHIN_S)
        while True:
            log = self.log_of_this_run()
            if self.ended(run, log):
                return False
            if aimed and f"run {run}: {wanted}: " in log:
                time.sleep(delay)
                return True
            if not aimed and time.monotonic() > instant:
                return True
            time.sleep(0.005)

    def kill(self, run):
        self.unit.kill_daemon()
        states = watch.with_copy(self.state_directory, lambda database: database.execute(
            "SELECT state FROM runs WHERE id = ?", [run]).fetchall())
        self.killed_in[states[0][0]] += 1
        self.faults += [f"run {run}, killed while {states[0][0]}: {fault}"
                        for fault in watch.database_faults(self.state_directory)]
        self.unit.start_daemon()

    # --- runs --------------------------------------------------------------------------------------------------
    def run(self, kills):
        rotations = self.rotations()
        self.log_begin = (self.unit.folder / "selfcald.log").stat().st_size
        run = self.unit.start_run("--schedule", self.unit.folder / "short.toml",
                                  "--force", "trial of kills")
        for _ in range(kills):
            if self.await_instant(run):
                self.kill(run)
        document = self.wait_for_end(run)
        self.ends[document["state"]] += 1
        complain = lambda text: self.faults.append(f"run {run}, {document['state']}: {text}")  # noqa: E731
        if document["state"] != "completed":
            complain(document["reason"])
        if self.rotations() - rotations > 1:
            complain("the gimbal was started twice")
        if self.unit.status()["state"] not in watch.FINAL | {"idle", ""}:
            complain(f"the service still says {self.unit.status()['state']}")
        for path in watch.left_over(self.state_directory):
            complain(f"left over: {path}")
        for row in watch.unfinished(self.state_directory):
            complain(f"database: run {row[0]} is {row[1]} for ever")
        self.check_coefficients(document, complain)

    def rotations(self):
        return self.unit.log("sim_ins").count("sim_ins: gimbal stopped")

    def check_coefficients(self, document, complain):
        """The whole old set or the whole new one."""
        version, held = witness.coefficients_in_force(self.unit.interface)
        new = dict(self.held)
        if document["result"]:
            new |= {p["name"]: p["value"] for p in document["result"]["parameters"]
                    if p["determined"] and p["plausible"]}
        same = lambda a, b: all(math.isclose(a[n], b[n], rel_tol=1e-9, abs_tol=1e-12) for n in b)  # noqa: E731
        if version > self.version and not same(held, new):
            complain(f"set {version} in force is not what was estimated")
        if version == self.version and not same(held, self.held):
            complain(f"set {version} in force has changed")
        if (version > self.version) != (document["state"] == "completed"):
            complain(f"set {version} in force, {self.version} before")
        self.version, self.held = version, held


def main():
    parser = argparse.ArgumentParser(prog="tests/service/kill", description=__doc__)
    parser.add_argument("kills", nargs="?", type=int, default=200)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--minutes", type=float, default=math.inf, help="begin no run after so long; counts are printed")
    options = parser.parse_args()
    began = time.monotonic()
    with tempfile.TemporaryDirectory(prefix="selfcal_kill.") as folder:
        trial = Trial(folder, options.seed)
        try:
            trial.start()
            while ((done := trial.killed_in.total()) < options.kills
                   and time.monotonic() - began < 60 * options.minutes):
                trial.run(min(options.kills - done, trial.draw.randint(*KILLS_IN_A_RUN)))
                print(f"{trial.killed_in.total()} of {options.kills} kills, {trial.ends.total()} runs, "
                      f"{len(trial.faults)} faults", flush=True)
        finally:
            trial.unit.stop()
        trial.faults += watch.database_faults(trial.state_directory)
    in_states = ", ".join(f"{state} {count}" for state, count in trial.killed_in.most_common())
    ends = ", ".join(f"{state} {count}" for state, count in trial.ends.most_common())
    print(f"{trial.killed_in.total()} kills (seed {options.seed}) in {trial.ends.total()} runs, "
          f"{time.monotonic() - began:.0f} s\n  killed while: {in_states}\n  runs ended: {ends}\n"
          f"  faults found: {len(trial.faults)}")
    for fault in trial.faults:
        print(f"    {fault}")
    return 1 if trial.faults else 0


if __name__ == "__main__":
    sys.exit(main())
