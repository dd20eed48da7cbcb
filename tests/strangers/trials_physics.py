"""What sensors, their bases and tables do by physics, held against the truth of each."""
import numpy

import physics
from answers import SITE, accelerometers, check, names, near, parameters
from attitudes import in_accelerometers_frame
from sensors import DEG, EARTH, G0, LATITUDE_DEG


def of_gyros(answer):
    """All that is named of the gyros, be it their biases' own wandering as well."""
    return [f["effect"] for f in answer["gyros"]["findings"]]


def drifts(answer, sensor):
    return [(a["axis"], d) for a in answer["rest"]["axes"] if a["sensor"] == sensor for d in a["drifts"]]


def told(found):
    return [f"{axis} {d['effect']}" for axis, d in found]


def warm_gyros(operator, rng):
    truth = physics.warm_gyros(operator.folder, rng)
    answer = operator.answer("poses", "log.csv", *SITE)
    check(f"a drift of the gyros is named: {of_gyros(answer)}", bool({"gyro_temperature", "gyro_drift_ramp"} & set(of_gyros(answer))))
    m, _ = in_accelerometers_frame(truth["g"].matrix, truth["a"].matrix)
    known, z = parameters(answer, "gyros"), []
    for k, axis in enumerate("xyz"):
        p = known.get(f"scale_{axis}")
        check(f"gyro scale {axis} is known", bool(p))
        if p:
            near(f"gyro scale {axis}, ppm", p["value"], p["sigma"], m[k, k] - 1, 0.0, 1e6)
            z.append((p["value"] - m[k, k] + 1) / p["sigma"])
    check(f"off by {numpy.round(z, 1)} of sigma", numpy.sqrt(numpy.mean(numpy.square(z))) < 3)


def few_turns(operator, rng):
    z = []
    for _ in range(4):
        truth = physics.few_turns(operator.folder, rng)
        read_outs = operator.answer("poses", "log.csv", *SITE)["read_outs"]
        axes = {a["axis"]: a for a in read_outs["axes"]} if read_outs else {}
        check(f"both axes, by turns: {[(n, a['by'], a['rows']) for n, a in axes.items()]}", sorted(axes) == ["inner", "outer"])
        for name, axis in axes.items():
            z += list((numpy.array(axis["response"]) - truth[name]) / axis["response_sigma"])
        clock = read_outs and read_outs.get("clock")
        check("the delay is told", bool(clock))
        if clock:
            near("delay, ms", clock["delay_s"], clock["delay_sigma_s"], truth["late_s"], 0.0, 1e3)
    rms, most = numpy.sqrt(numpy.mean(numpy.square(z))), max(numpy.abs(z), default=numpy.inf)
    check(f"responses of four draws: rms {rms:.2f} of sigma, most {most:.1f}", len(z) == 24 and rms < 1.8 and most < 5)


def clipped_rates(operator, rng):
    truth = physics.clipped_rates(operator.folder, rng)
    read_outs = operator.answer("poses", "log.csv", *SITE)["read_outs"]
    axes = read_outs["axes"] if read_outs else []
    rows, clipped = [a["rows"] for a in axes], read_outs["clipped_rates"] if read_outs else 0
    check(f"{rows} rates, {clipped} clipped", rows == [4] and clipped > 0)
    for axis in axes:
        for k, x in enumerate("xyz"):
            near(f"response {x}", axis["response"][k], axis["response_sigma"][k], truth["response"][k], 0.0)
        check("no nonlinearity", not axis.get("nonlinearity", {}).get("named"))


def follows_temperature(operator, rng):
    truth = physics.follows_temperature(operator.folder, rng)
    answer = operator.answer("poses", "log.csv", *SITE)
    named = names(answer)
    check(f"the temperature is named and not the time: {named}", "gyro_temperature" in named and "gyro_drift_ramp" not in named)
    for f in answer["gyros"]["findings"]:
        for k, p in enumerate(f["parameters"] if f["effect"] == "gyro_temperature" else []):
            near(f"gyro {p['name']}, deg/s/degC", p["value"], p["sigma"], truth["coefficients"][k], 0.0, 1 / DEG)


