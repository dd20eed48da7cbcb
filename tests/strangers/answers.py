"""An operator of the program, and its answers held against the truth: values count as right within five of their sigma and what is said beside each."""
import json
import re
import subprocess

from sensors import DEG, G0, GRAVITY, HEIGHT_M, LATITUDE_DEG

SITE = [f"--latitude={LATITUDE_DEG}", f"--height={HEIGHT_M}"]

checks = failures = 0


def check(what, good):
    global checks, failures
    checks += 1
    failures += not good
    print(f"  {'yes' if good else 'NO '}  {what}", flush=True)


class Operator:
    def __init__(self, program, folder):
        self.program, self.folder = program, folder

    def run(self, *arguments):
        return subprocess.run([self.program, *map(str, arguments)], cwd=self.folder, capture_output=True, text=True, check=False)

    def doubts(self, file):
        """What a guess leaves open, in map.toml."""
        (self.folder / "map.toml").unlink(missing_ok=True)
        done = self.run("import", file, "--guess", "--map", "map.toml", "--longitude=11.6", *SITE)
        check(f"guessed {done.stderr.strip()[-100:] if done.returncode > 1 else ''}", done.returncode in (0, 1))
        text = (self.folder / "map.toml").read_text(encoding="utf-8")
        return set(re.findall(r'"(.*?)"', re.search(r"(?ms)^unsettled = \[(.*?)\]", text)[1]))

    def settled(self, file, asked=()):
        """Guesses; takes the words off `unsettled` after looking that nothing but `asked` stands in it."""
        doubts = self.doubts(file)
        text = (self.folder / "map.toml").read_text(encoding="utf-8")
        check(f"doubts {sorted(doubts)}, at most {sorted(asked)}", doubts <= set(asked))
        if doubts & {"gyro.axes", "accelerometer.axes"}:   # as all of these were written
            text = re.sub(r"(?m)^axes = .*$", 'axes = ["x", "y", "z"]', text)
        (self.folder / "map.toml").write_text(re.sub(r"(?ms)^unsettled = \[.*?\]", "unsettled = []", text), encoding="utf-8")

    def diagnosed(self, file):
        (self.folder / "rec.h5").unlink(missing_ok=True)
        imported = self.run("import", file, "--map", "map.toml", "-o", "rec.h5")
        check(f"imported {imported.stderr.strip()[:100]}", imported.returncode == 0)
        return self.answer("diagnose", "rec.h5")

    def answer(self, *arguments):
        done = self.run(*arguments, "--json")
        check(f"answered {done.stderr.strip()[-100:] if done.returncode > 1 else ''}", done.returncode in (0, 1))
        return json.loads(done.stdout)

    def refused(self, words, *arguments):
        """In one line that holds WORDS, with nothing else said."""
        done = self.run(*arguments)
        line = done.stderr.strip().splitlines()[-1] if done.stderr.strip() else ""
        check(f"refused: {line[-140:]}", done.returncode > 1 and words in line and not done.stdout)

    def short(self, most, *arguments):
        done = self.run(*arguments)
        lines = done.stdout.splitlines()
        check(f"{len(lines)} lines, at most {most} and 80 columns", done.returncode in (0, 1) and len(lines) <= most and all(len(x) <= 80 for x in lines))


def parameters(answer, triad):
    return {p["name"]: p for p in answer[triad]["parameters"] if p["determined"]}


def near(what, value, sigma, truth, beside, scale=1.0):
    check(f"{what}: {value * scale:.5g} +- {sigma * scale:.2g}, truth {truth * scale:.5g}", abs(value - truth) < 5 * sigma + beside)


def accelerometers(answer, a, beside_g, unit=1.0, may_be_open=False):
    """Bias and scale: what wanders is beside sigma, and a scale factor holds the other's squares of misalignment. `may_be_open`: a scale factor that is not known is not told."""
    known = parameters(answer, "accelerometers")
    for k, axis in enumerate("xyz"):
        p = known[f"bias_{axis}"]
        near(f"bias {axis}, mg", p["value"] * unit, p["sigma"] * unit, a.bias[k], beside_g * G0, 1e3 / G0)
        p = known.get(f"scale_{axis}")
        if not p:
            check(f"scale {axis} is open", may_be_open)
            continue
        near(f"scale {axis}, ppm", p["value"], p["sigma"], a.matrix[k, k] - 1, beside_g + 3e-5 * (a.limit < 1e3), 1e6)
    for i, j in ((0, 1), (0, 2), (1, 2)):
        p = known.get(f"misalignment_{'xyz'[i]}{'xyz'[j]}")
        if p:   # of axes that may stand anyhow only the angle between two is seen
            near(f"misalignment {i}{j}, ppm", p["value"], p["sigma"], a.matrix[i, j] + a.matrix[j, i], 2e-4, 1e6)


def names(answer):
    """Without drifts that are told as a bias's own wandering as well: these sensors' biases wander."""
    settling = ["accel_relaxation"] if answer["accelerometers"]["settling"] else []
    return [f["effect"] for t in ("accelerometers", "gyros") for f in answer[t]["findings"] if not f["may_be_flicker"]] + settling


def bias(answer, g, beside_deg_per_h):
    check("the Earth's rate is taken out", answer["gyros"]["earth_taken_out"])
    for k in range(3):
        near(f"gyro bias {'xyz'[k]}, deg/h", answer["gyros"]["bias"][k], answer["gyros"]["bias_sigma"][k], g.bias[k],
             beside_deg_per_h / 3600 * DEG, 3600 / DEG)


def gyro_scales(answer, g, per_rad_s=None):
    """Scale factors of the gyros by the turns, of counts in counts."""
    known = parameters(answer, "gyros")
    for k, axis in enumerate("xyz"):
        p = known.get(f"scale_{axis}")
        if p:
            truth = g.matrix[k, k] * per_rad_s if per_rad_s else g.matrix[k, k] - 1
            near(f"gyro scale {axis}", p["value"], p["sigma"], truth, 1e-4 * (per_rad_s or 1))
    return sum(f"scale_{axis}" in known for axis in "xyz")


def in_counts(answer, truth):
    """Accelerometers in counts, whose scale factors are counts per g."""
    known = parameters(answer, "accelerometers")
    for k, axis in enumerate("xyz"):
        p = known[f"scale_{axis}"]
        near(f"counts per g {axis}", p["value"], p["sigma"], truth["a"].matrix[k, k] * truth["per_g"] * GRAVITY, 3e-5 * p["value"])
        p = known[f"bias_{axis}"]
        near(f"bias {axis}, counts", p["value"], p["sigma"], truth["a"].bias[k] * truth["per_g"], truth["per_g"] * 1e-4 * G0)
