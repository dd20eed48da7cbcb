"""`selfcal run` and `selfcal show` on a terminal of 80 x 24: the progress line stays one line, whatever the width, and
the verdict stands on the screen at the end, for a run that completes, one refused and one interrupted."""
import os
import shutil
import signal
import subprocess
import time
import unittest

import case
from case import bench

COLUMNS, ROWS = 80, 24


class Terminal:
    """A pane of tmux in which one command runs after another."""

    def __init__(self, columns=COLUMNS, rows=ROWS):
        self.socket = f"selfcal-terminal-{os.getpid()}-{id(self)}"
        self.tmux("-f", "/dev/null", "new-session", "-d", "-s", "t", "-x", str(columns), "-y", str(rows),
                  "env PS1='$ ' bash --norc --noprofile")

    def tmux(self, *arguments):
        return subprocess.run(["tmux", "-L", self.socket, *arguments], capture_output=True, text=True, check=True,
                              timeout=30).stdout

    def close(self):
        subprocess.run(["tmux", "-L", self.socket, "kill-server"], capture_output=True, check=False, timeout=30)

    def type(self, command):
        self.tmux("send-keys", "-t", "t", "-l", str(command))
        self.tmux("send-keys", "-t", "t", "Enter")

    def screen(self, history=False):
        """The visible rows; with `history` all that was ever written."""
        text = self.tmux("capture-pane", "-p", "-t", "t", *(["-S", "-"] if history else []))
        return [line.rstrip() for line in text.splitlines()]

    def await_text(self, wanted, timeout=240.0):
        end = time.monotonic() + timeout
        while True:
            rows = self.screen()
            if any(wanted in row for row in rows):
                return rows
            if time.monotonic() > end:
                raise AssertionError(f"the screen never shows {wanted!r}; it holds:\n" + "\n".join(rows))
            time.sleep(0.1)


@unittest.skipIf(shutil.which("tmux") is None, "tmux is missing")
class OnTheScreen(case.OnBench):
    def terminal(self):
        terminal = Terminal()
        self.addCleanup(terminal.close)
        return terminal

    def run_in(self, terminal, *arguments):
        terminal.type(" ".join([str(bench.BIN / "selfcal"), *map(str, arguments), ";", "echo", "STATUS-$?-END"]))

    def assert_ending(self, terminal, status, *words):
        """Six lines at most with verdict, cause and next step, the last before the status; nothing stale above them."""
        rows = terminal.await_text(f"STATUS-{status}-END")
        for row in rows:
            self.assertLessEqual(len(row), COLUMNS)
        end = max(i for i, row in enumerate(rows) if row.startswith("STATUS-"))
        begin = max(i for i in range(end) if rows[i].startswith("verdict"))
        summary = rows[begin:end]
        self.assertLessEqual(len(summary), 6, rows)
        for head in ("verdict  ", "cause    ", "next     "):
            self.assertEqual(sum(row.startswith(head) for row in summary), 1, summary)
        for row in summary:
            self.assertTrue(row.startswith(("verdict  ", "cause    ", "next     ", " " * 9)), summary)
        for word in words:
            self.assertIn(word, " ".join(row[9:] for row in summary))
        # The progress line was wiped: no part of it is left, not even in what has scrolled away.
        for row in terminal.screen(history=True):
            self.assertNotRegex(row, r"^run \d+: |position \d+ of|page \d+ of| left, ")
        print(f"{self._testMethodName}:", *summary, sep="\n  ", flush=True)

    def test_completed_then_shown(self):
        unit = self.bench(speed=10.0).start()
        terminal = self.terminal()
        self.run_in(terminal, "run", unit.name, "--schedule", unit.short, "--force", "trial")
        # While it runs the line is one line; narrowed in the midst of it, too.
        rows = terminal.await_text("position ")
        self.assertEqual(sum("run 1:" in row for row in rows), 1, rows)
        # A terminal folds its rows before it tells a program its width (tmux: up to 250 ms). What is drawn between the two stays, so
        # that there must be no news then.
        unit.daemon_process.send_signal(signal.SIGSTOP)
        time.sleep(0.2)
        terminal.tmux("resize-window", "-t", "t", "-x", "40", "-y", str(ROWS))
        time.sleep(0.5)
        unit.daemon_process.send_signal(signal.SIGCONT)
        time.sleep(1.5)
        rows = [row for row in terminal.screen() if row]
        self.assertEqual(sum(row.startswith("run 1:") for row in rows), 1, rows)
        self.assertLessEqual(sum("left" in row for row in rows), 1, rows)
        terminal.tmux("resize-window", "-t", "t", "-x", str(COLUMNS), "-y", str(ROWS))
        self.assert_ending(terminal, case.DONE, "in force", "trial")

        # What the screen holds after `show` ends with the same verdict, however long the text above it is.
        self.run_in(terminal, "show", 1)
        time.sleep(0.5)
        rows = terminal.await_text("STATUS-0-END")
        tail = [row for row in rows if row]
        self.assertTrue(any(row.startswith("verdict  ") for row in tail[-8:]), tail)

    def test_refused(self):
        """75 s of data determine next to nothing."""
        unit = self.bench(speed=20.0).start()
        terminal = self.terminal()
        self.run_in(terminal, "run", unit.name, "--schedule", unit.short)
        self.assert_ending(terminal, case.ANSWER_IS_NO, "Not written", "selfcal ")
        self.assert_old_coefficients(unit)

    def test_interrupted(self):
        unit = self.bench(speed=5.0).start()
        terminal = self.terminal()
        self.run_in(terminal, "run", unit.name, "--schedule", unit.short)
        terminal.await_text("position ")
        terminal.tmux("send-keys", "-t", "t", "C-c")
        self.assert_ending(terminal, case.ANSWER_IS_NO, "stopped", "interrupted", f"selfcal run {unit.name}")
        rows = terminal.screen()
        self.assertIn("stopping run 1 safely", rows)  # alone in its row
        self.assert_old_coefficients(unit)


if __name__ == "__main__":
    unittest.main()
