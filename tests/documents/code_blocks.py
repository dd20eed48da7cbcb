"""The commands of README and handbook, as written.

A fenced block says in its info string where its commands are run:
  sh          off line, block after block of a page in one folder (commands_test)
  sh service  with virtual INS and service on vcan (service_commands_test)
  sh package  on a minimal Debian with systemd: the lines stand in tools/package/README.md too, and tests/systemd/run types them
  sh depot    with a hub of its own: tests/hub/handbook_test
  sh ins      with an INS of somebody else's on vcan0: own_ins_test; the service has what the page's `toml ins` block says
  sh demo     tools/demo and tests/run themselves
`# status N` behind a command is its exit status, 0 where nothing is said. A block `output` after it is what it prints; a
line `...` stands for lines left out."""
import re
from dataclasses import dataclass, field
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
KINDS = {"sh", "sh service", "sh package", "sh depot", "sh ins", "sh demo"}
PAGES = [ROOT / "README.md", ROOT / "tools" / "package" / "man" / "selfcal.1", *sorted((ROOT / "tools" / "handbook").glob("*.md"))]


@dataclass
class Block:
    page: Path
    line: int
    kind: str
    commands: list
    output: list = field(default_factory=list)


def blocks(page):
    """Every shell block of a page, with the output block that follows it."""
    if page.suffix == ".1":
        return manual_examples()
    lines = page.read_text(encoding="utf-8").splitlines()
    found, inside, info, body, begin = [], False, "", [], 0
    for number, line in enumerate(lines, 1):
        if not inside and line.startswith("```"):
            inside, info, body, begin = True, line[3:].strip(), [], number
        elif inside and line.startswith("```"):
            inside = False
            if info.split(" ")[0] == "sh":
                found.append(Block(page, begin, info, [text for text in body if text.strip()]))
            elif info == "output":
                found[-1].output = body
        elif inside:
            body.append(line)
    return found


def manual_examples():
    """The examples of selfcal(1) as one page; those that ask the service run elsewhere."""
    page = ROOT / "tools" / "package" / "man" / "selfcal.1"
    roff = page.read_text(encoding="ascii")
    lines = re.search(r"^\.SH EXAMPLES\n\.nf\n(.*?)^\.fi", roff, re.M | re.S)[1].replace("\\-", "-").splitlines()
    online = re.compile(r"selfcal (run|amend|investigate|rollback|abort|status|show|history|monitor|db)\b")
    return [Block(page, roff[:roff.index(".SH EXAMPLES")].count("\n") + 1, "sh service" if online.match(line) else "sh", [line])
            for line in lines]


def wanted_status(command):
    match = re.search(r"# status (\d)\s*$", command)
    return int(match[1]) if match else 0


def missing_output(block, printed):
    """The first line of the block's output that was not printed in its place; None if all is there."""
    lines = [line.rstrip() for line in printed.splitlines()]
    at, gap = 0, False
    for wanted in (line.rstrip() for line in block.output):
        if wanted.strip() in ("...", "…"):
            gap = True
            continue
        if gap:
            while at < len(lines) and lines[at] != wanted:
                at += 1
        if at >= len(lines) or lines[at] != wanted:
            return wanted
        at, gap = at + 1, False
    return None
