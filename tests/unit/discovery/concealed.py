"""Laws concealed in simulated recordings, and what a diagnosis answers. Used by a test as SELFCAL FOLDER [--all].

A diagnosis takes ten seconds and more: without --all a test asks some of its cases."""
import json
import shutil
import subprocess
import sys
from pathlib import Path

SELFCAL = Path(sys.argv[1]).resolve()
folder = Path(sys.argv[2])
EVERY_CASE = "--all" in sys.argv[3:]
faults = []


def expect(held, words):
    if not held:
        faults.append(words)


def run(*arguments, statuses=(0,)):
    done = subprocess.run([SELFCAL, *arguments], cwd=folder, capture_output=True, text=True, check=False)
    expect(done.returncode in statuses, f"selfcal {' '.join(arguments)}: status {done.returncode}: {done.stderr}")
    return done.stdout


def law(**keys):
    return "[[law]]\n" + "".join(f"{k} = {json.dumps(v)}\n" for k, v in keys.items())


def effect(name, **keys):
    return f'[[effect]]\nid = "{name}"\n' + "".join(f"{k} = {json.dumps(v)}\n" for k, v in keys.items())


def answer(name, text, *arguments, seed=23, dwell_s=None):
    """The document of a diagnosis of a recording in which the law is concealed."""
    (folder / f"{name}.toml").write_text(text)
    run("simulate", "--config", "sim.toml", "--physics", f"{name}.toml", "--seed", str(seed), *(("--dwell", str(dwell_s)) if dwell_s else ()), "-o", f"{name}.h5", "--truth", f"{name}.json")
    return json.loads(run("diagnose", f"{name}.h5", "--json", *arguments, statuses=(0, 1)))


def errors_of_the_24(name, told):
    """Of each its error in sigma that is told."""
    truth = {p["name"]: p["value"] for p in json.loads((folder / f"{name}.json").read_text())["parameters"]}
    return {p["name"]: (p["value"] - truth[p["name"]]) / p["sigma"] for p in told["parameters"]}


def end():
    for fault in faults:
        print("FAILED", fault)
    sys.exit(1 if faults else 0)


shutil.rmtree(folder, ignore_errors=True)
folder.mkdir(parents=True)
STANDARD = "sample_rate_hz = 50\n[attitude]\nroll_deg = 4\npitch_deg = 6\n[temperature]\nrecorded = false\n"
(folder / "sim.toml").write_text(STANDARD)
