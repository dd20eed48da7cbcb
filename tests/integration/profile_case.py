"""What the tests of profiles share: benches under a profile, with the virtual INS or with a server of somebody else's."""
import json
import math
import re
import subprocess
import sys
import time

import case

PROFILES = case.ROOT / "config" / "profiles"
FOREIGN = case.ROOT / "tests" / "foreign"
SPEED, DWELL_S = 60.0, 20.0
SLOW = 25.0  # what Python streams in frames beside everything else on one processor
# A server in Python, in a guest on a processor that others use too, may need seconds for an answer.
PATIENCE = {"request_timeout_s": 4.0, "lost_after_s": 12.0}
SITE = {"latitude_deg": 40.0, "longitude_deg": 116.0, "height_m": 50.0}  # the virtual INS's, which memory.toml, frames.toml and moves.toml do not tell
# What frames.toml says that one count is worth: 0.125e-6 rad, 2e-6 m/s.
FRAMES_COUNTS = {"gyro_lsb_arcsec": 0.125e-6 * 648000 / math.pi, "accel_lsb_m_per_s": 2e-6}
# The addressing of selfcal.toml, and others in its place.
NORMAL = """addressing = "normal"      # identifiers of 11 bits
request = 0x640
response = 0x648
functional = 0x7DF
"""
# As it is usual with extended addressing: requests to one and to all have one identifier.
EXTENDED = """addressing = "extended"
request = 0x6F1
response = 0x612
functional = 0x6F1
ins_address = 0x12
tester_address = 0xF1
functional_address = 0xDF
"""
MIXED = """addressing = "mixed-29"
ins_address = 0x2A
tester_address = 0xF1
address_extension = 0x5C
"""


STREAM = """[stream.sample.one]
id = 0x18FF1001
bytes = 8
signals.counter = { start = 0, length = 8 }
signals.delta_theta_x = { start = 8, length = 24, type = "signed" }
signals.delta_theta_y = { start = 32, length = 24, type = "signed" }
signals.temperature = { start = 56, length = 8, scale = 0.5, offset = -40.0, unit = "degC" }

[stream.sample.two]
id = 0x18FF1002
bytes = 7
signals.counter = { start = 7, length = 8, byte_order = "big" }
signals.delta_theta_z = { start = 15, length = 24, byte_order = "big", type = "signed" }
signals.delta_v_x = { start = 39, length = 24, byte_order = "big", type = "signed" }

[stream.sample.three]
id = 0x18FF1003
bytes = 7
signals.counter = { start = 0, length = 8 }
signals.delta_v_y = { start = 8, length = 24, type = "signed" }
signals.delta_v_z = { start = 32, length = 24, type = "signed" }

[stream.sample.gimbal]
id = 0x18FF1004
bytes = 7
signals.counter = { start = 0, length = 8 }
signals.outer = { start = 8, length = 24, type = "signed", scale = 1e-4, unit = "deg" }
signals.inner = { start = 32, length = 24, type = "signed", scale = 1e-4, unit = "deg" }

"""


def streaming(text):
    """A profile with its samples in frames while it turns: no pages, and no directory of them."""
    kept = (t for t in re.split(r"(?m)^(?=\[)", text) if not re.match(r"\[(upload|memory|page|directory)\]", t))
    return "\n".join(kept) + STREAM


def addressed(bus):
    """selfcal.toml with another addressing."""
    text = (PROFILES / "selfcal.toml").read_text(encoding="utf-8")
    if text.count(NORMAL) != 1:
        raise AssertionError("the addressing of selfcal.toml is another one")
    return text.replace(NORMAL, bus)


class UnderProfile(case.OnBench):
    def calibrate(self, unit):
        run = unit.wait_for_end(unit.start_run("--schedule", "horizontal", "--force", "short dwell"))
        self.assertEqual((run["state"], run["exit_status"]), ("completed", case.DONE), run["reason"])
        return run

    def bench_of(self, profile, speed=SPEED, interface="vcan0", sim=None, **ins):
        site = SITE if profile in ("memory.toml", "frames.toml", "moves.toml") else {}
        return self.bench(speed=speed, interface=interface, sim=sim or {}, sim_options=["--profile", PROFILES / profile],
                          ins={"dwell_s": DWELL_S, "profile": str(PROFILES / profile)} | site | ins)

    def assert_same(self, run, own, what):
        """To a tenth of sigma: the same sensor data through other bytes. What differs is the gimbal's read-out, rounded to
        20 arcseconds twice, and the time of a page's temperature."""
        largest = max(abs(a["value"] - b["value"]) / b["sigma"]
                      for a, b in zip(run["result"]["parameters"], own["result"]["parameters"], strict=True))
        print(f"{what} against our own INS: 24 values, largest difference {largest:.1e} sigma", flush=True)
        self.assertLess(largest, 0.1)

    def bench_with(self, server, profile, own, *more, start=True, speed=SPEED):
        """A bench on which a server of somebody else's is the INS, with the data of the virtual one."""
        unit = self.bench_of(profile, speed, **PATIENCE)
        recording = unit.folder / "direct.h5"
        unit.selfcal("simulate", "--config", unit.folder / "sim.toml", "--schedule", "horizontal", "--dwell", DWELL_S,
                     "--seed", unit.seed, "-o", recording)
        memory = unit.folder / "memory.json"
        log = open(unit.folder / "foreign.log", "wb")
        self.addCleanup(log.close)
        command = [sys.executable, "-B", FOREIGN / server, unit.interface, recording, *own(unit), speed, memory, *more]
        process = unit.foreign = subprocess.Popen([str(word) for word in command], stdout=log, stderr=log)
        self.addCleanup(process.wait)
        self.addCleanup(process.terminate)
        end = time.monotonic() + 60
        while not memory.exists() and time.monotonic() < end:
            time.sleep(0.1)
        if start:
            unit.start_daemon()
        return unit, memory

    def calibrate_or_tell(self, unit):
        try:
            return self.calibrate(unit)
        except BaseException:
            print((unit.folder / "foreign.log").read_text(encoding="utf-8"), flush=True)
            raise

    def loses_power(self, unit, memory, cuts_left, while_away=lambda: None):
        """A run in which the INS's power goes when part of the set is written: the old one is put back."""
        run = unit.start_run("--schedule", "horizontal", "--force", "short dwell")
        end = time.monotonic() + 200
        while json.loads(memory.read_text(encoding="ascii"))["cuts_left"] != cuts_left:
            self.assertLess(time.monotonic(), end, "its power did not go")
            time.sleep(0.02)
        while_away()
        failed = unit.wait_for_end(run)
        self.assertEqual((failed["state"], failed["exit_status"]), ("failed", case.DEVICE_TROUBLE), failed["reason"])
        told = [event["text"] for event in failed["events"] if "were put back" in event["text"]]
        self.assertTrue(told, failed["events"])
        print("then:", told[-1], flush=True)
        return failed
