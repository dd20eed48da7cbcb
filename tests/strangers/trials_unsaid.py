"""Positions that nothing connects, and what names and operators leave unsaid, held against the truth of each."""
import re

import numpy

import apart
import unsaid
from answers import SITE, accelerometers, bias, check, gyro_scales, names, near, parameters
from sensors import DEG, G0, LATITUDE_DEG


def ring_lasers(operator, rng):
    truth = apart.ring_lasers(operator.folder, rng)
    for place in (SITE, ()):
        answer = operator.answer("poses", *truth["files"], *place)
        check(f"six poses, no turn, nothing named: {names(answer)}", answer["poses"] == 6 and not names(answer))
        bias(answer, truth["g"], 0.006)   # twice what its bias wanders by
        if not place:
            near("latitude", answer["gyros"]["latitude_seen_deg"], answer["gyros"]["latitude_seen_sigma_deg"], LATITUDE_DEG, 0.0)
    accelerometers(operator.answer("poses", *truth["files"], *SITE), truth["a"], 1e-5)
    told = operator.answer("poses", *truth["files"], "--latitude", 20)["gyros"]["contradict"]
    check(f"another place is told: {told}", "as at latitude 48 deg" in told)


def restarts(operator, rng):
    truth = apart.restarts(operator.folder, rng)
    answer = operator.answer("poses", "anew.csv", *SITE)
    check(f"20 poses, no turn: {names(answer)}", answer["poses"] == 20 and answer["gravity_direction_deg"]["turns"] == 0)
    accelerometers(answer, truth["a"], 4e-5)
    check("said", "begins anew 19 times" in operator.run("poses", "anew.csv").stderr)
    answer = operator.answer("poses", "cut.csv", *SITE)
    accelerometers(answer, truth["a"], 4e-5)
    check(f"turns that were cut out: {answer['gyros']['contradict']}", "the turns are not in the log" in answer["gyros"]["contradict"])
    check("no scale factor of the gyros by them", not parameters(answer, "gyros"))
    operator.refused("is not after", "poses", "two.csv")


