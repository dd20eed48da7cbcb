"""What is concealed: an output of one axis over the time, in ug or deg/h. Expressions in the variables of laws, and mechanisms with a memory
that no expression is."""
import numpy

NAMES = {name: getattr(numpy, name) for name in ("sin", "cos", "exp", "log", "sqrt", "abs", "sign", "tanh")} | {"pi": numpy.pi}


def value(expression, known):
    with numpy.errstate(over="ignore"):
        return eval(expression, {"__builtins__": {}}, NAMES | known) * numpy.ones_like(known["t"])  # of our own or of selfcal's


def settled(known, tau_s, source):
    """The source through a first-order lag."""
    step = 3600.0 * (known["t"][1] - known["t"][0])
    kept, state, out = numpy.exp(-step / tau_s), source[0], numpy.empty_like(source)
    for k, now in enumerate(source):
        state = kept * state + (1.0 - kept) * now
        out[k] = state
    return out


def expression(random):
    def uniform(low, high):
        return f"{numpy.exp(random.uniform(numpy.log(low), numpy.log(high))):.4g}"

    quantities = ["fx", "fy", "fz", "wx", "wy", "wz", "sin(outer)", "cos(outer)", "sin(inner)", "cos(inner)", "so", "si", "t", "fx**2",
                  "abs(fy)", "wz**2", "cos(2*outer)", "T"]
    kernels = [f"exp(-since/{uniform(10, 120)})", f"exp(-rest/{uniform(10, 60)})", f"log(1+rest/{uniform(3, 40)})*abs(sign(n))",
               f"exp(-t/{uniform(0.08, 0.4)})", f"sin(2*pi*t/{uniform(0.15, 0.9)}+{random.uniform(-3, 3):.3g})",
               f"sign(t-{uniform(0.1, 0.5)})"]
    one, two = random.choice(quantities, 2, replace=False)
    form = random.uniform()
    return f"{one}*{two}" if form < 0.4 else str(random.choice(kernels)) if form < 0.65 else f"{random.choice(kernels)}*{one}"


def mechanism(random):
    """Its words, and a function of what laws may depend on."""
    kind = random.choice(["heat", "anelastic", "stick", "window", "offsets"])
    if kind == "heat":  # the motors warm the block with each turn, and it cools
        tau = random.uniform(100, 500)
        return f"heat of turning, tau {tau:.0f} s", lambda k: settled(k, tau, numpy.abs(k["wo"]) + numpy.abs(k["wi"]))
    if kind == "anelastic":  # a suspension follows its load late
        tau, axis = random.uniform(15, 90), random.choice(["fx", "fy", "fz"])
        return f"lag behind {axis}, tau {tau:.0f} s", lambda k: settled(k, tau, k[axis]) - k[axis]
    if kind == "stick":  # where it came from decides where it stays
        return "side of the last change of fx", lambda k: numpy.sign(settled(k, 20.0, k["fx"]) - settled(k, 2000.0, k["fx"]))
    if kind == "window":
        start = random.uniform(0.1, 0.4)
        return f"from {start:.2f} h on, for 0.15 h", lambda k: ((k["t"] > start) & (k["t"] < start + 0.15)) * 1.0
    seed = int(random.integers(1 << 30))
    return "an offset drawn at each turn", lambda k: numpy.random.default_rng(seed).normal(0, 1, 99)[k["n"].astype(int)]


def per_turn(known, source):
    """The integral over the time in s of a source that acts in turns, over the turn that has last begun; 0 before the first."""
    number, step = known["n"].astype(int), 3600.0 * (known["t"][1] - known["t"][0])
    return (numpy.bincount(number, weights=source * step) * (numpy.arange(number.max() + 1) > 0))[number]


def other_mechanism(random):
    """The same, of other kinds: what no list that selfcal has names."""
    kind = random.choice(["deadband", "ripple", "late heat", "by the angle", "rectified", "rub", "sticks and slips", "overload"])
    axis, angle = random.choice(["fx", "fy", "fz"]), random.choice(["outer", "inner"])
    if kind == "deadband":  # nothing comes out below a threshold
        width = random.uniform(0.05, 0.3)
        return f"{axis} clipped at {width:.2f} g", lambda k: -numpy.clip(k[axis], -width, width)
    if kind == "ripple":  # of a bearing
        times, phase = int(random.integers(5, 10)), random.uniform(-3, 3)
        return f"sin({times} {angle})", lambda k: numpy.sin(times * k[angle] + phase)
    if kind == "late heat":  # inside, the temperature of the case arrives late
        tau = random.uniform(100, 400)
        return f"T behind itself, tau {tau:.0f} s", lambda k: settled(k, tau, k["T"]) - k["T"]
    if kind == "by the angle":
        tau, rate = random.uniform(15, 80), {"outer": "wo", "inner": "wi"}[angle]
        return f"creep by the last turn of {angle}, tau {tau:.0f} s", lambda k: per_turn(k, k[rate]) * numpy.exp(-k["since"] / tau)
    if kind == "rectified":  # vibration of the drive
        return "square of the gimbal's rates, 2 s late", lambda k: settled(k, 2.0, k["wo"] ** 2 + k["wi"] ** 2)
    if kind == "rub":  # begins, and grows
        start = random.uniform(0.1, 0.4)
        return f"root of the time from {start:.2f} h on", lambda k: numpy.sqrt(numpy.maximum(0.0, k["t"] - start))
    if kind == "sticks and slips":  # a tilt that goes back in two jumps
        first, second = sorted(random.uniform(5, 50, 2))
        return f"{axis} until {first:.0f} s, half until {second:.0f} s", lambda k: k[axis] * ((k["rest"] < first) + (k["rest"] < second)) / 2
    return f"{axis}^3 over its own fourth power", lambda k: k[axis] ** 3 / (1.0 + k[axis] ** 4)


def beside_the_24(signal, known, axis):
    """What the parameters of this axis cannot take."""
    if axis.startswith("accel"):
        own = known["f" + axis[-1]]
        columns = [numpy.maximum(own, 0), numpy.maximum(-own, 0), known["fx"], known["fy"], known["fz"]]
    else:
        columns = [known["wx"], known["wy"], known["wz"]]
    A = numpy.stack([numpy.ones_like(signal), *columns], axis=1)
    return signal - A @ numpy.linalg.lstsq(A, signal, rcond=None)[0]
