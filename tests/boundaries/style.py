#!/usr/bin/env python3
"""Holds our C++ to .clang-format and to braces around every controlled statement: python3 style.py ROOT

Prints "file:line: what" for each place that differs. Exit status 1 if anything was found, 77 where clang-format is absent.
"""
import re
import shutil
import subprocess
import sys
from pathlib import Path

FOLDERS = ["estimator", "protocol", "sim_ins", "daemon", "tools", "tests"]
RAW_STRING = re.compile(r'R"([^()\\\s]{0,16})\((.*?)\)\1"', re.DOTALL)
CONTROL = re.compile(r"^\s*(?:\}\s*)?(?:else\s+)?(if(?:\s+constexpr)?|for|while)\s*\(")
BARE_ELSE = re.compile(r"^\s*(?:\}\s*)?else\b(?!\s*(?:\{|if\b))")


def sources(root):
    for folder in FOLDERS:
        for path in sorted((root / folder).rglob("*")):
            if path.suffix in {".cpp", ".hpp"}:
                yield path


def without_text(line):
    """The line with strings, characters and comments emptied: their parentheses do not count."""
    return re.sub(r'"(?:\\.|[^"\\])*"|\'(?:\\.|[^\'\\])+\'', '""', line).split("//")[0]


def unbraced(text):
    """Line numbers at which a controlled statement has no brace; for formatted code."""
    text = RAW_STRING.sub(lambda raw: '""' + "\n" * raw[0].count("\n"), text)
    code = [without_text(line) for line in text.splitlines()]
    for number, line in enumerate(code):
        if BARE_ELSE.match(line):
            yield number + 1
            continue
        match = CONTROL.match(line)
        if not match:
            continue
        depth, row, column = 1, number, match.end()
        while depth > 0 and row < len(code):
            rest = code[row][column:]
            for column, character in enumerate(rest, column):
                depth += {"(": 1, ")": -1}.get(character, 0)
                if depth == 0:
                    break
            else:
                row, column = row + 1, 0
        after = code[row][column + 1:].strip() if row < len(code) else ""
        ends_do = match[1] == "while" and re.match(r"^\s*\}\s*while", line)
        if not after.startswith("{") and not ends_do:
            yield number + 1


def main():
    root = Path(sys.argv[1]).resolve()
    formatter = shutil.which("clang-format")
    if formatter is None:
        print("clang-format is not installed: nothing tried")
        return 77
    paths = list(sources(root))
    found = []
    for start in range(0, len(paths), 50):
        run = subprocess.run([formatter, "--dry-run", *map(str, paths[start:start + 50])], capture_output=True, text=True,
                             check=False)
        found += [line.replace(f"{root}/", "") for line in run.stderr.splitlines() if "warning:" in line or "error:" in line]
    for path in paths:
        for number in unbraced(path.read_text(encoding="utf-8")):
            found.append(f"{path.relative_to(root)}:{number}: a controlled statement without braces")
    print("\n".join(found) if found else f"style: kept in {len(paths)} files")
    return 1 if found else 0


if __name__ == "__main__":
    sys.exit(main())
