"""Heads of IMU logs as loggers write them, and what stands under them. A column is written as what it holds:

  t.UNIT[.ORIGIN]   time since ORIGIN s          g.UNIT a.UNIT     three gyros, three accelerometers (increments: dg, da;
  sec nsec          the two parts of a time                        gz.UNIT az.UNIT: z first)
  T.UNIT            temperature                  m                 three magnetometers
  e e.rad           roll, pitch, yaw             lin grav          a phone's acceleration without gravity, and its gravity
  n n8 zero one     counter, one of 8 bits, constants              word q dt alt
  date share        date and time, "13 / 22"                       three four five
"""
import dataclasses
import datetime

import numpy

import generator

TIME = {"s": 1.0, "ms": 1e-3, "us": 1e-6, "ns": 1e-9, "100us": 1e-4}
# One of them in SI: registers of MPU-6050, LSM6, MMA8451, ADXL345.
COUNTS = {"16.4": numpy.pi / 180 / 16.4, "131": numpy.pi / 180 / 131, "70mdps": numpy.pi / 180 * 0.07, "65.5": numpy.pi / 180 / 65.5,
          "2048": generator.G0 / 2048, "16384": generator.G0 / 16384, "1024": generator.G0 / 1024, "256": generator.G0 / 256}
UNITS = {"mdeg/s": 1e-3 * numpy.pi / 180, **generator.RATES, **generator.ANGLES, **generator.FORCES, **generator.VELOCITIES}


@dataclasses.dataclass
class Logger:
    name: str
    separator: str
    head: str               # all lines before the numbers; the one with the names is line `names`, from 0, or there is none
    holds: str
    names: int = 0
    doubts: tuple = ()      # what the head leaves open; "refused": with one line
    line: str = "{}"        # of a line of numbers
    gyro: int = 0           # which of several sets is meant
    accel: int = 0


# A counter is no time: rate and units that follow from it are open, and with them what the Earth's rate shows.
NO_TIME = ("time.column", "time.unit", "gyro.unit", "accelerometer.unit", "accelerometer.axes")

# Counts whose meaning the data sheet knows; they are too coarse to show the Earth's rate.
REGISTERS = ("gyro.unit", "accelerometer.unit", "accelerometer.zero", "accelerometer.axes")

