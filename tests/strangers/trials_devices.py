"""What devices write beside or in the place of plain readings, held against the truth."""
import numpy

import devices
from answers import SITE, accelerometers, check, gyro_scales, in_counts, names, near, parameters
from sensors import DEG, G0


def halves(operator, rng):
    truth = devices.halves(operator.folder, rng)
    for file in ("adis.csv", "unsigned.csv", "signed.csv"):
        answer = operator.answer("poses", file, *SITE)
        in_counts(answer, truth)
        check(f"{file}: three gyro scale factors in counts", gyro_scales(answer, truth["g"], truth["raw_per_rad_s"]) == 3)
        check("said", "words of 32 bits are put together" in operator.run("poses", file).stderr)
    in_counts(operator.answer("poses", "bytes.csv", *SITE), truth["bytes"])
    for file, triad in (("exchanged.csv", "gyro"), ("empty.csv", "gyro"), ("ranges.csv", "accelerometer")):
        operator.refused("2 sets of", "poses", file)
        check(f"{file}: which columns is doubted", f"{triad}.columns" in operator.doubts(file))
    check("words put together bring units as a doubt", operator.doubts("adis.csv") <= {"gyro.unit", "accelerometer.unit", "gyro.axes", "accelerometer.axes"})


def side_by_side(operator, rng):
    truth = devices.side_by_side(operator.folder, rng)
    for file in ("behind.csv", "before.csv"):
        answer = operator.answer("poses", file, *SITE)
        in_counts(answer, truth)
        check(f"{file}: three gyro scale factors in counts", gyro_scales(answer, truth["g"], truth["raw_per_rad_s"]) == 3)
        check("said", "of 2 sets of accelerometers what the sensor itself gives" in operator.run("poses", file).stderr)
        doubts = operator.doubts(file)
        check(f"doubted in a map: {sorted(doubts)}", {"gyro.columns", "accelerometer.columns"} <= doubts)
    of_other = ("--gyro-columns", "8,9,10", "--accelerometer-columns", "acc2_x_m_s2, acc2_y_m_s2, acc2_z_m_s2")
    for file, arguments in (("android.csv", ()), ("filtered.csv", ()), ("two.csv", of_other)):
        answer = operator.answer("poses", file, *arguments, *SITE)
        accelerometers(answer, truth["a"], 4e-5)
        check(f"{file}: three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
    calibrated = operator.answer("poses", "behind.csv", "--gyro-columns", "2,3,4", "--accelerometer-columns", "5,6,7", *SITE)
    known = parameters(calibrated, "accelerometers")
    for axis in "xyz":
        near(f"bias {axis} of the calibrated set, mg", known[f"bias_{axis}"]["value"], known[f"bias_{axis}"]["sigma"], 0.0, 4e-5 * G0, 1e3 / G0)
    operator.refused("2 sets of gyros, x in column 2 (gyro1_x_rad_s), column 8 (gyro2_x_rad_s): --gyro-columns says which", "poses", "two.csv")
    operator.refused("2 sets of accelerometers", "poses", "one.csv")
    operator.refused("--gyro-columns: 'gx' is none of its 13 columns", "poses", "two.csv", "--gyro-columns", "gx,gy,gz")
    operator.refused("--gyro-columns: 2 columns, x, y and z are wanted", "poses", "two.csv", "--gyro-columns", "2,3")


def novatel(operator, rng):
    truth = devices.novatel(operator.folder, rng)
    for file in ("rawimus.gps", "rawimux.log"):
        answer = operator.answer("poses", file, *SITE)
        check(f"{file}: {answer['poses']} poses, nothing named: {names(answer)}", answer["poses"] == 14 and not names(answer))
        in_counts(answer, truth)
        check("three gyro scale factors in counts, no axis reversed", gyro_scales(answer, truth["g"], truth["raw_per_rad_s"]) == 3
              and not answer["gyros"]["contradict"])
        check("said", "y of both triads is the log's -y" in operator.run("poses", file).stderr)
        operator.settled(file, ("gyro.unit", "accelerometer.unit", "accelerometer.axes"))
    said = operator.run("poses", "rawimus.gps").stderr
    check(f"the damaged line is left out: {said.strip()[-200:]}", "1 row without a time is left out" in said)
    for file, words in (("corrected.txt", "IMURATECORRIMUSA: the receiver has taken gravity"), ("damaged.txt", "the checksum is another than the line's"),
                        ("positions.txt", "without lines of RAWIMU")):
        operator.refused(words, "poses", file)
        operator.refused(words, "import", file, "--guess")


def clocks(operator, rng):
    truth = devices.clocks(operator.folder, rng)
    for file, said in (("posix.csv", "a second stands twice"), ("posix_ms.csv", "a second stands twice"), ("whole.csv", "as a leap second does"),
                       ("utc.csv", "a second stands twice"), ("midnight.csv", "begins again"), ("seconds.csv", "begins again"),
                       ("digits.csv", "is a time of the day, hhmmss"), ("week.csv", "begins again")):
        answer = operator.answer("poses", file, *SITE)
        accelerometers(answer, truth["a"], 4e-5)
        check(f"{file}: three gyro scale factors", gyro_scales(answer, truth["g"]) == 3)
        words = operator.run("poses", file).stderr
        check(f"said: {words.strip()[-150:]}", said in words)
        if file not in ("whole.csv", "seconds.csv"):   # a recording wants a time of each row
            operator.settled(file, ("accelerometer.axes",))
    operator.refused("is not after", "poses", "back.csv")


def few_axes(operator, rng):
    truth = devices.few_axes(operator.folder, rng)
    for file, axes in (("plane.csv", "z"), ("three.csv", "xyz")):
        answer = operator.answer("poses", file)
        found = answer["rest"]["axes"]
        check(f"{file}: gyros {axes} alone, nothing named: {names(answer)}", len(found) == len(axes) and not answer["mismatch"] and answer["sensors"] == "gyros")
        for axis, one in zip(axes, found):
            near(f"mean {axis}, deg/h", one["mean"]["value"] * DEG / 3600, one["mean"]["sigma"] * DEG / 3600, truth["mean"]["xyz".index(axis)], truth["wander"], 3600 / DEG)
            white = one["white_noise"]["value"] * DEG / 60 / truth["asd"]
            check(f"white noise {white:.3f} of the data sheet's", 0.85 < white < 1.25)
        said = operator.run("poses", file).stderr
        check(f"said: {said.strip()[:150]}", "column 2 (ax_g), column 3 (ay_g): left alone, for bias and scale factors by gravity" in said)
    accelerometers(operator.answer("poses", "spatial.csv", *SITE), truth["a"], 4e-5)
    check("one gyro is left alone", "column 5 (rate_x_dps): left alone" in operator.run("poses", "spatial.csv").stderr)
    check("and told by itself", operator.answer("poses", "spatial.csv", "--only", "gyros")["gyros"]["bias"].count(None) == 2)
    for file in ("two.csv", "four.csv"):
        operator.refused("no x, y and z of either", "poses", file)
    operator.refused("three gyros and three accelerometers are expected", "import", "plane.csv", "--guess")


def warming_up(operator, rng):
    truth = devices.warming_up(operator.folder, rng)
    sigma = {}
    for file, drift in truth["files"].items():
        answer = operator.answer("poses", file, *SITE)
        known = parameters(answer, "accelerometers")
        sigma[file] = max((known[f"bias_{x}"]["sigma"] for x in "xyz" if f"bias_{x}" in known), default=numpy.inf)
        for k, axis in enumerate("xyz"):   # a bias that goes on is told as what it is in the mean
            if p := known.get(f"bias_{axis}"):
                near(f"{file}: bias {axis}, mg", p["value"], p["sigma"], truth["a"].bias[k] + drift[k], 4e-5 * G0, 1e3 / G0)
            if p := known.get(f"scale_{axis}"):
                near(f"{file}: scale {axis}, ppm", p["value"], p["sigma"], truth["a"].matrix[k, k] - 1, 4e-5, 1e6)
    check(f"sigma of the warm one is the least: {sigma}", sigma["warm.csv"] < min(sigma["ramp.csv"], sigma["warming.csv"]))


TRIALS = {halves: devices, side_by_side: devices, novatel: devices, clocks: devices, few_axes: devices, warming_up: devices}
