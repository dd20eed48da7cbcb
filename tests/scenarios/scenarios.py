"""Runs fault scenarios on a CAN interface and judges how they end. Inside tools/vcan_run and tools/private_bus."""
import argparse
import collections
import json
import math
import re
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tools" / "bench"), str(HERE.parent / "integration")]

import bench  # noqa: E402
import case  # noqa: E402
import scenario as scenarios  # noqa: E402
import witness  # noqa: E402

SPEED = 80.0
# Real time, of which a busy host takes seconds at once.
LOST_AFTER_S = 10
FORCE = "scenario: the schedule is short"


class Stage:
    """The service for all seeds of one scenario; a virtual INS, new from the factory, for each seed."""

    def __init__(self, scenario, folder):
        self.scenario, self.folder = scenario, Path(folder)
        self.unit = bench.Bench(
            self.folder, speed=SPEED, sim={"serial": "SCEN-0000", "sample_rate_hz": 50.0},
            ins={"drift_check_s": scenario.run.get("drift_check_s", 0.0), "request_timeout_s": 1.0,
                 "lost_after_s": LOST_AFTER_S}, sim_options=("--patience", 4))
        (self.folder / "short.toml").write_text(case.SHORT_SCHEDULE, encoding="ascii")
        self.unit.start_daemon()

    def play(self, seed):
        """One run. Answers (state, complaints)."""
        unit = self.unit
        for name in ("flash.bin", "truth.json", "sim_ins.log"):
            (self.folder / name).unlink(missing_ok=True)
        unit.seed = seed
        # A serial number of its own: to the service each seed is another INS with no past.
        unit.write_sim_config({"serial": f"SCEN-{seed:04}", "sample_rate_hz": 50.0})
        (self.folder / "scenario.toml").write_text(self.scenario.faults_with(seed), encoding="ascii")
        unit.start_ins("--scenario", self.folder / "scenario.toml")
        document = self.calibrate()
        unit.sim_process.send_signal(signal.SIGTERM)
        unit.sim_process.wait(10)
        complaints = self.judge(document, unit.log("sim_ins"))
        return document["state"], complaints

    def calibrate(self):
        force = ["--force", FORCE] if self.scenario.run.get("force", True) else []
        command = [bench.BIN / "selfcal", "run", self.unit.name, "--json", "--schedule", self.folder / "short.toml",
                   *force]
        # The INS's own clock sets the limit; this is only so that nothing hangs here.
        done = subprocess.run([str(word) for word in command], capture_output=True, check=False, text=True,
                              stdin=subprocess.DEVNULL, timeout=60 + 4 * self.scenario.at_most_s / SPEED)
        if not done.stdout.startswith("{"):
            raise RuntimeError(f"selfcal run: status {done.returncode}: {done.stderr}")
        document = json.loads(done.stdout)
        if done.returncode != document["exit_status"]:
            raise RuntimeError(f"selfcal run ended with {done.returncode}, its document says {document['exit_status']}")
        return document

    # --- judgement ---------------------------------------------------------------------------------------------
    def judge(self, document, sim_log):
        state = document["state"]
        if state not in self.scenario.ends:
            return [f"ended {state} ({document['reason']}), not {' or '.join(self.scenario.ends)}"]
        end, complaints = self.scenario.ends[state], []
        if document["exit_status"] != end["exit_status"]:
            complaints.append(f"exit status {document['exit_status']}, not {end['exit_status']}")
        if not re.search(end.get("reason", ""), document["reason"], re.IGNORECASE):
            complaints.append(f"reason '{document['reason']}' does not say '{end['reason']}'")
        if "\n" in document["reason"]:
            complaints.append(f"reason of several lines: {document['reason']!r}")
        for pattern in end.get("events", []):
            if not any(re.search(pattern, event["text"], re.IGNORECASE) for event in document["events"]):
                complaints.append(f"no event says '{pattern}'")
        complaints += self.judge_result(document, end)
        complaints += self.judge_coefficients(document, end["coefficients"])
        complaints += self.judge_ins(sim_log)
        return complaints

    def judge_result(self, document, end):
        if "within_sigma" not in end:
            return []
        truth = self.unit.truth()
        off = [(abs(p["value"] - truth[p["name"]]) / p["sigma"], p["name"]) for p in document["result"]["parameters"]]
        worst, name = max(off)
        return [] if worst <= end["within_sigma"] else [f"{name} is off by {worst:.1f} sigma"]

    def judge_coefficients(self, document, wanted):
        """After a power cycle, read without our C++ and without the fault."""
        self.unit.truth_file.unlink()   # whose presence tells that the INS has started
        self.unit.start_ins()
        try:
            version, held = witness.coefficients_in_force(self.unit.interface, patience_s=60.0)
        except witness.Silence as silence:
            return [f"the INS does not tell its coefficients after a power cycle: {silence}"]
        finally:
            self.unit.kill_ins()
        expected = dict.fromkeys(held, 0.0)   # the factory's
        if wanted == "new":
            expected |= {p["name"]: p["value"] for p in document["result"]["parameters"] if p["determined"]}
        if version != (1 if wanted == "new" else 0):
            return [f"set {version} in force, where the {wanted} one was due"]
        # The record holds doubles in SI units: a rounding or two on the way.
        differing = [name for name, value in expected.items() if not math.isclose(held[name], value, rel_tol=1e-9,
                                                                                 abs_tol=1e-12)]
        return [f"in force is another value of {', '.join(differing)}"] if differing else []

    def judge_ins(self, sim_log):
        told = re.search(r"switched off at ([\d.]+) s; faults of the bus that acted: (.*)", sim_log)
        if told is None:
            return [f"the virtual INS did not end in order: {sim_log[-200:]}"]
        complaints = []
        if float(told[1]) > self.scenario.at_most_s:
            complaints.append(f"took {float(told[1]):.0f} s of INS time, more than {self.scenario.at_most_s:g}")
        acted = {part.split()[0] for part in told[2].split(", ")}
        idle = self.scenario.counted_kinds() - acted
        if idle:
            complaints.append(f"fault never acted: {', '.join(sorted(idle))}")
        return complaints


