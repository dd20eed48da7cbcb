"""What the integration tests share: a bench in a folder of its own for each test, and what must hold after any
failure. Run inside tools/vcan_run and tools/private_bus; tests/integration/CMakeLists.txt does that."""
import os
import shutil
import sys
import tempfile
import unittest
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
sys.path[:0] = [str(ROOT / "tools" / "bench"), str(ROOT / "tests" / "documents")]

import bench  # noqa: E402
import schema_validator  # noqa: E402
import witness  # noqa: E402

# In a guest each page of memory that a program touches for the first time is several turns between the guest's kernel and its
# processes (tools/uml/guest). The C library keeps what is freed, so that a diagnosis asks for its memory once.
if os.environ.get("VCAN_RUN") == "uml":
    os.environ |= {"MALLOC_MMAP_THRESHOLD_": str(32 << 20), "MALLOC_TRIM_THRESHOLD_": str(1 << 30)}

# Where numbers do not matter: four positions, 75 s of the INS's clock at 50 Hz; the
# estimator refuses less than 60 s.
SHORT_SCHEDULE = """positions = [[0, 0], [90, 0], [90, 90], [0, 90]]
dwell_s = 15.0
rotation_s = 5.0
"""
SHORT_S = 4 * 15.0 + 3 * 5.0

DONE, ANSWER_IS_NO, USAGE, BAD_INPUT, DEVICE_TROUBLE = 0, 1, 2, 3, 4


class ValidatingBench(bench.Bench):
    """Every JSON document that a test asks for follows its schema."""

    def selfcal(self, *arguments, **more):
        done = super().selfcal(*arguments, **more)
        if "--json" in arguments and done.stdout:
            faults = schema_validator.text_faults(done.stdout)
            if faults:
                raise AssertionError(f"selfcal {' '.join(map(str, arguments))}: " + "; ".join(faults))
        return done


class OnBench(unittest.TestCase):
    maxDiff = None

    def bench(self, **settings):
        folder = Path(tempfile.mkdtemp(prefix="selfcal_test."))
        self.addCleanup(shutil.rmtree, folder, ignore_errors=True)
        sim = {"serial": "TEST-0001", "sample_rate_hz": 50.0} | settings.pop("sim", {})
        ins = {"drift_check_s": 0.0, "lost_after_s": 5.0} | settings.pop("ins", {})
        unit = ValidatingBench(folder, speed=settings.pop("speed", 20.0), sim=sim, ins=ins, **settings)
        (unit.folder / "short.toml").write_text(SHORT_SCHEDULE, encoding="ascii")
        unit.short = unit.folder / "short.toml"
        self.addCleanup(unit.stop)
        return unit

    def assert_one_line(self, text, *words):
        """An error is one line that names the matter."""
        lines = [line for line in text.strip().splitlines() if line]
        self.assertEqual(len(lines), 1, text)
        for word in words:
            self.assertRegex(lines[0].lower(), word)
        print(f"{self._testMethodName}: {lines[0]}", flush=True)

    def assert_old_coefficients(self, unit):
        """The factory's set, version 0, is what a virtual INS has from birth."""
        version, values = witness.coefficients_in_force(unit.interface)
        self.assertEqual(version, 0)
        self.assertEqual(set(values.values()), {0.0})
