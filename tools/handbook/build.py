#!/usr/bin/python3 -B
"""The handbook as HTML: build.py SOURCE-FOLDER DESTINATION (python3-markdown; the package's installation runs it)."""
import html
import re
import sys
from pathlib import Path

import markdown

# Order of the navigation; every page of the folder stands here.
PAGES = ["index", "first-calibration", "your-recordings", "reading-a-verdict", "when-they-differ", "planning", "service", "your-ins", "depot", "trouble",
         "recording-format", "frames-and-signs", "parameters", "ins-interface", "profile", "effects", "equations", "files", "documents", "exit-status",
         "glossary"]
REFERENCE_FROM = "recording-format"
STYLE = """
:root { color-scheme: light dark; }
body { font: 16px/1.55 system-ui, sans-serif; margin: 0; display: grid; grid-template-columns: 15em minmax(0, 52em); gap: 2em; }
nav { padding: 1.5em 0 1.5em 1.5em; font-size: 0.93em; } nav ul { list-style: none; padding: 0; } nav li { margin: 0.35em 0; }
nav [aria-current] { font-weight: bold; } main { padding: 1.5em 1.5em 4em 0; }
code, pre { font-family: ui-monospace, monospace; font-size: 0.92em; }
pre { padding: 0.8em 1em; overflow-x: auto; border: 1px solid #8886; border-radius: 4px; background: #8881; }
table { border-collapse: collapse; display: block; overflow-x: auto; } th, td { border: 1px solid #8886; padding: 0.25em 0.7em; text-align: left; }
@media (max-width: 50em) { body { display: block; } main { padding: 0 1.5em 4em; } }
@media print { nav { display: none; } body { display: block; } }
"""


def title_of(text):
    return re.search(r"^# (.+)$", text, re.M)[1]


def navigation(titles, here):
    parts = ["<nav><ul>"]
    for page in PAGES:
        if page == REFERENCE_FROM:
            parts.append("</ul><p>Reference</p><ul>")
        current = ' aria-current="page"' if page == here else ""
        parts.append(f'<li><a href="{page}.html"{current}>{html.escape(titles[page])}</a></li>')
    return "".join(parts) + "</ul></nav>"


def page_html(text, titles, here):
    # "```sh service" tells the test where a command is run; a reader of the page has no use for it.
    text = re.sub(r"^```(\w+) \w+$", r"```\1", text, flags=re.M)
    body = markdown.markdown(text, extensions=["tables", "fenced_code", "toc", "sane_lists"], output_format="html5")
    body = re.sub(r'href="([a-z-]+)\.md(#[^"]*)?"', lambda m: f'href="{m[1]}.html{m[2] or ""}"', body)
    return (f'<!DOCTYPE html>\n<html lang="en"><head><meta charset="utf-8"><meta name="viewport" content="width=device-width">'
            f"<title>{html.escape(titles[here])} - selfcal</title><style>{STYLE}</style></head>\n"
            f"<body>{navigation(titles, here)}<main>{body}</main></body></html>\n")


def build(source, destination):
    found = {file.stem: file.read_text(encoding="utf-8") for file in source.glob("*.md")}
    if set(found) != set(PAGES):
        raise SystemExit(f"build.py: pages and list differ: {sorted(set(found) ^ set(PAGES))}")
    titles = {name: title_of(text) for name, text in found.items()}
    destination.mkdir(parents=True, exist_ok=True)
    for name, text in found.items():
        (destination / f"{name}.html").write_text(page_html(text, titles, name), encoding="utf-8")


if __name__ == "__main__":
    build(Path(sys.argv[1]), Path(sys.argv[2]))
