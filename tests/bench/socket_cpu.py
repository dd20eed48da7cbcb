"""Block transfer over real sockets, both ends in one thread, measured from outside in processor time of the host:

    /usr/bin/python3 -B tests/bench/socket_cpu.py [MEGABYTES]

Whatever shares the machine costs waiting, not processor time, so that the figure holds on a busy one too. In user-mode
Linux the processor time is that of the whole guest, its kernel's system calls by ptrace included. Prints how many times the
real 1/5 Mbit/s FD bus one core carries; exit status 1 where that is less than 5 with FD. SELFCAL_BIN: the programs
(build/bin)."""
import os
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT / "tools" / "bench"))

from freshness import warn_if_old  # noqa: E402

BIN = Path(os.environ.get("SELFCAL_BIN", ROOT / "build" / "bin"))
REAL_FD_BUS_BYTES_PER_S = 436e3   # ceiling of FD 1/5 Mbit/s with blocks of 65535
ASKED_FOR = 5.0
TICKS = os.sysconf("SC_CLK_TCK")


def processor_seconds(ancestor):
    """Of a process and all that descend from it, the ones that have ended included."""
    parent, used = {}, {}
    for stat in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = stat.read_text(encoding="utf-8", errors="replace").rpartition(")")[2].split()
        except (FileNotFoundError, ProcessLookupError):
            continue   # ended just now: counted with its parent
        parent[int(stat.parent.name)] = int(fields[1])
        used[int(stat.parent.name)] = sum(map(int, fields[11:15]))   # utime, stime, and those of children waited for
    family = {ancestor}
    while more := {child for child, of in parent.items() if of in family} - family:
        family |= more
    return sum(used.get(member, 0) for member in family) / TICKS


def main():
    print(f"programs: {BIN}", flush=True)
    warn_if_old(BIN, "socket_bench")
    megabytes = sys.argv[1] if len(sys.argv) > 1 else "16.46"
    command = [ROOT / "tools" / "vcan_run", BIN / "socket_bench", "vcan0", megabytes, "alone"]
    enough = True
    with subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, text=True) as bench:
        for line in bench.stdout:
            what, size, name = line.strip().split(" ", 2)
            now = processor_seconds(bench.pid)
            if what == "begin":
                began = now
                continue
            times = float(size) / (now - began) / REAL_FD_BUS_BYTES_PER_S
            print(f"{name:<20} {float(size) / 1e6:6.1f} MB in {now - began:6.2f} s of processor time: {times:5.1f} times "
                  "the real FD bus", flush=True)
            enough = enough and (times >= ASKED_FOR or not name.startswith("FD"))
    return bench.returncode or (0 if enough else 1)


if __name__ == "__main__":
    sys.exit(main())
