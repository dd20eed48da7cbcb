"""What the trials of the service look at from outside: its process in /proc, its database and its files."""
import os
import re
import shutil
import sqlite3
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path[:0] = [str(HERE.parents[1] / "tools" / "bench"), str(HERE.parent / "integration")]

FINAL = {"completed", "refused", "aborted", "failed"}


class Process:
    def __init__(self, pid):
        self.folder = Path("/proc") / str(pid)

    def _status(self, key):
        for line in (self.folder / "status").read_text(encoding="ascii").splitlines():
            if line.startswith(key + ":"):
                return int(line.split()[1])
        raise KeyError(key)

    def rss_kib(self):
        return self._status("VmRSS")

    def threads(self):
        return self._status("Threads")

    def descriptors(self):
        return len(os.listdir(self.folder / "fd"))

    def cpu_s(self):
        fields = (self.folder / "stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()
        return (int(fields[11]) + int(fields[12])) / os.sysconf("SC_CLK_TCK")


class ServiceLog:
    """What the service of a bench wrote, read where it is new only: an operator's program that asks again and again costs
    more of the processor than all that is tried."""
    def __init__(self, unit):
        self.path = unit.folder / "selfcald.log"
        self.read = 0
        self.text = ""

    def forget(self):
        self.now()
        self.text = ""

    def now(self):
        with open(self.path, "rb") as file:
            file.seek(self.read)
            new = file.read()
        self.read += len(new)
        self.text += new.decode(errors="replace")
        return self.text

    def ended(self, run):
        return re.search(rf"run {run}: ({'|'.join(sorted(FINAL))}): ", self.now())

    def wait_for_end(self, run, timeout=600.0):
        end = time.monotonic() + timeout
        while not self.ended(run):
            if time.monotonic() > end:
                raise RuntimeError(f"run {run} has not ended within {timeout:g} s:\n{self.text[-2000:]}")
            time.sleep(0.1)


def with_copy(state_directory, ask):
    """ask(connection) on a copy: opening the database itself would write its log back and hide what a restart finds."""
    with tempfile.TemporaryDirectory() as folder:
        for name in ("selfcal.db", "selfcal.db-wal"):
            source = Path(state_directory) / name
            if source.exists():
                shutil.copy(source, folder)
        database = sqlite3.connect(Path(folder) / "selfcal.db")
        try:
            return ask(database)
        finally:
            database.close()


def database_faults(state_directory):
    """Lines; none if the database is sound and no row belongs to no run."""
    def ask(database):
        faults = [row[0] for row in database.execute("PRAGMA integrity_check") if row[0] != "ok"]
        for table in ("events", "parameters", "coefficient_sets"):
            count, = database.execute(f"SELECT count(*) FROM {table} WHERE run NOT IN (SELECT id FROM runs)").fetchone()
            if count:
                faults.append(f"{count} rows of {table} belong to no run")
        return faults
    return with_copy(state_directory, ask)


def unfinished(state_directory):
    marks = ",".join("?" * len(FINAL))
    return with_copy(state_directory, lambda database: database.execute(
        f"SELECT id, state FROM runs WHERE state NOT IN ({marks})", sorted(FINAL)).fetchall())


def left_over(state_directory):
    """Files of ended runs other than their recording."""
    return [str(path) for path in Path(state_directory).glob("runs/*/*") if path.name != "recording.h5"]
