"""A trial's cases by `selfcal batch trial`: on this machine or a Slurm cluster, with results kept by key."""
import json
import pathlib
import subprocess
import sys


def add_arguments(parser):
    parser.add_argument("--batch", action="store_true", help="by selfcal batch trial in --dir: it goes on after any break")
    parser.add_argument("--slurm", action="store_true", help="with --batch: on the cluster that sbatch knows")
    parser.add_argument("--dir", help="folder of the batch: key, answers, results")
    parser.add_argument("--jobs", type=int, default=1, help="with --batch: cases at a time")


def check(options):
    if options.batch and not options.dir:
        sys.exit("--batch: needs --dir")


def answered(selfcal, folder, cases, draw, answer, uses=(), jobs=1, slurm=False):
    """[(case, answer)] in the order of the cases, as the batch in `folder` has drawn and answered them; ends the program where one failed."""
    words = ["--into", folder, "--cases", cases, "--draw", " ".join(map(str, draw)), "--answer", " ".join(map(str, answer)),
             "--jobs", jobs, *(f"--uses={file}" for file in uses), *(["--slurm"] if slurm else [])]
    done = subprocess.run([str(selfcal), "batch", "trial", *map(str, words)], check=False)
    if done.returncode != 0:
        sys.exit(done.returncode)
    folder = pathlib.Path(folder)
    key, answers = ([json.loads(line) for line in (folder / name).read_text(encoding="utf-8").splitlines()]
                    for name in ("key.jsonl", "answers.jsonl"))
    return list(zip(key, sorted(answers, key=lambda a: a["number"]), strict=True))
