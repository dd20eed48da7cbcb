"""Pages of documents that no selfcal wrote: alter_page.py PAGE.html HOW OUT.html. HOW is

markup   every text is markup that would run a script, with quotes, a null byte and separators of lines
null     every number is null, as JSON has it where the program had no finite one
missing SEED   a fifth of all entries of objects are gone, wherever they stand, but for "kind"
unexplained    the same recording with a diagnosis that names nothing
"""
import json
import random
import re
import sys

page_file, how, out = sys.argv[1:4]
page = open(page_file, encoding="utf-8").read()
opening = '<script type="application/json" id="document">'
start = page.index(opening) + len(opening)
end = page.index("</script>", start)
document = json.loads(page[start:end])

MARKUP = "<script>window.hacked=1</script><img src=x onerror='window.hacked=1'>\"'`${window.hacked=1}\\\u0000\u2028"


def every(value, change, key=""):
    if isinstance(value, dict):
        return {name: every(one, change, name) for name, one in value.items()}
    if isinstance(value, list):
        return [every(one, change, key) for one in value]
    return change(value, key)


def markup(value, key):
    # What chooses a branch of the page stays: the texts are hostile, not the form.
    keep = key in ("kind", "verdict", "standing", "direction", "state") and value != ""
    return MARKUP if isinstance(value, str) and not keep else value


def null(value, _):
    return None if isinstance(value, (int, float)) and not isinstance(value, bool) else value


def thin_out(value, draw, top=True):
    if isinstance(value, dict):
        return {name: thin_out(one, draw, False) for name, one in value.items()
                if (top and name == "kind") or draw.random() > 0.2}
    return [thin_out(one, draw, False) for one in value] if isinstance(value, list) else value


def unexplained(report):
    d = report["diagnosis"]
    d |= {"verdict": "none of the above", "unexplained": True, "rejected": d["findings"], "findings": [],
          "remaining": d["located"], "suspected": []}
    d["adequacy"]["after"] = dict(d["adequacy"]["before"], nis=0.989)
    cells = d["map"]
    for part in (cells["cells"], cells["dwells"]):
        part["signature"] = [0] * len(part["signature"])
    return report


if how == "markup":
    document = every(document, markup)
elif how == "null":
    document = every(document, null)
elif how == "unexplained":
    document = unexplained(document)
else:
    draw = random.Random(int(how.removeprefix("missing")))
    document = thin_out(document, draw)
text = json.dumps(document).replace("<", "\\u003c")
open(out, "w", encoding="utf-8").write(page[:start] + text + page[end:])
