"""`selfcal device check`: each deviation of a server is named by the requirement that it breaks, and nothing is named of a sound one."""
import concurrent.futures
import json
import queue
import secrets
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import case

PROFILES = case.ROOT / "config" / "profiles"
SERVER = case.ROOT / "tests" / "foreign" / "deviating_ins.py"
sys.path.insert(0, str(SERVER.parent))

import deviating_ins  # noqa: E402


class DeviceCheck(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.folder = tempfile.TemporaryDirectory(prefix="selfcal_check.")
        cls.addClassCleanup(cls.folder.cleanup)
        cls.key = Path(cls.folder.name) / "ins.key"
        cls.key.touch(mode=0o600)
        cls.key.write_text(secrets.token_hex(16) + "\n", encoding="ascii")
        cls.interfaces = sorted(p.name for p in Path("/sys/class/net").iterdir() if p.name.startswith("vcan"))

    def check(self, interface, profile, *options):
        done = subprocess.run([case.bench.BIN / "selfcal", "device", "check", interface, "--profile", PROFILES / profile,
                               "--key-file", self.key, "--write", "--json", *options],
                              capture_output=True, text=True, timeout=150, check=False)
        if not done.stdout:
            raise AssertionError(done.stderr)
        faults = case.schema_validator.text_faults(done.stdout)
        self.assertFalse(faults, faults)
        document = json.loads(done.stdout)
        self.assertEqual(done.returncode, 1 if document["fails"] else 0)
        return document

    def start(self, command):
        server = subprocess.Popen([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        self.addCleanup(server.stdout.close)
        self.addCleanup(server.wait)
        self.addCleanup(server.terminate)
        return server

    def failing(self, deviation, free):
        interface = free.get()
        try:
            server = self.start([sys.executable, "-B", SERVER, interface, self.key] + ([deviation] if deviation else []))
            self.assertEqual(server.stdout.readline(), "ready\n")
            document = self.check(interface, "example.toml")
            server.terminate()
            server.wait()
            return document
        finally:
            free.put(interface)

    def test_deviations(self):
        free = queue.Queue()
        for interface in self.interfaces:
            free.put(interface)
        with concurrent.futures.ThreadPoolExecutor(len(self.interfaces)) as pool:
            found = {name: pool.submit(self.failing, name, free) for name in [None, *deviating_ins.DEVIATIONS]}
        sound = found.pop(None).result()
        self.assertEqual([r for r in sound["requirements"] if r["verdict"] != "holds"], [])
        named = 0
        for name, future in found.items():
            what, requirement = deviating_ins.DEVIATIONS[name]
            failed = {r["id"]: r for r in future.result()["requirements"] if r["verdict"] == "fails"}
            with self.subTest(name):
                self.assertIn(requirement, failed, f"{what}; named instead: {sorted(failed)}")
                r = failed[requirement]
                print(f"{name}: {what}. {r['id']} ({r['clause']}): sent {r['sent']}; expected {r['expected']}; "
                      f"came {r['came']}; {len(failed) - 1} others fail with it", flush=True)
                named += 1
        print(f"{named} of {len(found)} deviations named; the sound server: {sound['holds']} requirements hold, 0 fail", flush=True)
        self.assertGreaterEqual(len(found), 20)

    def test_the_virtual_ins_is_sound(self):
        """It shares no line with the server in Python; without a run it has no raw data to upload."""
        profiles = ("selfcal.toml", "example.toml", "memory.toml")
        for interface, profile in zip(self.interfaces, profiles):
            self.start([case.bench.BIN / "sim_ins", "--interface", interface, "--key", self.key, "--profile", PROFILES / profile,
                        "--flash", Path(self.folder.name) / f"{interface}.flash"])
        time.sleep(2.0)
        with concurrent.futures.ThreadPoolExecutor(len(profiles)) as pool:
            documents = list(pool.map(self.check, self.interfaces, profiles))
        for document, profile in zip(documents, profiles):
            rest = [r for r in document["requirements"] if r["verdict"] != "holds"]
            self.assertEqual([(r["id"], r["verdict"]) for r in rest], [("memory.page" if profile == "memory.toml" else "upload.begin", "not tried")], rest)
            print(f"sim_ins under {profile}: {document['holds']} requirements hold, 0 fail", flush=True)

    def test_no_answer_is_an_error(self):
        done = subprocess.run([case.bench.BIN / "selfcal", "device", "check", self.interfaces[-1]], capture_output=True,
                              text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stdout), (case.DEVICE_TROUBLE, ""))
        self.assertRegex(done.stderr, f"{self.interfaces[-1]}: no answer")


if __name__ == "__main__":
    unittest.main()
