"""Cases of cases.toml between the real programs: selfcald on vcan0, the man in the middle from there to vcan1, the virtual
INS on vcan1; and a second virtual INS on vcan2 that the same daemon calibrates meanwhile, undisturbed.

    tests/hostile/run --vcan [NAME...]

Of each case: the daemon lives and its memory stays bounded, the second INS completes, the run ends in time with one line
that says what the case names, and the INS behind is locked, in its default session, with a complete set in force."""
import re
import signal
import socket
import struct
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parents[1] / "tools" / "bench"))

import bench  # noqa: E402
import witness  # noqa: E402

CASES = HERE / "cases.toml"
SPEED = 40.0
SCHEDULE = "positions = [[0, 0], [90, 0], [90, 90], [0, 90]]\ndwell_s = 15.0\nrotation_s = 5.0\n"
END_S = 150.0        # of real time, for a run of 75 s of the INS's clock and every time-out on its way
RSS_LIMIT_KIB = 400 * 1024
STATUS_ID, DEFAULT_SESSION = 0x650, 1
# One of each kind of thing that can go wrong, in each part of a run.
SUBSET = {
    "format.sample_rate": "set format.sample_rate = 1e-300",
    "state": "set state.state = 255",
    "schedule": "withhold 2E0201",
    "upload": "first frames for ever instead of a block",
    "busy": "busyRepeatRequest once to TransferData from 3",
    "status": "status frames of ones",
    "read back": "set inactive.version = 7",
    "commit": "commit agreed to and not done",
}


def says(name):
    """What the line must say: the `says` of the entry that this case comes from; and how it is to end."""
    with open(CASES, "rb") as file:
        for entry in tomllib.load(file)["case"]:
            action = entry.get("action", "set")
            about = entry.get("field") or entry.get("signal") or entry.get("request", "")
            own = entry.get("name") or f"{action} {about}"
            own += f" from {entry['at']}" if entry.get("at", 1) != 1 else ""
            names = [own] if "values" not in entry else [f"{own} = {v}" for v in entry["values"].split()]
            if name in names:
                return entry.get("says", ""), entry.get("end", "failed")
    raise SystemExit(f"no case is called '{name}'")


def rss_kib(pid):
    return int(re.search(r"VmRSS:\s+(\d+)", Path(f"/proc/{pid}/status").read_text(encoding="ascii"))[1])


def status_of(interface, seconds=8.0):
    """(unlocked, session) as the last state frame has it that comes within `seconds`, or earlier if both are as after a
    run."""
    with socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW) as can:
        can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, struct.pack("=II", STATUS_ID, 0x7FF))
        can.bind((interface,))
        can.settimeout(seconds)
        end = time.monotonic() + seconds
        seen = None
        while time.monotonic() < end:
            first = can.recv(16)[8]
            seen = (first >> 5 & 1, first >> 6)
            if seen == (0, DEFAULT_SESSION):
                break
        return seen


class Trial:
    def __init__(self, folder):
        ins = {"drift_check_s": 0.0, "lost_after_s": 5.0}
        self.hostile = bench.Bench(folder / "hostile", interface="vcan1", name="hostile", speed=SPEED,
                                   sim={"serial": "HOSTILE-1", "sample_rate_hz": 50.0}, ins=ins | {"interface": "vcan0"})
        self.other = bench.Bench(folder / "other", interface="vcan2", name="other", speed=SPEED, seed=2,
                                 sim={"serial": "OTHER-2", "sample_rate_hz": 50.0}, ins=ins)
        self.schedule = folder / "short.toml"
        self.schedule.write_text(SCHEDULE, encoding="ascii")
        self.log = folder / "node.log"
        for unit in (self.hostile, self.other):
            unit.start_ins()
        self.hostile.write_daemon_config([self.hostile, self.other], {})
        self.hostile.start_daemon()

    def stop(self):
        self.hostile.stop()
        self.other.stop()

    def _begin(self, unit):
        return unit.start_run("--schedule", self.schedule, "--force", "trial")

    def _await_node(self, node, seconds=60.0):
        """Until the man in the middle has both interfaces open: he prints the case's name then."""
        end = time.monotonic() + seconds
        while not self.log.read_bytes() and node.poll() is None and time.monotonic() < end:
            time.sleep(0.05)
        if node.poll() is not None or not self.log.read_bytes():
            raise RuntimeError(f"hostile_node is not ready: {self.log.read_text(encoding='utf-8').strip()}")

    def play(self, name):
        """What was broken, as lines."""
        pattern, ending = says(name)
        broken = []
        before = witness.coefficients_in_force("vcan1")
        with open(self.log, "wb") as log:
            node = subprocess.Popen([bench.BIN / "hostile_node", "--tester", "vcan0", "--ins", "vcan1", "--cases", CASES,
                                     "--case", name], stderr=log)
        try:
            self._await_node(node)
            run, other = self._begin(self.hostile), self._begin(self.other)
            try:
                document = self.hostile.wait_for_end(run, END_S)
                state, reason = document["state"], document.get("reason") or ""
                print(f"  {state}: {reason}", flush=True)
                if ending == "failed" and (state == "completed" or not re.search(pattern, reason, re.I)):
                    broken.append(f"{state}, and not /{pattern}/: {reason}")
                if ending == "completed" and state != "completed":
                    broken.append(f"{state} instead of completed: {reason}")
                if "\n" in reason:
                    broken.append("more than one line")
            except RuntimeError as error:
                broken.append(str(error))
            beside = self.hostile.wait_for_end(other, END_S)
            if beside["state"] != "completed":
                broken.append(f"the other INS: {beside['state']}: {beside.get('reason')}")
        finally:
            node.send_signal(signal.SIGTERM)
            node.wait()
        if not re.search(r"acted [1-9]", self.log.read_text(encoding="utf-8")):
            broken.append("no rule acted")
        daemon = self.hostile.daemon_process
        if daemon.poll() is not None:
            return broken + [f"the daemon ended with status {daemon.returncode}"]
        if (rss := rss_kib(daemon.pid)) > RSS_LIMIT_KIB:
            broken.append(f"the daemon takes {rss} KiB")
        if (seen := status_of("vcan1")) != (0, DEFAULT_SESSION):
            broken.append(f"(Unlocked, Session) = {seen} after the run")
        after = witness.coefficients_in_force("vcan1")
        if after != before and after[0] != before[0] + 1:
            broken.append(f"version {after[0]} in force, {before[0]} before")
        return broken


def main():
    names = sys.argv[1:] or list(SUBSET.values())
    failed = 0
    with tempfile.TemporaryDirectory(prefix="selfcal_hostile.") as folder:
        trial = Trial(Path(folder))
        try:
            for name in names:
                print(name, flush=True)
                broken = trial.play(name)
                failed += bool(broken)
                for line in broken:
                    print(f"  BROKEN {line}", flush=True)
                if trial.hostile.daemon_process.poll() is not None:
                    print(trial.hostile.log("selfcald")[-2000:])
                    break
        finally:
            trial.stop()
    print(f"{len(names)} cases on vcan, {failed} broken")
    sys.exit(1 if failed else 0)


if __name__ == "__main__":
    main()
