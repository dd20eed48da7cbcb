"""Whether programs are what their sources say, so that nobody measures an old one.

  tools/bench/freshness.py FOLDER PROGRAM...      one line on standard error where they are not; the status is 0
"""
import subprocess
import sys
from pathlib import Path


def warn_if_old(folder, *programs):
    """Asks ninja what a build of these programs would do. Silent where FOLDER is no build's bin."""
    build = Path(folder).resolve().parent
    if not (build / "build.ninja").is_file():
        return
    try:
        plan = subprocess.run(["ninja", "-C", build, "-n", *programs], capture_output=True, text=True, check=False,
                              timeout=60)
    except (OSError, subprocess.TimeoutExpired):
        return
    if plan.returncode != 0 or "no work to do" not in plan.stdout:
        print(f"OLD PROGRAMS: {', '.join(programs)} in {folder} are not what the sources say; first: "
              f"cmake --build {build} --target {' '.join(programs)}", file=sys.stderr, flush=True)


if __name__ == "__main__":
    warn_if_old(*sys.argv[1:])