LOGGERS = [
    Logger("EuRoC data.csv", ",", "#timestamp [ns],w_RS_S_x [rad s^-1],w_RS_S_y [rad s^-1],w_RS_S_z [rad s^-1],a_RS_S_x [m s^-2],a_RS_S_y [m s^-2],"
           "a_RS_S_z [m s^-2]", "t.ns.1403636579 g.rad/s a.m/s^2"),
    Logger("Xsens MT Manager", "\t", "// Start Time: Unknown\n// Sample rate: 100.0Hz\n// Scenario: 4.9\n// Firmware Version: 2.6.1\n"
           "PacketCounter\tSampleTimeFine\tAcc_X\tAcc_Y\tAcc_Z\tGyr_X\tGyr_Y\tGyr_Z\tMag_X\tMag_Y\tMag_Z\tRoll\tPitch\tYaw",
           "n t.100us.30 a.m/s^2 g.rad/s m e", 4),
    Logger("Xsens MT Manager, increments", "\t", "// Sample rate: 100.0Hz\nPacketCounter\tAcc_X\tAcc_Y\tAcc_Z\tVelInc_X\tVelInc_Y\tVelInc_Z\tOriInc_q0\tOriInc_q1\t"
           "OriInc_q2\tOriInc_q3\tGyr_X\tGyr_Y\tGyr_Z", "n a.m/s^2 da.m/s q g.rad/s", 1, (*NO_TIME, "accelerometer.columns")),
    Logger("Movella DOT", ",", "sep=,\nDeviceTag:,D422CD0065A1\nFirmwareVersion:,2.0.0\nOutputRate:,100Hz\n\n"
           "PacketCounter,SampleTimeFine,Quat_W,Quat_X,Quat_Y,Quat_Z,Acc_X,Acc_Y,Acc_Z,Gyr_X,Gyr_Y,Gyr_Z",
           "n t.us.3000 q a.m/s^2 g.deg/s", 5),
    Logger("VectorNav", ",", "Time [s],GpsCycle,GpsWeek,GpsToW,TimeStartup,UnCompMagX,UnCompMagY,UnCompMagZ,UnCompAccX,UnCompAccY,UnCompAccZ,UnCompGyroX,"
           "UnCompGyroY,UnCompGyroZ,Temperature", "t.s zero one t.s.219418 t.ns.12 m a.m/s^2 g.rad/s T.C"),
    Logger("NovAtel RAWIMUSXA", ",", "", "nov t.s.484620 nov2 a.nov g.nov end", -1, ("refused",),
           line="%RAWIMUSXA,1692,{}"),
    Logger("SBG sbgBasicLogger", "\t", "timestamp\tstatus\taccelX\taccelY\taccelZ\tgyroX\tgyroY\tgyroZ\ttemperature\n"
           "(us)\t(na)\t(m.s^-2)\t(m.s^-2)\t(m.s^-2)\t(deg.s^-1)\t(deg.s^-1)\t(deg.s^-1)\t(degC)", "t.us.5 one a.m/s^2 g.deg/s T.C"),
    Logger("PX4 ulog2csv", ",", "timestamp,gyro_rad[0],gyro_rad[1],gyro_rad[2],gyro_integral_dt,accelerometer_timestamp_relative,accelerometer_m_s2[0],"
           "accelerometer_m_s2[1],accelerometer_m_s2[2],accelerometer_integral_dt,accelerometer_clipping",
           "t.us.112 g.rad/s dt zero a.m/s^2 dt zero"),
    Logger("ArduPilot mavlogdump", ",", "timestamp,TimeUS,I,GyrX,GyrY,GyrZ,AccX,AccY,AccZ,EG,EA,T,GH,AH,GHz,AHz",
           "t.s.1709164800 t.us.65 zero g.rad/s a.m/s^2 zero zero alt one one one one"),
    Logger("Betaflight blackbox_decode", ", ", "loopIteration, time (us), axisP[0], axisP[1], axisP[2], rcCommand[0], vbatLatest (V), gyroADC[0], gyroADC[1], "
           "gyroADC[2], accSmooth[0], accSmooth[1], accSmooth[2], motor[0]", "n t.us.30 zero zero zero one one g.deg/s a.2048 one", 0, ("accelerometer.unit", "accelerometer.zero")),
    Logger("x-io x-IMU", ",", "Packet number,Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
           "Accelerometer Z (g),Magnetometer X (G),Magnetometer Y (G),Magnetometer Z (G)", "n g.deg/s a.g m", 0, NO_TIME),
    Logger("x-io NGIMU", ",", "Time (s),Gyroscope X (deg/s),Gyroscope Y (deg/s),Gyroscope Z (deg/s),Accelerometer X (g),Accelerometer Y (g),"
           "Accelerometer Z (g),Magnetometer X (uT),Magnetometer Y (uT),Magnetometer Z (uT),Barometer (hPa)", "t.s g.deg/s a.g m alt"),
    Logger("phyphox", ",", '"Time (s)","Acceleration x (m/s^2)","Acceleration y (m/s^2)","Acceleration z (m/s^2)","Absolute acceleration (m/s^2)",'
           '"Gyroscope x (rad/s)","Gyroscope y (rad/s)","Gyroscope z (rad/s)","Gyroscope magnitude (rad/s)"', "t.s a.m/s^2 alt g.rad/s zero"),
    Logger("phyphox, linear acceleration first", "\t", '"Time (s)"\t"Linear Acceleration x (m/s^2)"\t"Linear Acceleration y (m/s^2)"\t"Linear Acceleration z (m/s^2)"\t'
           '"Acceleration x (m/s^2)"\t"Acceleration y (m/s^2)"\t"Acceleration z (m/s^2)"\t"Gyroscope x (rad/s)"\t"Gyroscope y (rad/s)"\t"Gyroscope z (rad/s)"',
           "t.s lin a.m/s^2 g.rad/s"),
    Logger("AndroSensor", ";", "sep=;\nACCELEROMETER X (m/s²);ACCELEROMETER Y (m/s²);ACCELEROMETER Z (m/s²);GRAVITY X (m/s²);GRAVITY Y (m/s²);GRAVITY Z (m/s²);"
           "LINEAR ACCELERATION X (m/s²);LINEAR ACCELERATION Y (m/s²);LINEAR ACCELERATION Z (m/s²);GYROSCOPE X (rad/s);GYROSCOPE Y (rad/s);"
           "GYROSCOPE Z (rad/s);LIGHT (lux);MAGNETIC FIELD X (μT);MAGNETIC FIELD Y (μT);MAGNETIC FIELD Z (μT);ORIENTATION Z (azimuth °);"
           "ORIENTATION X (pitch °);ORIENTATION Y (roll °);Satellites in range;Time since start in ms ;YYYY-MO-DD HH-MI-SS_SSS",
           "a.m/s^2 grav lin g.rad/s one m e share t.ms date", 1),
    Logger("HyperIMU", ",", "@ HyperIMU -ianovir - 2018\n@ Date:Wed Feb 19 13:14:20 GMT+03:00 2020, Sampling Rate:10ms\n\n"
           "timestamp,accelerometer_lsm6ds3_c.x,accelerometer_lsm6ds3_c.y,accelerometer_lsm6ds3_c.z,akm_akm09918.x,akm_akm09918.y,akm_akm09918.z,"
           "gyroscope_lsm6ds3_c.x,gyroscope_lsm6ds3_c.y,gyroscope_lsm6ds3_c.z,gravity.x,gravity.y,gravity.z,linear_Acceleration.x,"
           "linear_Acceleration.y,linear_Acceleration.z", "t.ms.1582107260 a.m/s^2 m g.rad/s grav lin", 3),
    Logger("IMU+GPS stream, sensors by number", ", ", "", "t.s.683432 three a.m/s^2 four g.rad/s five m", -1),
    Logger("a network's clock and the sensor's", ",", "server_time,device_timestamp_ms,accel_x,accel_y,accel_z,gyro_x,gyro_y,gyro_z,mag_x,mag_y,mag_z,temp_c",
           "date t.ms.40 a.g g.deg/s m T.C"),
    Logger("Sensor Logger", ",", "time,seconds_elapsed,Gyroscope_z,Gyroscope_y,Gyroscope_x,TotalAcceleration_z,TotalAcceleration_y,TotalAcceleration_x",
           "t.ns.1709164800 t.s gz.rad/s az.m/s^2"),
    Logger("Gyroflow .gcsv", ",", "GYROFLOW IMU LOG\nversion,1.3\nid,custom_logger\norientation,YxZ\ntscale,0.001\ngscale,0.0010642\nascale,0.00059855\n"
           "t,gx,gy,gz,ax,ay,az", "t.ms g.16.4 a.16384", 7, REGISTERS),
    Logger("MPU-6050 registers", ",", "t_ms,ax,ay,az,gx,gy,gz", "t.ms a.16384 g.131", 0, REGISTERS),
    Logger("LSM6, MMA8451 registers", " ", "# time_us gyro_x gyro_y gyro_z acc_x acc_y acc_z", "t.us g.70mdps a.1024", 0,
           REGISTERS),
    Logger("ADXL345 registers", "\t", "ms\taccX\taccY\taccZ\tgyrX\tgyrY\tgyrZ", "t.ms a.256 g.65.5", 0, REGISTERS),
    Logger("ros2 topic echo --csv", ",", "", "sec nsec word q zero zero zero zero zero zero zero zero zero g.rad/s zero zero zero zero zero zero zero zero zero "
           "a.m/s^2 zero zero zero zero zero zero zero zero zero", -1, ("time", "gyro.columns", "accelerometer.columns", "gyro.unit", "accelerometer.unit", "accelerometer.axes")),
    Logger("SensorLog, iOS", ",", "loggingTime(txt),accelerometerTimestamp_sinceReboot(s),accelerometerAccelerationX(G),accelerometerAccelerationY(G),"
           "accelerometerAccelerationZ(G),gyroTimestamp_sinceReboot(s),gyroRotationX(rad/s),gyroRotationY(rad/s),gyroRotationZ(rad/s),motionYaw(rad),"
           "motionRoll(rad),motionPitch(rad),motionUserAccelerationX(G),motionUserAccelerationY(G),motionUserAccelerationZ(G)",
           "word t.s.62608 a.g t.s.62608 g.rad/s e.rad lin"),
    Logger("ADIS164xx registers", ",", "DATA_CNT,X_GYRO_OUT,Y_GYRO_OUT,Z_GYRO_OUT,X_ACCL_OUT,Y_ACCL_OUT,Z_ACCL_OUT,TEMP_OUT", "n g.deg/s a.mg T.C", 0,
           NO_TIME),
    Logger("STIM300", ";", "Time [s];X-Gyro [deg/s];Y-Gyro [deg/s];Z-Gyro [deg/s];X-Acc [g];Y-Acc [g];Z-Acc [g];Gyro X temp [°C];Counter", "t.s g.deg/s a.g T.C n8"),
    Logger("Epson", ",", "Log Created:, 2024-03-01 10:00:00\nsample, gyro_x[dps], gyro_y[dps], gyro_z[dps], accl_x[mG], accl_y[mG], accl_z[mG], temp[degC], count",
           "n g.deg/s a.mg T.C n8", 1, NO_TIME),
    Logger("MicroStrain", ",", "DATA_START\nGPS TFlags,GPS Week,GPS TOW,X Accel [x8004],Y Accel [x8004],Z Accel [x8004],X Gyro [x8005],Y Gyro [x8005],Z Gyro [x8005],"
           "Delta Theta X [x8007],Delta Theta Y [x8007],Delta Theta Z [x8007],Delta Vel X [x8008],Delta Vel Y [x8008],Delta Vel Z [x8008]",
           "one one t.s.219418 a.g g.rad/s dg.rad da.g*s", 1, ("gyro.columns", "accelerometer.columns")),
    Logger("Shimmer Consensys", "\t", "Shimmer_8665_Timestamp_Unix_CAL\tShimmer_8665_Accel_LN_X_CAL\tShimmer_8665_Accel_LN_Y_CAL\tShimmer_8665_Accel_LN_Z_CAL\t"
           "Shimmer_8665_Gyro_X_CAL\tShimmer_8665_Gyro_Y_CAL\tShimmer_8665_Gyro_Z_CAL\nms\tm/(s^2)\tm/(s^2)\tm/(s^2)\tdeg/s\tdeg/s\tdeg/s",
           "t.ms.1709164800 a.m/s^2 g.deg/s"),
    Logger("a chamber's own", ",", "t_s,T_C,wx_dps,wy_dps,wz_dps,ax_g,ay_g,az_g", "t.s T.C g.deg/s a.g"),
    Logger("MATLAB writetable", ",", "Time,Acc_1,Acc_2,Acc_3,Gyr_1,Gyr_2,Gyr_3", "t.s a.m/s^2 g.rad/s"),
    Logger("rostopic echo -p", ",", "%time,field.header.seq,field.header.stamp,field.header.frame_id,field.orientation.x,field.orientation.y,field.orientation.z,"
           "field.orientation.w,field.orientation_covariance0,field.angular_velocity.x,field.angular_velocity.y,field.angular_velocity.z,"
           "field.angular_velocity_covariance0,field.linear_acceleration.x,field.linear_acceleration.y,field.linear_acceleration.z,"
           "field.linear_acceleration_covariance0", "t.ns.1709164800 n t.ns.1709164800 word q one g.rad/s one a.m/s^2 one"),
    Logger("PlotJuggler", ",", "__time,/imu/data/angular_velocity/x,/imu/data/angular_velocity/y,/imu/data/angular_velocity/z,/imu/data/linear_acceleration/x,"
           "/imu/data/linear_acceleration/y,/imu/data/linear_acceleration/z", "t.s.1709164800 g.rad/s a.m/s^2"),
    Logger("TUM", " ", "# timestamp wx wy wz ax ay az", "t.s.1305031102 g.rad/s a.m/s^2"),
    Logger("MEMS Studio", ",", "timestamp[us],acc_x[mg],acc_y[mg],acc_z[mg],gyro_x[mdps],gyro_y[mdps],gyro_z[mdps]", "t.us a.mg g.mdeg/s"),
    Logger("Arduino", ",", "timestamp(ms),ax(g),ay(g),az(g),gx(dps),gy(dps),gz(dps)", "t.ms a.g g.deg/s"),
    Logger("ICM, units once", ",", "seconds.milliseconds,gx(dps),gy,gz,ax(g),ay,az,mx(uT),my,mz,temperature(degree)", "t.s g.deg/s a.g m T.C"),
]


