"""Laws as an answer tells them, for the programs of the trial."""
import json
import re
import subprocess

AXES = ["gyro_x", "gyro_y", "gyro_z", "accel_x", "accel_y", "accel_z"]
WHOLE = ("effect", "beside", "mixed")   # kinds that are answered as `selfcal diagnose` does, the catalogue first
NAMED = 6.0  # sigma: an effect that even its largest size shows with less is not asked for by name
SEEN = 3.0   # sigma: a law that the other plan shows with less is not scored
LEFT = 0.1   # of the misfit's power on the other plan, at most: what the requirement calls predicted


def left_elsewhere(programs, key, number, laws, folder):
    """What these laws leave of a case on the plan that was never used: {"left", "sigmas"}."""
    path = folder / "told.toml"
    path.write_text("".join(f'[[law]]\naxis = "{AXES[x["axis"]]}"\nexpression = "{x["expression"]}"\n'
                            f'coefficient = {x["coefficient"]!r}\nunit = "{"deg/h" if x["axis"] < 3 else "ug"}"\n' for x in laws))
    done = subprocess.run([f"{programs}/selfcal_discovery_generate", "left", str(key), str(number), str(path)], check=True,
                          capture_output=True, text=True)
    return json.loads(done.stdout)


POSSIBLE = 50000   # laws drawn for --way limit: most pairs of quantities on an axis are among them

# Constants of the forms that the generator draws, each to be fitted: of a creep, of a warm-up, of a wave.
CONSTANTS = ((r"exp\(-(t|since)/[0-9.e+-]+\)", r"exp(-\1/?)"), (r"log\(1\+(rest|since)/[0-9.e+-]+\)", r"log(1+\1/?)"),
             (r"sin\(2\*pi\*t/[0-9.e+-]+\+-?[0-9.e+-]+\)", "sin(2*pi*t/?+?)"))


def form_of(expression):
    """The expression with `?` in the place of its kernel's constants."""
    for number, free in CONSTANTS:
        expression = re.sub(number, free, expression)
    return expression


def answer_of(programs, way, case, recording, folder):
    """The answer to a case's recording, with what its laws leave elsewhere. Of a case the answering program knows nothing."""
    whole = way == "diagnose" or (case["kind"] in WHOLE and way == "discover")   # the catalogue first
    words = [] if whole else [f"--{way}"]
    if way == "form":
        if not case["laws"] or any(law["process"] for law in case["laws"]):
            return {"seconds": 0.0}
        words = [word for law in case["laws"] for word in ("--form", str(law["axis"]), form_of(law["expression"]))]
    if way == "limit":
        if case["kind"] not in ("law", "deep"):
            return {"seconds": 0.0}
        key, forms = folder / "case.jsonl", folder / "forms"
        key.write_text(json.dumps(case) + "\n")
        with forms.open("w") as out:
            subprocess.run([f"{programs}/selfcal_discovery_generate", "possible", str(key), str(case["number"]), str(POSSIBLE)], check=True, stdout=out)
        words = ["--among", str(forms)]
    out = subprocess.run([f"{programs}/selfcal_discovery_answer", str(recording), *words], check=True, capture_output=True, text=True).stdout
    answer = json.loads(out)
    if case["laws"] and not any(law["process"] for law in case["laws"]) and "discovery" in answer:
        key = folder / "case.jsonl"
        key.write_text(json.dumps(case) + "\n")
        answer.update(left_elsewhere(programs, key, case["number"], answer["discovery"]["laws"], folder))
    return answer
