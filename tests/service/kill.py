"""kill -9 of the service at random instants of calibrations in compressed time, some of them aborted by an operator: what
becomes of the runs?"""
import argparse
import collections
import math
import os
import random
import sys
import tempfile
import time

import watch

import bench  # noqa: E402
import case  # noqa: E402
import witness  # noqa: E402

SPEED = 20.0
# In which a run can be found. Each kill aims at one of them, drawn evenly and taken up in the order of a run, so that short
# ones are hit as well: half of the kills within a moment after it was entered, half anywhere in the seconds after that.
# What follows an abort is aimed at by killing right after it.
STATES = ("connecting", "unlocking", "scheduling", "starting", "rotating", "draining", "estimating", "judging",
          "checking_old", "erasing", "writing", "verifying", "committing", "resetting", "confirming", "checking_new")
AFTER_AN_ABORT = ("ending_check", "stopping")
AIMED_WITHIN_S = 0.05
ANYWHERE_WITHIN_S = 3.0   # of the 9 s that a run takes at least
KILLS_IN_A_RUN = (2, 9)   # wanted; a run may be over before
ABORTED_RUNS = 0.25       # the share of the runs that an operator wants to end


class Trial:
    def __init__(self, folder, seed):
        self.draw = random.Random(seed)
        self.unit = bench.Bench(folder, speed=SPEED, seed=seed, sim={"serial": "KILL-0001", "sample_rate_hz": 50.0},
                                ins={"drift_check_s": 10.0, "fd": True}, sim_options=["--fd"])
        (self.unit.folder / "short.toml").write_text(case.SHORT_SCHEDULE, encoding="ascii")
        self.state_directory = self.unit.folder / "state"
        self.killed_in, self.ends, self.faults = collections.Counter(), collections.Counter(), []
        self.killed_idle = 0
        self.version, self.held = 0, None
        self.log = watch.ServiceLog(self.unit)   # of this run

    def start(self):
        self.unit.start()
        self.version, self.held = witness.coefficients_in_force(self.unit.interface)

    def start_service(self):
        readies = self.log.now().count(" ready\n")
        self.unit.spawn_daemon()
        end = time.monotonic() + 120
        while self.log.now().count(" ready\n") == readies:
            if self.unit.daemon_process.poll() is not None or time.monotonic() > end:
                raise RuntimeError(f"the service does not come up again:\n{self.log.text[-2000:]}")
            time.sleep(0.02)

    # --- kills -------------------------------------------------------------------------------------------------
    def await_instant(self, run, wanted):
        """Waits for a moment after the run entered the state. False if the run was over before it came."""
        delay = self.draw.uniform(0.0, self.draw.choice((AIMED_WITHIN_S, ANYWHERE_WITHIN_S)))
        # The first state is the run's own beginning, of which the log says nothing.
        while wanted != STATES[0] and f"run {run}: {wanted}: " not in self.log.now():
            if self.log.ended(run):
                return False
            time.sleep(0.01)
        time.sleep(delay)
        return not self.log.ended(run)

    def abort(self, run):
        """False if the run was over before the operator could."""
        done = self.unit.selfcal("abort", self.unit.name, "--reason", "trial of kills", check=False)
        if done.returncode != 0 and not self.log.ended(run):
            self.faults.append(f"run {run} cannot be aborted: {done.stderr.strip()}")
        time.sleep(self.draw.uniform(0.0, AIMED_WITHIN_S))
        return done.returncode == 0

    def kill(self, run):
        self.unit.kill_daemon()
        states = watch.with_copy(self.state_directory, lambda database: database.execute(
            "SELECT state FROM runs WHERE id = ?", [run]).fetchall())
        if states[0][0] in watch.FINAL:
            self.killed_idle += 1   # over within the instant: no kill of a run
        else:
            self.killed_in[states[0][0]] += 1
        self.faults += [f"run {run}, killed while {states[0][0]}: {fault}"
                        for fault in watch.database_faults(self.state_directory)]
        self.start_service()

    # --- runs --------------------------------------------------------------------------------------------------
    def run(self, kills):
        rotations = self.rotations()
        self.log.forget()
        aborting = self.draw.random() < ABORTED_RUNS
        run = self.unit.start_run("--schedule", self.unit.folder / "short.toml",
                                  "--force", "trial of kills")
        aborted = False
        for k, wanted in enumerate(sorted(self.draw.sample(STATES, kills), key=STATES.index)):
            if not self.await_instant(run, wanted):
                break
            if aborting and k == kills - 1:
                aborted = self.abort(run)
            self.kill(run)
        self.log.wait_for_end(run)
        document = self.unit.wait_for_end(run, timeout=60)
        self.ends[document["state"]] += 1
        complain = lambda text: self.faults.append(f"run {run}, {document['state']}: {text}")  # noqa: E731
        # Too late to abort, or over: completed all the same. Nothing else may end a run here.
        if document["state"] != "completed" and not (aborted and document["state"] == "aborted"):
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
    ends = ", ".join(f"{state} {count}" for state, count in trial.ends.most_common())
    print(f"{trial.killed_in.total()} kills (seed {options.seed}) in {trial.ends.total()} runs, "
          f"{time.monotonic() - began:.0f} s, {sum(os.times()[:4]):.0f} s of processor for service and operator\n"
          f"  runs ended: {ends}\n  killed while")
    for state in (*STATES, *AFTER_AN_ABORT):
        print(f"    {state:<13}{trial.killed_in[state]:4} {'#' * trial.killed_in[state]}")
    print(f"  killed with no run in progress, not counted: {trial.killed_idle}\n  faults found: {len(trial.faults)}")
    for fault in trial.faults:
        print(f"    {fault}")
    return 1 if trial.faults else 0


if __name__ == "__main__":
    sys.exit(main())
