"""Tables that are published instead of logs, and logs with labels, held against the truth of each."""
import numpy

import arrays
import claims as claims_of_names
import labels
import makers as makers_tables
import published
import silent as silent_gyros
import words
from answers import SITE, accelerometers, check, gyro_scales, names, near, parameters
from sensors import DEG, EARTH, G0, GRAVITY, LATITUDE_DEG


def positions(operator, rng):
    truth = published.positions(operator.folder, rng)
    for file in ("means.csv", "deviations.csv"):
        answer = operator.answer("poses", file, *SITE)
        check(f"{file}: a table of {answer['poses']} means, adequate", answer["means"] and answer["poses"] == 24 and answer["accelerometers"]["adequate"])
        accelerometers(answer, truth["a"], 0.0)
    answer = operator.answer("poses", "means.csv", *SITE)
    for k in range(3):   # of the Earth's rate only the vertical part is known without a heading
        near(f"gyro mean {'xyz'[k]}, deg/h", answer["gyros"]["bias"][k], answer["gyros"]["bias_sigma"][k], truth["g"].bias[k], numpy.linalg.norm(EARTH), 3600 / DEG)
    answer = operator.answer("poses", "means.csv")   # nobody says the place: what the Earth turns along the vertical is no g-sensitivity
    seen, sigma = answer["gyros"]["latitude_seen_deg"], answer["gyros"]["latitude_seen_sigma_deg"]
    check(f"latitude {seen} +- {sigma}; nothing named: {names(answer)}", seen is not None and abs(seen - LATITUDE_DEG) < 5 * sigma and not names(answer))
    known = parameters(operator.answer("poses", "counts.txt"), "accelerometers")
    for k, axis in enumerate("xyz"):
        p = known[f"scale_{axis}"]
        near(f"counts per g {axis}", p["value"], p["sigma"], truth["a"].matrix[k, k] * 16384 / G0 * GRAVITY, 0.0)
    operator.refused("row 8 is off by", "poses", "misread.csv")
    answer = operator.answer("poses", "bent.csv", *SITE)
    check("a square in all axes is a misfit", not answer["accelerometers"]["adequate"] and answer["mismatch"])
    operator.refused("rows of rates", "poses", "rates.csv")
    operator.refused("hold gravity", "poses", "nominal.csv")
    operator.short(14, "poses", "means.csv")


def six_faces(operator, rng):
    truth = published.six_faces(operator.folder, rng)
    operator.refused("standard deviations of the readings beside the means", "poses", "means.csv", "--only", "accelerometers")
    accelerometers(operator.answer("poses", "deviations.csv", *SITE), truth["a"], 0.0)


def head(operator, rng):
    truth = published.head(operator.folder, rng)
    files = {"volts.csv": 2.5, "amperes.csv": 1.3, "g.csv": None, "drift.csv": 2.5, "cubic.csv": None, "minutes.txt": 1.3, "more.csv": 2.5}
    for file, unit in files.items():
        answer = operator.answer("poses", file, *SITE)["dividing_head"]
        if file == "cubic.csv":
            check("a cubic part is told", answer["third"]["named"] and not answer["drift"]["named"])
            continue
        check(f"{file}: {answer['stops']} stops, a drift where there is one", answer["drift"]["named"] == (file == "drift.csv") and not answer["third"]["named"])
        for p in answer["parameters"]:
            true = truth[p["name"]] * (unit or 1.0) if p["name"] == "scale" and unit else truth[p["name"]] - (p["name"] == "scale")
            near(f"{p['name']}, {p['unit']}", p["value"], p["sigma"], true, 50e-6 if file == "drift.csv" and p["name"] == "bias" else 0.0)
        check("the quarter of the scale", answer["level_at_deg"] == (90.0 if file == "g.csv" else 0.0))
    check("two columns without names", operator.answer("poses", "plain.txt", "--only", "accelerometers", "--angle-column", 1)["dividing_head"]["angles"] == 72)
    operator.refused("8 and more", "poses", "four.csv")
    operator.refused("whether they are rad", "poses", "radians.csv")
    operator.short(13, "poses", "volts.csv")


def table_log(operator, rng):
    truth = published.table_log(operator.folder, rng)
    answer = operator.answer("poses", "imu.csv", "--angle-file", "table.csv")
    axes = answer["read_outs"]["axes"]
    check(f"one axis, {axes[0]['rows']} rates", len(axes) == 1 and axes[0]["rows"] == 8)
    for k in range(3):
        near(f"response {'xyz'[k]}", axes[0]["response"][k], axes[0]["response_sigma"][k], truth["response"][k], 1e-5)
    clock = answer["read_outs"]["clock"]
    near("late, ms", clock["delay_s"], clock["delay_sigma_s"], truth["late_s"], 0.0, 1e3)
    operator.refused("--angle-file takes", "poses", "imu.csv", "--attitude", "table.csv")
    operator.refused("no column is called an angle", "poses", "imu.csv", "--angle-file", "imu.csv")