def play_all(chosen, options):
    seeds = range(options.first_seed, options.first_seed + options.seeds)
    failed, began = 0, time.monotonic()
    print(f"{'':4}{'scenario':<52}{'passed':>9}   ends", flush=True)
    for scenario in chosen:
        folder = Path(tempfile.mkdtemp(prefix=f"scenario_{scenario.number}."))
        passed, ends, complaints = 0, collections.Counter(), []
        stage = Stage(scenario, folder)
        try:
            for seed in seeds:
                state, wrong = stage.play(seed)
                ends[state] += 1
                passed += not wrong
                complaints += [f"{scenario.number} seed {seed}: {text}" for text in wrong]
                if wrong and options.keep:
                    shutil.copytree(folder, folder.with_name(f"{folder.name}.seed{seed}"), symlinks=True)
        finally:
            stage.unit.stop()
            shutil.rmtree(folder, ignore_errors=True)
        counts = ", ".join(f"{state} {count}" for state, count in ends.most_common())
        print(f"{scenario.number:<4}{scenario.title:<52}{passed:>4}/{len(seeds):<4}   {counts}", flush=True)
        for line in complaints:
            print(f"    {line}", flush=True)
        failed += len(seeds) - passed
    total = len(chosen) * len(seeds)
    print(f"{total - failed} of {total} runs passed; seeds {seeds[0]} to {seeds[-1]}; "
          f"{time.monotonic() - began:.0f} s", flush=True)
    return 1 if failed else 0


def main():
    parser = argparse.ArgumentParser(prog="tests/scenarios/run", description=__doc__)
    parser.add_argument("numbers", nargs="*", metavar="NN", help="scenarios to run (default: all)")
    parser.add_argument("--seeds", type=int, default=1, help="runs of each (default 1)")
    parser.add_argument("--first-seed", type=int, default=1)
    parser.add_argument("--keep", action="store_true", help="keep the folder of each run that did not pass")
    parser.add_argument("--share", default="0/1", metavar="K/N", help="of them only each N-th, from the K-th on")
    options = parser.parse_args()
    part, parts = map(int, options.share.split("/"))
    chosen = scenarios.read_all(HERE, options.numbers)[part::parts]
    return play_all(chosen, options) if chosen else 0


if __name__ == "__main__":
    sys.exit(main())