def tilting_base(operator, rng):
    truth = physics.tilting_base(operator.folder, rng)
    answer = operator.answer("poses", "tilt.csv", *SITE)
    found, jumps = drifts(answer, "accelerometer"), answer["rest"]["base"]["jumps"]
    check(f"a tilt is nothing of the accelerometers: {told(found)}", not found)
    seen = [f"{j['arcmin'] / 60:.3f} deg at {j['at_s']:.0f} s" for j in jumps]
    check(f"the base tilts: {seen} of {truth['angle_deg']:.3f} deg at {truth['at_s']:.0f} s", len(jumps) == 1
          and abs(jumps[0]["at_s"] - truth["at_s"]) < 30 and abs(jumps[0]["arcmin"] / 60 / truth["angle_deg"] - 1) < 0.15)
    answer = operator.answer("poses", "jump.csv", *SITE)
    found = [(axis, d) for axis, d in drifts(answer, "accelerometer") if d["effect"] == "accel_bias_jump"]
    said = [d.get("tilt_of_the_base") for _, d in found]
    check(f"a bias that jumps is named, a tilt is {said}", {axis for axis, _ in found} == {truth["axis"]} and set(said) <= {"excluded", "open"}
          and not answer["rest"]["base"]["jumps"])
    at = [round(d["at_s"]) for _, d in found]
    check(f"as one at {truth['at_s']:.0f} s: {at}", len(at) == 1 and abs(at[0] - truth["at_s"]) < 30)
    for _, d in found[:1]:
        near(f"jump, {d['unit']}", d["value"], d["sigma"], truth["jump_g"] * 1e6, 0.0)


def reset_in_a_gap(operator, rng):
    truth = physics.reset_in_a_gap(operator.folder, rng)
    found = drifts(operator.answer("poses", "reset.csv", *SITE), "gyro")
    at = [d.get("at_s") for _, d in found]
    check(f"another bias behind the gap at {truth['at_s']:.0f} s: {told(found)} at {at}", told(found) == [f"{truth['axis']} gyro_bias_jump"]
          and abs(at[0] - truth["at_s"]) < 30)
    answer = operator.answer("poses", "gap.csv", *SITE)
    found = drifts(answer, "gyro") + drifts(answer, "accelerometer")
    check(f"a gap alone is nothing: {told(found)}", not found and not names(answer) and not answer["gyros"]["jumps"] and not answer["mismatch"])


def rocked(operator, rng):
    truth = physics.rocked(operator.folder, rng)
    for file, part in (("rocked.csv", 0.3), ("rest.csv", 0.2)):
        axes = operator.answer("poses", file, *SITE)["rest"]["axes"]
        white = [a["white_noise"]["value"] * DEG / 60 / truth["asd"] for a in axes if a["sensor"] == "gyro"]
        check(f"{file}: white noise {numpy.round(white, 2)} of the data sheet's", len(white) == 3 and all(abs(w - 1) < part for w in white))
        swings = {(a["sensor"], a["axis"]): a["swings"]["frequency_hz"] for a in axes if "swings" in a}
        hz = [f for (sensor, _), f in swings.items() if sensor == "gyro"]   # an upright accelerometer goes twice as often
        right = bool(hz) and all(abs(f / truth["hz"] - 1) < 0.05 for f in hz) if file == "rocked.csv" else not swings
        check(f"{file}: swings {swings}, truth {truth['hz']:.3f} Hz", right)


def wrong_time(operator, rng):
    physics.wrong_time(operator.folder, rng)
    for file in ("ms.csv", "degrees.csv"):
        answer = operator.answer("poses", file)
        contradict = answer["gyros"]["contradict"]
        check(f"{file}: {contradict}", bool(contradict) and answer["mismatch"])


def forces_in_g(operator, rng):
    physics.forces_in_g(operator.folder, rng)
    operator.refused("another unit", "poses", "log.csv")
    check("no phone's linear acceleration", "linear acceleration" not in operator.run("poses", "log.csv").stderr)


def silent_gyro(operator, rng):
    truth = physics.silent_gyro(operator.folder, rng)
    answer = operator.answer("poses", "log.csv", *SITE)
    check(f"nothing named of the gyros: {of_gyros(answer)}", not of_gyros(answer) and not answer["gyros"]["jumps"])
    check("no bias of the silent one", answer["gyros"]["bias"][truth["axis"]] is None)
    accelerometers(answer, truth["a"], 4e-5)


def g_sensitive(operator, rng):
    truth = physics.g_sensitive(operator.folder, rng)
    answer = operator.answer("poses", "log.csv")
    gyros = answer["gyros"]
    seen = gyros["latitude_seen_deg"]
    check(f"named: {of_gyros(answer)}", "gyro_g_sensitivity" in names(answer))
    check(f"no other latitude than there is: {seen}", seen is None or abs(seen - LATITUDE_DEG) < 15)
    for f in gyros["findings"]:
        for p in f["parameters"] if f["effect"] == "gyro_g_sensitivity" else []:
            i, j = ("xyz".index(axis) for axis in p["name"])   # the Earth's rate about the vertical goes with gravity, alike in all three axes
            near(f"gyro g-sensitivity {p['name']}, deg/s/g", p["value"], p["sigma"], truth["elements"][i, j], EARTH[2] * (i == j), 1 / DEG)


TRIALS = {warm_gyros: physics, few_turns: physics, clipped_rates: physics, follows_temperature: physics, tilting_base: physics, reset_in_a_gap: physics,
          rocked: physics, wrong_time: physics, forces_in_g: physics, silent_gyro: physics, g_sensitive: physics}