def spread(logger):
    """What each column holds: (kind, unit or number, axis, set)."""
    out, sets = [], {}
    for token in logger.holds.split():
        kind, _, rest = token.partition(".")
        if kind in ("gz", "az"):
            out += [(kind[0], rest, axis, 0) for axis in (2, 1, 0)]
        elif kind in ("g", "a", "dg", "da", "m", "e", "lin", "grav"):
            group = kind.lstrip("d")
            number = sets.setdefault(group, 0)
            sets[group] = number + 1
            out += [(kind, rest, axis, number) for axis in range(3)]
        elif kind == "q":
            out += [("q", "", axis, 0) for axis in range(4)]
        else:
            out.append((kind, rest, 0, 0))
    return out


def column(what, t, rng):
    """The texts of a column."""
    kind, unit, axis, _ = what
    n, rate = len(t["end"]), t["rate"]

    def text(values, digits=9):
        return [f"%.{digits}g" % v for v in values]
    if kind == "t":
        scale, _, origin = unit.partition(".")
        ticks = numpy.round(t["end"] / TIME[scale]).astype(int) if scale != "s" else t["end"]
        begin = int(origin or 0)
        return [f"{begin + v:.6f}" for v in ticks] if scale == "s" else [str(int(v) + round(begin / TIME[scale])) for v in ticks]
    if kind in ("sec", "nsec"):
        whole = [1709164800 * 10**9 + round(e * 1e9) for e in t["end"]]
        return [str(w // 10**9 if kind == "sec" else w % 10**9) for w in whole]
    if unit in COUNTS:
        raw = t["theta" if kind == "g" else "velocity"][:, axis] * rate / COUNTS[unit]
        return [str(round(v)) for v in raw]
    if kind in ("g", "dg"):
        factor = 1.0 if kind == "dg" else rate
        return text(t["theta"][:, axis] * factor / {"nov": 1e-9 * rate, **UNITS}[unit], 12)
    if kind in ("a", "da"):
        factor = 1.0 if kind == "da" else rate
        return text(t["velocity"][:, axis] * factor / {"nov": 1e-8 * rate, **UNITS}[unit], 12)
    if kind == "T":
        return text(t["temperature"], 6)
    if kind == "lin":
        return text(rng.normal(0, 0.02, n), 5)
    if kind == "grav":
        return text(t["velocity"][:, axis] * rate, 4)
    if kind == "m":
        return text(20 * numpy.sin(t["outer"] + axis) + 10 * numpy.cos(t["inner"] - axis) + rng.normal(0, 0.2, n), 5)
    if kind == "e":
        return text(numpy.degrees([t["inner"], 0.3 * t["inner"], t["outer"]][axis]) * (numpy.pi / 180 if unit else 1), 6)
    if kind == "q":
        return text(numpy.cos(t["outer"] / 2 + axis), 6)
    if kind in ("n", "n8"):
        return [str(k % 256 if kind == "n8" else k + 4000) for k in range(n)]
    if kind == "alt":
        return text(9.81 + rng.normal(0, 0.01, n), 6)
    if kind == "date":
        return [(datetime.datetime(2020, 2, 19, 13, 14) + datetime.timedelta(seconds=e)).isoformat(" ", "milliseconds") for e in t["end"]]
    constant = {"share": "13 / 22", "three": "3", "four": "4", "five": "5", "zero": "0", "one": "1", "word": "imu_link", "dt": "5000", "nov": "484620.664;00", "nov2": "00801503", "end": "-9895*a5db8c7b"}
    return [constant[kind]] * n


def write(path, logger, t, rng):
    columns = [column(what, t, rng) for what in spread(logger)]
    lines = logger.head.split("\n") if logger.head else []
    lines += [logger.line.format(logger.separator.join(cells)) for cells in zip(*columns)]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")
