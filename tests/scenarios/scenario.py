"""One scenario file: what goes wrong on a calibration of the virtual INS, and how that is to end."""
import random
import re
import tomllib
from dataclasses import dataclass, field
from pathlib import Path

FAULT_KEYS = {"kind", "at_s", "for_s", "state", "probability", "value", "amount", "detected"}
RUN_KEYS = {"drift_check_s", "force"}
END_KEYS = {"exit_status", "coefficients", "reason", "events", "within_sigma"}
# These are counted by the virtual INS when they act; the others are to be seen in how the run ends.
COUNTED = {"drop", "duplicate", "reorder", "corrupt", "delay", "bus_off", "babble", "reset", "late_status",
           "wrong_status", "second_tester"}


@dataclass
class Scenario:
    number: str
    title: str
    at_most_s: float                       # INS time from power-on to the end of the run
    faults: list = field(default_factory=list)
    run: dict = field(default_factory=dict)
    ends: dict = field(default_factory=dict)   # run state: what must hold then

    def faults_with(self, seed):
        """Faults as the virtual INS reads them: [low, high] becomes a draw of this seed."""
        draw = random.Random(f"{self.number} {seed}")
        lines = [f"seed = {seed}"]
        for fault in self.faults:
            lines.append("[[fault]]")
            for key, value in fault.items():
                if isinstance(value, list):
                    low, high = value
                    value = draw.randint(low, high) if isinstance(low, int) else draw.uniform(low, high)
                if isinstance(value, bool):
                    value = str(value).lower()
                lines.append(f"{key} = {value!r}" if not isinstance(value, str) or key in ("kind", "state")
                             else f"{key} = {value}")
        return "\n".join(lines) + "\n"

    def counted_kinds(self):
        return {fault["kind"] for fault in self.faults} & COUNTED


def _only(table, known, where):
    unknown = set(table) - known
    if unknown:
        raise SystemExit(f"{where}: no such key: {', '.join(sorted(unknown))}")
    return table


def read(path):
    path = Path(path)
    with open(path, "rb") as file:
        text = tomllib.load(file)
    _only(text, {"title", "fault", "run", "end", "at_most_s"}, path)
    for fault in text["fault"]:
        _only(fault, FAULT_KEYS, path)
    for end in text["end"].values():
        _only(end, END_KEYS, path)
        for pattern in [end.get("reason", ""), *end.get("events", [])]:
            re.compile(pattern)
    return Scenario(path.name[:2], text["title"], float(text["at_most_s"]), text["fault"],
                    _only(text.get("run", {}), RUN_KEYS, path), text["end"])


def read_all(folder, numbers=()):
    files = {path.name[:2]: path for path in sorted(Path(folder).glob("[0-9][0-9]-*.toml"))}
    unknown = set(numbers) - set(files)
    if unknown:
        raise SystemExit(f"no scenario {', '.join(sorted(unknown))}; there are {', '.join(files)}")
    return [read(path) for number, path in files.items() if not numbers or number in numbers]
