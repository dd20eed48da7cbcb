"""Four INS on four buses under one service, one of them faulty: are the others as fast as alone?

Throughput is pages per second of INS time, from the start of the rotation to the last page out: what the bus of that INS
carries. All four virtual INS, the service and this program share one processor in user-mode Linux, so --speed is to be
such that it is not full; real time says nothing there."""
import argparse
import re
import sys
import tempfile
import time
from pathlib import Path

import watch  # noqa: F401

import bench  # noqa: E402
import case  # noqa: E402

FAULTY = 2
BUS_OFF = """seed = 1
[[fault]]
kind = "bus_off"
state = "rotating"
at_s = 20.0
"""


def make_units(folder, count, speed, rate):
    units = []
    for k in range(count):
        unit = bench.Bench(Path(folder) / f"unit{k}", interface=f"vcan{k}", name=f"unit{k}", speed=speed, seed=k + 1,
                           sim={"serial": f"FOUR-000{k}", "sample_rate_hz": rate},
                           ins={"drift_check_s": 0.0, "lost_after_s": 4.0})
        (unit.folder / "short.toml").write_text(case.SHORT_SCHEDULE, encoding="ascii")
        units.append(unit)
    return units


def pages_per_second(unit):
    """From what the virtual INS says of its own clock."""
    log = unit.log("sim_ins")
    pages = int(re.search(r"gimbal stopped at [\d.]+ s, (\d+) pages", log)[1])
    after_stop_s = float(re.search(r"last page uploaded ([\d.]+) s after the gimbal stopped", log)[1])
    return pages / (case.SHORT_S + after_stop_s), after_stop_s


def play(units, faulty=None):
    """Runs on all units at once, under the service of the first. {name: (state, pages a second, s after stop)}."""
    for k, unit in enumerate(units):
        if k == faulty:
            (unit.folder / "scenario.toml").write_text(BUS_OFF, encoding="ascii")
            unit.start_ins("--scenario", unit.folder / "scenario.toml")
        else:
            unit.start_ins()
    service = units[0]
    service.write_daemon_config(units, {})
    service.start_daemon()
    runs = [unit.start_run("--schedule", service.folder / "short.toml", "--force", "trial of four") for unit in units]
    results = {}
    for k, (unit, run) in enumerate(zip(units, runs)):
        while service.document(run)["exit_status"] is None:   # seldom: asking costs the processor that is measured
            time.sleep(2.0)
        document = service.document(run)
        results[unit.name] = (document["state"], *(pages_per_second(unit) if k != faulty else (0.0, 0.0)))
    for unit in reversed(units):
        unit.stop()
    return results


def main():
    parser = argparse.ArgumentParser(prog="tests/service/four", description=__doc__)
    parser.add_argument("--speed", type=float, default=1.0, help="the INS's clock, times real time (default 1)")
    parser.add_argument("--rate", type=float, default=200.0, help="samples a second (default 200)")
    options = parser.parse_args()
    failed = 0
    with tempfile.TemporaryDirectory(prefix="selfcal_four.") as folder:
        alone = play(make_units(Path(folder) / "alone", 1, options.speed, options.rate))["unit0"]
        print(f"alone  {alone[0]:<10} {alone[1]:.4f} pages/s, last page {alone[2]:.2f} s after the gimbal stopped",
              flush=True)
        for k, (name, (state, rate, after)) in enumerate(
                play(make_units(Path(folder) / "four", 4, options.speed, options.rate), FAULTY).items()):
            if k == FAULTY:
                good = state == "failed"
                print(f"{name}  {state:<10} bus-off for good: the faulty one")
            else:
                good = state == "completed" and rate >= 0.95 * alone[1]
                print(f"{name}  {state:<10} {rate:.4f} pages/s, last page {after:.2f} s after the gimbal stopped; "
                      f"{rate / alone[1]:.3f} of alone (limit 0.95)")
            failed += not good
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
