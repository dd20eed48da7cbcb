"""The truths of the off-form trial: laws and effects of the virtual INS, drawn here. They share nothing with the diagnosis."""
import json
import math
import pathlib
import random
import subprocess

# The rates' law: 1 while the gimbal turns, 0 at rest.
TURNS = "tanh(1e4*(wo**2+wi**2))"


def law(axis, expression, coefficient):
    unit = "ug" if axis.startswith("accel") else "deg/h"
    return f'[[law]]\naxis = "{axis}"\nexpression = "{expression}"\ncoefficient = {coefficient:.8g}\nunit = "{unit}"\n'


def effect(name, **values):
    return f'[[effect]]\nid = "{name}"\n' + "".join(f"{k} = {v:.8g}\n" for k, v in values.items())


class Drawn:
    """The truth of one case: physics file, the names that are right."""

    def __init__(self, rng):
        self.r = rng
        self.strength = math.exp(rng.uniform(math.log(30.0), math.log(500.0)))
        self.letter = rng.choice("xyz")
        self.accel, self.gyro = "accel_" + self.letter, "gyro_" + self.letter
        self.sign = rng.choice((-1.0, 1.0))

    def uniform(self, low, high):
        return self.r.uniform(low, high)

    # Sizes in the units of the laws at which one sigma is reached with these sensors (ARW 0.001, VRW 5, dwells of a minute):
    # creep 0.7 ug, warm-up 0.8 ug, g-sensitivity 0.0025 deg/h, asymmetry 0.6 ppm, offsets 0.004 cm.
    def creep(self, kernel):
        tau = self.uniform(25.0, 80.0)
        text = kernel.replace("TAU", f"{tau:.5g}")
        return law(self.accel, text, self.sign * 0.7 * self.strength), {"accel_relaxation"}

    def creep_held(self):
        return self.creep(f"exp(-since/TAU)*(1-{TURNS})")

    def creep_stretched(self):
        return self.creep(f"exp(-(since/TAU)**{self.uniform(0.8, 0.95):.3f})")

    def creep_two(self):
        w = self.uniform(0.1, 0.25)
        return self.creep(f"{1 - w:.3f}*exp(-since/TAU)+{w:.3f}*exp(-since/({self.uniform(2.0, 4.0):.3f}*TAU))")

    def creep_delayed(self):
        return self.creep(f"exp(-since/TAU)*(1-exp(-since/{self.uniform(0.3, 1.5):.3f}))")

    def creep_saturating(self):
        k = self.uniform(0.4, 0.8)
        return self.creep(f"tanh({k:.3f}*exp(-since/TAU))/{math.tanh(k):.5f}")

    def creep_by_sense(self):
        return self.creep(f"exp(-since/TAU)*(1+{self.uniform(0.01, 0.04):.4f}*sin(outer))")

    def warm_up(self, kernel):
        tau = self.uniform(0.05, 0.25)  # h
        text = kernel.replace("TAU", f"{tau:.5g}")
        return law(self.accel, text, self.sign * 0.8 * self.strength), {"accel_temperature"}

    def warm_up_stretched(self):
        return self.warm_up(f"1-exp(-(t/TAU)**{self.uniform(0.9, 0.98):.3f})")

    def warm_up_two(self):
        w = self.uniform(0.05, 0.15)
        return self.warm_up(f"1-{1 - w:.3f}*exp(-t/TAU)-{w:.3f}*exp(-t/({self.uniform(0.2, 0.4):.3f}*TAU))")

    def g_sensitivity_saturating(self):
        force = self.r.choice([f for f in ("fx", "fy", "fz") if f[1] != self.letter])
        k = self.uniform(0.2, 0.4)
        text = f"tanh({k:.3f}*{force})/{math.tanh(k):.5f}"
        return law(self.gyro, text, self.sign * 0.0025 * self.strength), {"gyro_g_sensitivity"}

    def size_effect_bending(self):
        size = self.sign * 0.004 * self.strength  # cm
        # The arm gives way by some per cent with the attitude: its centripetal part, in ug for deg/s.
        others = [a for a in "xyz" if a != self.letter]
        per = -size * self.uniform(0.01, 0.04) * 0.01 * (math.pi / 180.0) ** 2 / 9.80665e-6
        bend = law(self.accel, f"(w{others[0]}**2+w{others[1]}**2)*sin(outer)", per)
        return effect("accel_size_effect", **{2 * self.letter: size}) + bend, {"accel_size_effect", "imu_lever_arm"}

    def asymmetry_power(self):
        ppm = 0.6 * min(self.strength, 200.0)
        p = self.uniform(0.97, 1.03)
        text = f"abs(w{self.letter})**{p:.4f}"
        return law(self.gyro, text, self.sign * ppm * 1e-6 * 3600.0 * 18.0 ** (1.0 - p)), {"gyro_scale_asymmetry"}

    def ramp_bending(self):
        # Of 25 minutes: a fifth of a hertz of none; 3 to 6 % of curvature.
        bend = self.uniform(0.1, 0.25)
        size = self.sign * 2.5 * min(self.strength, 200.0)
        return law(self.accel, f"t*(1+{bend:.3f}*t)", size), {"accel_bias_ramp", "accel_temperature"}


FORMS = [n for n, f in vars(Drawn).items() if callable(f) and not n.startswith("_") and n not in ("uniform", "creep", "warm_up")]


def config(rng):
    return (f"sample_rate_hz = 50\n[site]\nlatitude_deg = {rng.uniform(20, 60):.3f}\n[attitude]\nroll_deg = {rng.uniform(-4, 4):.3f}\n"
            f"pitch_deg = {rng.uniform(-4, 4):.3f}\nheading_deg = {rng.uniform(-180, 180):.2f}\n"
            "[gimbal]\npositioning_error_deg = 0.5\n[temperature]\nrecorded = false\n")


def record(selfcal, seed, form, number, exact, recording):
    """Simulates case `number` of `form` into `recording`. Returns what is true of it: strength, names that are right, the 24."""
    rng = random.Random(f"{seed}/{form}/{number}")
    drawn = Drawn(rng)
    physics, right = drawn.creep("exp(-since/TAU)") if exact else getattr(drawn, form)()
    stem = pathlib.Path(recording).with_suffix("")
    names = [stem.with_name(stem.name + suffix) for suffix in (".config.toml", ".physics.toml", ".truth.json")]
    names[0].write_text(config(rng))
    names[1].write_text(physics)
    subprocess.run([selfcal, "simulate", "--config", names[0], "--physics", names[1], "--schedule", "horizontal", "--dwell",
                    str(rng.randint(45, 90)), "--seed", str(rng.randint(1, 10**6)), "-o", recording, "--truth", names[2]], check=True,
                   stdout=subprocess.DEVNULL)
    truth = json.loads(names[2].read_text())
    return {"form": form, "number": number, "strength": drawn.strength, "right": sorted(right),
            "truth": {p["name"]: p["value"] for p in truth["parameters"]}}
