"""`selfcal monitor` on a terminal and `selfcal report` beside a live service, through a whole calibration."""
import json
import os
import re
import shutil
import subprocess
import time
import unittest

import case
from case import bench

COLUMNS, ROWS = 80, 24


def nearly(shown, value):
    """A number as printed with three digits: within half of the last one."""
    return abs(float(shown) - value) <= 0.00501 * abs(value)


@unittest.skipIf(shutil.which("tmux") is None, "tmux is missing")
class Monitor(case.OnBench):
    def tmux(self, *arguments):
        return subprocess.run(["tmux", "-L", f"selfcal-{os.getpid()}", "-f", "/dev/null", *arguments], check=True,
                              capture_output=True, text=True, env=os.environ | {"TMUX_TMPDIR": "/run"}).stdout

    def screen(self):
        lines = self.tmux("capture-pane", "-p", "-t", "view").split("\n")[:ROWS]
        for line in lines:
            self.assertLessEqual(len(line), COLUMNS)
        return lines

    def await_screen(self, wanted, what, timeout=120.0):
        """The first screen of which wanted(text) holds."""
        end = time.monotonic() + timeout
        while not wanted("\n".join(lines := self.screen())):
            if time.monotonic() > end:
                self.fail(f"{what}: the screen never shows it:\n" + "\n".join(lines))
            time.sleep(0.05)
        return "\n".join(lines)

    def begin_view(self):
        self.addCleanup(subprocess.run, ["tmux", "-L", f"selfcal-{os.getpid()}", "kill-server"], check=False,
                        capture_output=True, env=os.environ | {"TMUX_TMPDIR": "/run"})
        self.tmux("new-session", "-d", "-s", "view", "-x", str(COLUMNS), "-y", str(ROWS),
                  f"echo BEFORE; env NO_COLOR=1 '{bench.BIN}/selfcal' monitor; echo STATUS $?; stty -a; echo END; "
                  "sleep 600")

    def test_live_view_through_a_whole_run(self):
        # The clock of the INS goes on while a slow machine looks away: then the same again with a slower clock.
        for speed in (8.0, 2.0):
            unit = self.bench(speed=speed, ins={"running_estimate_s": 20.0}).start()
            self.begin_view()
            self.await_screen(lambda text: "selfcald" in text and "unit" in text, "the service")
            run = unit.start_run("--schedule", unit.short, "--force", "a short schedule")
            positions, document = self.watch(unit, run)
            if len(positions) >= 2:
                break
            self.tmux("kill-server")
            unit.stop()
        else:
            self.fail(f"at {speed:g} times real time only positions {positions} were seen")
        self.assertEqual(positions, sorted(positions), "the schedule goes forward")
        self.assertEqual(document["state"], "completed", document["reason"])
        self.compare_end(document)
        self.restored()
        self.pages(unit, run, document)

    def watch(self, unit, run):
        """Positions that the screen showed while the gimbal turned, in their order; the run's document."""
        positions = []
        while (document := unit.document(run))["exit_status"] is None:
            text = "\n".join(self.screen())
            rotating = re.search(rf"TEST-0001: rotating, run {run}", text)
            position = re.search(r"position ([1-9]) of 4,", text)   # 0: not, or no longer, in the schedule
            if rotating and position and int(position[1]) not in positions[-1:]:
                positions.append(int(position[1]))
            time.sleep(0.05)
        return positions, document

    def compare_end(self, document):
        """The last screen against the document that the service keeps."""
        parameters = document["result"]["parameters"]
        pages = re.compile(r"page (\d+) of (\d+), (\d+) written, 0 frames lost")
        text = self.await_screen(lambda shown: "0 runs in progress" in shown and "pass" in shown, "the end of the run")
        pulled = pages.search(text)
        self.assertIsNotNone(pulled, text)
        self.assertEqual(len(set(pulled.groups())), 1, text)
        self.assertIn("TEST-0001: idle, run 1", text)
        met = sum(p["sigma"] <= p["tolerance"] for p in parameters)
        self.assertIn(f"{met} of 24 within tolerance", text)
        # Two columns of twelve, in the order of the document: sigma, unit, bar, and "in" where it is within its tolerance.
        rows = [line for line in text.split("\n") if re.match(r"(accel|gyro) ", line)]
        self.assertEqual(len(rows), 12, text)
        for k, parameter in enumerate(parameters):
            cell = rows[k % 12][41 * (k // 12):][:41]
            words = re.match(r"(.{15}) *([-+.e\d]+) (\S+) *([#-]{5})( in)?", cell)
            self.assertIsNotNone(words, cell)
            self.assertTrue(nearly(words[2], parameter["sigma"]), f"{cell}: {parameter}")
            self.assertEqual(words[3], parameter["unit"], cell)
            self.assertEqual(words[5] is not None, parameter["sigma"] <= parameter["tolerance"], cell)

    def restored(self):
        self.tmux("send-keys", "-t", "view", "q")
        text = self.await_screen(lambda shown: "END" in shown, "the terminal given back")
        self.assertRegex(text, r"(?m)^BEFORE")
        self.assertRegex(text, r"(?m)^STATUS 0")
        self.assertRegex(text, r"(?m)(^|[ ;])icanon")
        self.assertRegex(text, r"(?m)(^|[ ;])echo($|[ ;])")

    def pages(self, unit, run, document):
        """The run by its number, and all units: what the service knows is on the page."""
        def on_page(*arguments):
            page = unit.folder / "page.html"
            unit.selfcal("report", *arguments, "-o", page, timeout=120)
            text = page.read_text(encoding="utf-8")
            self.assertLess(len(text), 3e6)
            return json.loads(re.search(r'<script[^>]*id="document"[^>]*>(.*?)</script>', text, re.S)[1])

        shown = on_page(run)
        for told, kept in zip(shown["parameters"], document["result"]["parameters"], strict=True):
            for key in ("name", "value", "sigma"):
                self.assertEqual(told[key], kept[key])
        self.assertIn("TEST-0001", json.dumps(on_page("--history")))


if __name__ == "__main__":
    unittest.main()
