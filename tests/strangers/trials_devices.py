"""What devices write beside or in the place of plain readings, held against the truth."""
import devices
from answers import SITE, check, gyro_scales, in_counts


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


TRIALS = {halves: devices}
