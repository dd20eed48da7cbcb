"""Tables of phones, wearables, spreadsheets and drones: dates as each writes them, sets without gravity beside the sensors, a time for each channel."""
import datetime

import numpy

from parts import by_hand
from sensors import DEG, G0, industrial


def makers(folder, rng):
    """One log as fourteen makers write it."""
    g, a, t, f, w = by_hand(rng, industrial, 16)
    force, rate = a.read(f, 100.0, rng), g.read(w, 100.0, rng)
    up = f / numpy.linalg.norm(f, axis=1)[:, None] * G0
    mg, dps, linear = force / G0, rate / DEG, force - up
    begin = datetime.datetime(2023, 10, 4, 9, 59, 13)

    def at(k, form, cut=None):
        return (begin + datetime.timedelta(seconds=t[k])).strftime(form)[:cut]

    def six(k, first, second, form="%.6f"):
        return ",".join(form % v for v in (*first[k], *second[k]))

    def names(*stems):
        return ",".join(stem % axis for stem in stems for axis in "XYZ")
    forms = {
        "androsensor.csv": (names("ACCELEROMETER %s (m/s²)", "GRAVITY %s (m/s²)", "LINEAR ACCELERATION %s (m/s²)", "GYROSCOPE %s (rad/s)") + ",Time since start in ms ",
                            lambda k: f"{six(k, force, up)},{six(k, linear, rate)},{1000 * t[k]:.0f}"),
        "sensorlog.csv": ("loggingTime(txt)," + names("accelerometerAcceleration%s(G)", "gyroRotation%s(rad/s)", "motionUserAcceleration%s(G)", "motionGravity%s(G)"),
                          lambda k: f"{at(k, '%Y-%m-%dT%H:%M:%S.%f', -3)}+02:00,{six(k, mg, rate)},{six(k, linear / G0, up / G0)}"),
        "excel.csv": ("Datetime," + names("Acc%s_g", "Gyr%s_dps"), lambda k: f"{45203 + t[k] / 86400:.10f},{six(k, mg, dps)}"),
        "datenum.csv": ("datenum," + names("Acc%s_g", "Gyr%s_dps"), lambda k: f"{739163 + t[k] / 86400:.9f},{six(k, mg, dps)}"),
        "hours.csv": ("time_h," + names("Acc%s_g", "Gyr%s_dps"), lambda k: f"{t[k] / 3600:.9f},{six(k, mg, dps)}"),
        "delsys.csv": (",".join(f'X[s],"Avanti sensor 1: {s}.{x} 1 [{u}]"' for s, u in (("ACC", "g"), ("GYRO", "deg/s")) for x in "XYZ"),
                       lambda k: ",".join(f"{t[k]:.4f},{v:.6f}" for v in (*mg[k], *dps[k]))),
        "dji.csv": ("tickNo,offsetTime," + names("IMU_ATTI(0):accel%s", "IMU_ATTI(0):gyro%s") + ",IMU_ATTI(0):quatW",
                    lambda k: f"{k},{t[k]:.3f},{six(k, mg, dps)},1.0"),
        "am_pm.csv": ("DateTime," + names("Acc%s_g", "Gyr%s_dps"), lambda k: f"{at(k, '%m/%d/%Y %I:%M:%S.%f %p')},{six(k, mg, dps)}"),
        "colons.csv": ("Time stamp," + names("%s axis [g]", "gyro %s [deg/s]") + ",button [1/0]", lambda k: f"{at(k, '%Y-%m-%d %H:%M:%S:%f', -3)},{six(k, mg, dps)},0"),
        "matlab.csv": ("Timestamp," + names("Acc%s_g", "Gyr%s_dps"), lambda k: f"{at(k, '%d-%b-%Y %H:%M:%S.%f', -3)},{six(k, mg, dps)}"),
        "points.csv": ("Zeit," + names("Beschleunigung %s [g]", "Drehrate %s [°/s]"), lambda k: f"{at(k, '%d.%m.%Y %H:%M:%S.%f', -3)},{six(k, mg, dps)}"),
        "toolbox.csv": ("time," + ",".join([*[f"gF{x}" for x in "xyz"], *[f"w{x}" for x in "xyz"]]), lambda k: f"{t[k]:.3f},{six(k, mg, rate)}"),
        "body.csv": ("Time [s],Roll Rate [deg/s],Pitch Rate [deg/s],Yaw Rate [deg/s]," + names("%s Accel [g]"), lambda k: f"{t[k]:.3f},{six(k, dps, mg)}"),
        "rot.csv": ("msg,time (s)," + names("%s Rot (deg/s)", "%s Accel (g)"), lambda k: f"{k},{t[k]:.3f},{six(k, dps, mg)}"),
    }
    for name, (head, row) in forms.items():
        with open(folder / name, "w", encoding="utf-8") as out:
            out.write(head + "\n" + "".join(row(k) + "\n" for k in range(len(t))))
    with open(folder / "gforce.csv", "w", encoding="utf-8") as out:   # without gyros: gFx is no gyro
        out.write("time,gFx,gFy,gFz,TgF\n" + "".join("%.3f,%.6f,%.6f,%.6f,%.6f\n" % (t[k], *mg[k], numpy.linalg.norm(mg[k])) for k in range(len(t))))
    with open(folder / "fast.csv", "w", encoding="utf-8") as out:
        out.write("clock," + names("Acc%s_g", "Gyr%s_dps") + "\n" + "".join(f"{t[k] / 3600:.9f},{six(k, mg, dps)}\n" for k in range(len(t))))
    return {"g": g, "a": a, "files": list(forms)}