def labelled(operator, rng):
    truth = labels.labelled(operator.folder, rng)
    a, g = truth["a"], truth["g"]
    for file, (per_g, per_dps) in {**truth["files"], "card.txt": (1.0, 1.0)}.items():
        rate = ["--rate", 100] if file == "sentences.txt" else []
        answer = operator.answer("poses", file, *SITE, *rate)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p, raw = known[f"scale_{axis}"], known[f"scale_{axis}"]["unit"] == "raw/g"
            true = a.matrix[k, k] * (GRAVITY / G0 * per_g if raw else 1.0) - (not raw)
            near(f"{file}: scale {axis}", p["value"], p["sigma"], true, 4e-5 * max(1.0, per_g if raw else 0.0))
        raw = answer["gyros"]["raw_unit_rad_s"] is not None
        check("three gyro scale factors", gyro_scales(answer, g, per_dps / DEG if raw else None) == 3)
    answer = operator.run("poses", "cut.txt", *SITE)
    check(f"a cut line is told: {answer.stderr.strip()[-120:]}", answer.returncode > 1 and "line 3001" in answer.stderr or "left out" in answer.stderr)
    operator.refused("lines of several kinds", "poses", "two.txt")
    operator.refused("bytes in hexadecimal", "poses", "bytes.txt")
    operator.refused("jq -c", "poses", "piece.json")
    operator.refused("jq -c", "poses", "pretty.json")
    operator.settled("objects.json", ("accelerometer.axes", "gyro.unit", "accelerometer.unit"))
    accelerometers(operator.diagnosed("objects.json"), a, 4e-5)


def over_lines(operator, rng):
    truth = labels.over_lines(operator.folder, rng)
    for file in truth["files"]:
        rate = [] if file in truth["timed"] else ["--rate", 100]
        answer = operator.answer("poses", file, *SITE, *rate)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p, raw = known[f"scale_{axis}"], known[f"scale_{axis}"]["unit"] == "raw/g"
            true = truth["a"].matrix[k, k] * ((GRAVITY if file in truth["no_unit"] else GRAVITY / G0) if raw else 1.0) - (not raw)
            near(f"{file}: scale {axis}", p["value"], p["sigma"], true, 6e-5 * (GRAVITY if raw else 1.0))
        raw = answer["gyros"]["raw_unit_rad_s"] is not None
        check("units by their words, three gyro scale factors", raw == (file in truth["raw"]) and gyro_scales(answer, truth["g"], 1.0 / DEG if raw else None) == 3)
    operator.settled("echo.txt", ("accelerometer.axes",))
    accelerometers(operator.diagnosed("echo.txt"), truth["a"], 6e-5)


def registers(operator, rng):
    truth = labels.registers(operator.folder, rng)
    for name in truth["files"]:
        answer = operator.answer("poses", f"{name}.txt", *SITE)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p = known[f"scale_{axis}"]
            near(f"{name}: counts per g, {axis}", p["value"], p["sigma"], truth["a"].matrix[k, k] * 16384 * GRAVITY / G0, 0.6)
        check("three gyro scale factors", gyro_scales(answer, truth["g"], 131.0 / DEG) == 3)
        at_rest = operator.answer("poses", f"{name}_rest.txt", *SITE)["rest"]
        means = {x["axis"]: x["mean"]["value"] for x in at_rest["axes"] if x["sensor"] == "accelerometer"}
        check(f"{name} at rest: {means}", all(abs(means[x] - truth["level"][k]) < 60 for k, x in enumerate("xyz")))


