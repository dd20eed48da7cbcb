"""What the tests of profiles share: benches under a profile, with the virtual INS or with a server of somebody else's."""
import subprocess
import sys
import time

import case

PROFILES = case.ROOT / "config" / "profiles"
FOREIGN = case.ROOT / "tests" / "foreign"
SPEED, DWELL_S = 60.0, 20.0
SLOW = 25.0  # what Python streams in frames beside everything else on one processor
SITE = {"latitude_deg": 40.0, "longitude_deg": 116.0, "height_m": 50.0}  # the virtual INS's, which memory.toml, frames.toml and moves.toml do not tell
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
        unit = self.bench_of(profile, speed)
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
