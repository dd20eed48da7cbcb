"""From the moment the gimbal stops to the new coefficients in force, on classic CAN at 1 Mbit/s and at the clock's own
pace, read off the bus by candump and told in its stages:

    tools/vcan_run tools/private_bus /usr/bin/python3 -B tests/bench/stop_to_force.py [SECONDS_OF_DWELL]

Four positions, 200 Hz; how long the rotation lasts hardly matters, since the data are pulled while it turns
and the passes take 0.13 ms for each second of it."""
import subprocess
import sys
import tempfile
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parents[2] / "tools" / "bench"))

import bench  # noqa: E402

REQUEST, RESPONSE, STATUS = 0x640, 0x648, 0x650
COMPLETE = 3
UPLOAD_ENDED, ERASE = b"\x77", b"\x31\x01\x03\x02"
STAGES = (
    ("last of the raw data", RESPONSE, UPLOAD_ENDED),
    ("erase of the inactive slot asked for", REQUEST, ERASE),
    ("set written", REQUEST, b"\x2e\x02\x11"),
    ("committed", RESPONSE, b"\x71\x01\x03\x03"),
    ("power cycled", RESPONSE, b"\x51"),
    ("read back as in force", RESPONSE, b"\x62\x02\x10"),
)


def messages(log):
    """(time, identifier, first bytes) of every message's beginning, and of status frames."""
    for line in log.read_text(encoding="ascii").splitlines():
        stamp, _, frame = line.split()
        identifier, data = frame.split("#")
        payload, identifier = bytes.fromhex(data), int(identifier, 16)
        if identifier == STATUS:
            yield float(stamp[1:-1]), identifier, payload
        elif identifier in (REQUEST, RESPONSE) and payload[0] >> 4 in (0, 1):
            yield float(stamp[1:-1]), identifier, payload[1 + (payload[0] >> 4):]


def await_log(log, until, patience_s=120.0):
    """Status frames come all the time: candump has told everything up to `until` once its log has one that is later."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        lines = log.read_text(encoding="ascii").splitlines()[-2:]   # the very last may be cut in two
        if len(lines) == 2 and float(lines[0].split()[0][1:-1]) > until:
            return
        time.sleep(1.0)
    raise SystemExit(f"candump is {patience_s:g} s behind the bus")


def main():
    dwell_s = float(sys.argv[1]) if len(sys.argv) > 1 else 15.0
    with tempfile.TemporaryDirectory(prefix="selfcal_stop.") as folder:
        unit = bench.Bench(folder, speed=1.0, sim={"sample_rate_hz": 200.0}, ins={"drift_check_s": 0.0})
        schedule, log = Path(folder) / "short.toml", Path(folder) / "can.log"
        schedule.write_text(f"positions = [[0, 0], [90, 0], [90, 90], [0, 90]]\ndwell_s = {dwell_s}\n"
                            "rotation_s = 5.0\n", encoding="ascii")
        with unit, open(log, "w", encoding="ascii") as output:
            dump = subprocess.Popen(["candump", "-L", "-r", "4000000", unit.interface], stdout=output)
            try:
                run = unit.wait_for_end(unit.start_run("--schedule", schedule, "--force", "bench"),
                                        timeout=4 * dwell_s + 500)
                await_log(log, time.time())
            finally:
                dump.terminate()
                dump.wait(10)
        if run["state"] != "completed":
            print(f"run ended {run['state']}: {run['reason']}", file=sys.stderr)
            return 1
        heard = list(messages(log))
    stopped = next(t for t, identifier, data in heard if identifier == STATUS and data[0] & 0xF == COMPLETE)
    # Data come in several uploads: the last one before the coefficients are touched counts.
    touched = max(t for t, identifier, data in heard if identifier == REQUEST and data.startswith(ERASE))
    before = stopped
    for name, wanted, beginning in STAGES:
        at = [t for t, identifier, data in heard
              if identifier == wanted and t >= before and data.startswith(beginning)]
        if not at:
            print(f"{name}: never on the bus", file=sys.stderr)
            return 1
        now = max(t for t in at if t <= touched) if beginning == UPLOAD_ENDED else at[0]
        print(f"{name:<40} {now - stopped:8.3f} s after the gimbal stopped")
        before = now
    return 0


if __name__ == "__main__":
    sys.exit(main())