def lists(operator, rng):
    truth = labels.lists(operator.folder, rng)
    for file in truth["files"]:
        answer = operator.answer("poses", file, *SITE)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            near(f"{file}: 1 g of {axis}", known[f"scale_{axis}"]["value"], known[f"scale_{axis}"]["sigma"], truth["a"].matrix[k, k] * GRAVITY, 4e-5 * G0)
        check("three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
    axes = {(a["sensor"], a["axis"]): a["mean"]["value"] for a in operator.answer("poses", "rest.txt")["rest"]["axes"]}
    size = numpy.linalg.norm([axes["accelerometer", axis] for axis in "xyz"])
    check(f"at rest the accelerometers are those of 1 g: {size:.3f}", abs(size / GRAVITY - 1) < 0.02)


def imported(operator, rng):
    """Split times, late rows and words without a sign, brought by `import`."""
    truth = words.by_network(operator.folder, rng)
    operator.settled("log.csv", ("accelerometer.axes",))
    answer = operator.diagnosed("log.csv")
    accelerometers(answer, truth["a"], 4e-5)
    check("three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
    words.unsigned(operator.folder, rng)
    # A hand's tremor of 0.04 rad/s, correlated over 0.07 s, in turns of 1 to 2 s that the attitude does not follow: 1.0 deg about both level
    # axes together, 0.9 less nine parameters of 30 residuals, to 15 %.
    tremor_deg, three_sigma = 0.9, 1.45
    for file in ("plain.csv", "hex.csv", "full.csv"):
        operator.settled(file, ("accelerometer.axes", "gyro.unit", "accelerometer.unit"))
        answer = operator.diagnosed(file)
        carried = answer["gravity_direction_deg"]["after"]
        check(f"{file}: {answer['poses']} poses, gravity carried to {carried:.2f} deg", answer["poses"] == 16 and carried < three_sigma * tremor_deg)


def silent(operator, rng):
    truth = silent_gyros.silent(operator.folder, rng)
    answer = operator.answer("poses", "hand.csv", *SITE)
    accelerometers(answer, truth["a"], 4e-5)
    sigma = answer["gyros"]["bias_sigma"]
    check(f"bias of the gyros within the band that is set to zero: {sigma}", all(0.1 * DEG < s < 0.6 * DEG for s in sigma))
    check("three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
    for file in ("hand.csv", "rest.csv"):
        answer = operator.answer("poses", file)
        check(f"{file}: why is said", any("set" in words and "to zero" in words for words in answer["invisible"]))
    check("no sigma by nothing", all(a["mean"]["sigma"] is None for a in answer["rest"]["axes"] if a["sensor"] == "gyro"))
    answer = operator.answer("poses", "headings.csv", "--only", "gyros")
    jumps = any(d["effect"] == "gyro_bias_jump" for a in answer["rest"]["axes"] for d in a["drifts"])
    check(f"jumps {jumps}: or another heading", not jumps or any("another heading" in words for words in answer["invisible"]))


def hdf5(operator, rng):
    truth = arrays.hdf5(operator.folder, rng)
    for file in ("groups.h5", "table.hdf5", "own.mat", "structure.mat", "others.mat"):
        answer = operator.answer("poses", file, *SITE)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p, raw = known[f"scale_{axis}"], known[f"scale_{axis}"]["unit"] == "raw/g"
            near(f"{file}: scale {axis}", p["value"], p["sigma"], truth["a"].matrix[k, k] * (GRAVITY if raw else 1.0) - (not raw), 4e-5 * (G0 if raw else 1.0))
        check("three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
    operator.settled("groups.h5", ("accelerometer.axes",))
    accelerometers(operator.diagnosed("groups.h5"), truth["a"], 4e-5)


def makers(operator, rng):
    truth = makers_tables.makers(operator.folder, rng)
    for file in truth["files"]:
        answer = operator.answer("poses", file, *SITE)
        known = parameters(answer, "accelerometers")
        for k, axis in enumerate("xyz"):
            p, raw = known[f"scale_{axis}"], known[f"scale_{axis}"]["unit"] == "raw/g"
            near(f"{file}: scale {axis}", p["value"], p["sigma"], truth["a"].matrix[k, k] * (GRAVITY / G0 if raw else 1.0) - (not raw), 4e-5)
        check("three gyro scale factors", gyro_scales(answer, truth["g"], 1 / DEG if file == "dji.csv" else None) == 3)
        check(f"{answer['duration_s']:.1f} s", 120 < answer["duration_s"] < 250)
    answer = operator.answer("poses", "gforce.csv")
    check("accelerometers alone, no gyros", answer["sensors"] == "accelerometers" and answer["by_poses"])
    operator.refused("a unit in its name", "poses", "fast.csv")


def claims(operator, rng):
    truth = claims_of_names.claims(operator.folder, rng)
    operator.refused("gravity in another unit", "poses", "unit.csv")
    operator.refused("added up", "poses", "sums.csv")
    operator.refused("across it", "poses", "angles.csv")
    operator.refused("divided by their size", "poses", "direction.csv")
    accelerometers(operator.answer("poses", "coarse.csv", *SITE), truth["a"], 2e-4)


TRIALS = {positions: published, six_faces: published, head: published, table_log: published, labelled: labels, over_lines: labels, registers: labels, lists: labels, imported: None, silent: silent_gyros, hdf5: arrays, makers: makers_tables, claims: claims_of_names}