def whole_seconds(operator, rng):
    truth = apart.whole_seconds(operator.folder, rng)
    for file in ("seconds.csv", "clock.csv"):
        answer = operator.answer("poses", file, *SITE)
        accelerometers(answer, truth["a"], 4e-5)
        check(f"{file}: three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)


def temperatures(operator, rng):
    truth = unsaid.temperatures(operator.folder, rng)
    for file in ("f.csv", "k.csv", "c.csv"):
        found = [f for f in operator.answer("poses", file, *SITE)["gyros"]["findings"] if f["effect"] == "gyro_temperature"]
        check(f"{file}: what follows the temperature is named", len(found) == 1)
        for k, p in enumerate(found[0]["parameters"] if found else []):
            near(f"gyro {p['name']}, deg/s/degC", p["value"], p["sigma"], truth["coefficients"][k], 2e-4 * DEG, 1 / DEG)
    for file, said in (("c.csv", "is taken for degC"), ("counts.csv", "is left alone")):
        check(f"{file}: {said}", said in operator.run("poses", file).stderr)
    found = operator.run("poses", "counts.csv", "--json").stdout
    check("counts make no coefficient by the degree", "raw/degC" not in found)


def units(operator, rng):
    truth = unsaid.units(operator.folder, rng)
    for file in ("minutes.csv", "mgal.csv", "mm.csv"):
        answer = operator.answer("poses", file, *SITE)
        accelerometers(answer, truth["a"], 4e-5)
        check(f"{file}: three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
        operator.settled(file, ("accelerometer.axes",))
    operator.refused("how long one of its ticks is", "poses", "ticks.csv")
    operator.run("import", "inches.csv", "--guess", "--map", "inches.toml", "--longitude=11.6", *SITE)
    asked = re.search(r"(?ms)^unsettled = \[(.*?)\]", (operator.folder / "inches.toml").read_text(encoding="utf-8"))[1]
    check(f"a unit that nobody knows is asked for: {asked.split()}", "accelerometer.unit" in asked)
    operator.run("import", "ticks.csv", "--guess", "--map", "ticks.toml", "--longitude=11.6", *SITE)
    check("so are ticks", "time.unit" in (operator.folder / "ticks.toml").read_text(encoding="utf-8"))


def intervals(operator, rng):
    truth = unsaid.intervals(operator.folder, rng)
    for file in ("s.csv", "ms.csv", "us.csv"):
        answer = operator.answer("poses", file, *SITE)
        accelerometers(answer, truth["a"], 4e-5)
        check(f"{file}: three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
        check("said", "the sum of the intervals" in operator.run("import", file, "--guess", "--map", f"{file}.toml").stdout)


def directions(operator, rng):
    truth = unsaid.directions(operator.folder, rng)
    for file in ("frd.csv", "rfu.csv", "mixed.csv", "vehicle.csv", "pqr.csv", "vbox.csv"):
        answer = operator.answer("poses", file, *SITE)
        order, sign = truth["turned"].get(file, ((0, 1, 2), (1, 1, 1)))
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p = known[f"bias_{axis}"]
            near(f"{file}: bias {axis}, mg", p["value"], p["sigma"], sign[k] * truth["a"].bias[order[k]], 4e-5 * 9.80665, 1e3 / 9.80665)
        check("three gyro scale factors, no contradiction", len([n for n in parameters(answer, "gyros") if n.startswith("scale")]) == 3
              and not answer["gyros"]["contradict"])


def places(operator, rng):
    truth = unsaid.places(operator.folder, rng)
    accelerometers(operator.answer("poses", "log.csv", *SITE), truth["a"], 1e-5)
    answer = operator.answer("poses", "log.csv", f"--latitude={LATITUDE_DEG}")   # 480 m are 0.015 % of gravity
    for k, axis in enumerate("xyz"):
        p = parameters(answer, "accelerometers")[f"scale_{axis}"]
        near(f"scale {axis} without a height, ppm", p["value"], p["sigma"], truth["a"].matrix[k, k] - 1, 3e-5, 1e6)
    for latitude in (20, 0, 60):
        answer = operator.answer("poses", "log.csv", f"--latitude={latitude}")
        told = answer["gyros"]["contradict"]
        check(f"{latitude} deg contradict the gyros: {told[:60]}; nothing named: {names(answer)}", "as at latitude 48 deg" in told and not names(answer))
    check("of the other hemisphere", "the latitude has the other" in " ".join(operator.run("poses", "log.csv", f"--latitude={-LATITUDE_DEG}").stdout.split()))


def aslant(operator, rng):
    unsaid.aslant(operator.folder, rng)
    told = operator.answer("poses", "aslant.csv")["gyros"]["contradict"]
    check(f"gyros that stand aslant: {told}", "aslant" in told)
    known = {n: p for n, p in parameters(operator.answer("poses", "fast.csv"), "gyros").items() if n.startswith("scale")}
    wrong = [n for n, p in known.items() if p["sigma"] < 0.01]   # rates of a tenth that are 0.1 % good
    check(f"turns of many rounds leave no sharp scale factor: {wrong}", not wrong)


def back_and_forth(operator, rng):
    truth = unsaid.back_and_forth(operator.folder, rng)
    operator.refused("turns all the time", "poses", "log.csv")   # a rate one way is no bias
    axes = operator.answer("poses", "log.csv", "--angle-column", 8)["read_outs"]["axes"]
    for k in range(3):
        near(f"response {'xyz'[k]}", axes[0]["response"][k], axes[0]["response_sigma"][k], truth["response"][k], 1e-5)


def ramp(operator, rng):
    unsaid.ramp(operator.folder, rng)
    said = " ".join(operator.run("poses", "log.csv").stdout.split())
    check("accelerometers: the temperature, or as well the time", "accel_temperature" in said and "or as well accel_bias_ramp" in said)
    check("gyros: the time, and the temperature does the same", "gyro_temperature does 100 % of the same" in said or "gyro_drift_ramp does 100 % of the same" in said)


def squares(operator, rng):
    truth = unsaid.squares(operator.folder, rng)
    for file, a in truth["files"].items():
        answer = operator.answer("poses", file, *SITE)
        known = parameters(answer, "accelerometers")
        off = [abs(known[f"bias_{x}"]["value"] - a.bias[k]) / known[f"bias_{x}"]["sigma"] for k, x in enumerate("xyz") if f"bias_{x}" in known]
        check(f"{file}: misfit {answer['mismatch']}; biases off by {numpy.round(off, 1)} of sigma", max(off) < 5)


def fall(operator, rng):
    truth = unsaid.fall(operator.folder, rng)
    answer = operator.answer("poses", "log.csv", *SITE)
    jump = answer["accelerometers"]["jump"]
    check(f"a jump of the accelerometers at {truth['time']:.0f} s: {jump and (jump['from_s'], jump['to_s'])}",
          bool(jump) and jump["from_s"] <= truth["time"] <= jump["to_s"] and answer["mismatch"] and "accel_bias_ramp" not in names(answer))
    known = parameters(answer, "accelerometers")
    for k, x in enumerate("xyz"):   # which of the two biases it is nobody says: sigma holds both
        for bias in (truth["bias"][k], truth["bias"][k] + truth["jump"][k]):
            check(f"bias {x}", abs(known[f"bias_{x}"]["value"] - bias) < 5 * known[f"bias_{x}"]["sigma"])
        if jump:
            near(f"jump {x}, mg", jump["size_g"][k], jump["sigma_g"][k], truth["jump"][k] / G0, 0, 1e3)


TRIALS = {ring_lasers: apart, restarts: apart, whole_seconds: apart, temperatures: unsaid, units: unsaid, intervals: unsaid, directions: unsaid, places: unsaid, aslant: unsaid, back_and_forth: unsaid, ramp: unsaid, fall: unsaid, squares: unsaid}
