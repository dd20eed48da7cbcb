"""`selfcal device check`: each deviation of a server is named by the requirement that it breaks, and nothing is named of a sound one."""
import concurrent.futures
import json
import os
import secrets
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path

import case
import profile_case

VIRTUAL = ("selfcal.toml", "example.toml", "memory.toml", "addresses.toml", "extended.toml", "mixed.toml")
ABOUT_TIME = ("timing.p2", "isotp.n_bs")  # what an INS fails that comes late
NOBODYS = "vcan0"  # where no INS is
PROFILES = profile_case.PROFILES
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
        for name, bus in (("extended", profile_case.EXTENDED), ("mixed", profile_case.MIXED)):
            (Path(cls.folder.name) / f"{name}.toml").write_text(profile_case.addressed(bus), encoding="utf-8")
        cls.children = {}  # process of each server in Python
        # All at once: each waits most of the time for what an INS must not do. One interpreter is all of them, by fork.
        names = sorted(p.name for p in Path("/sys/class/net").iterdir() if p.name.startswith("vcan") and p.name != NOBODYS)
        interfaces = iter(names)
        deviating_ins.Ins(cls.key.read_text(encoding="ascii").strip(), None).key_to(bytes(16))  # loads a library, once for all
        checks = [(name, next(interfaces), "example.toml") for name in [None, *deviating_ins.DEVIATIONS]]
        for name, interface, _ in checks:
            cls.fork_server(interface, name)
        for profile in VIRTUAL:
            checks.append((profile, next(interfaces), profile))
            cls.start_virtual_ins(checks[-1][1], profile)
        time.sleep(2.0)
        pool = concurrent.futures.ThreadPoolExecutor(len(checks))
        cls.addClassCleanup(pool.shutdown)
        cls.where = {name: (interface, profile) for name, interface, profile in checks}
        cls.found = {name: pool.submit(cls.check, *where) for name, where in cls.where.items()}

    @classmethod
    def path_of(cls, profile):
        return PROFILES / profile if (PROFILES / profile).exists() else Path(cls.folder.name) / profile

    @classmethod
    def fork_server(cls, interface, deviation):
        reader, writer = os.pipe()
        child = os.fork()
        if child == 0:
            os.dup2(writer, 1)
            sys.argv = [str(SERVER), interface, str(cls.key)] + ([deviation] if deviation else [])
            try:
                deviating_ins.main()
            finally:
                os._exit(1)
        cls.children[deviation] = child
        cls.addClassCleanup(os.waitpid, child, 0)
        cls.addClassCleanup(os.kill, child, signal.SIGKILL)
        os.close(writer)
        with os.fdopen(reader, encoding="ascii") as lines:
            if lines.readline() != "ready\n":
                raise AssertionError(f"{deviation}: no server")

    @classmethod
    def start_virtual_ins(cls, interface, profile):
        server = subprocess.Popen([case.bench.BIN / "sim_ins", "--interface", interface, "--key", cls.key, "--profile", cls.path_of(profile),
                                   "--flash", Path(cls.folder.name) / f"{profile}.flash"], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        cls.addClassCleanup(server.wait)
        cls.addClassCleanup(server.terminate)

    @classmethod
    def check(cls, interface, profile, *options):
        done = subprocess.run([case.bench.BIN / "selfcal", "device", "check", interface, "--profile", cls.path_of(profile),
                               "--key-file", cls.key, "--write", "--json", *options],
                              capture_output=True, text=True, timeout=150, check=False)
        if not done.stdout:
            raise AssertionError(done.stderr)
        faults = case.schema_validator.text_faults(done.stdout)
        document = json.loads(done.stdout)
        if faults or done.returncode != (1 if document["fails"] else 0):
            raise AssertionError(f"status {done.returncode}: {faults}")
        return document

    def judged_of_sound(self, name):
        """All at once on two processors and one disk, a sound INS may be late. Alone it must be in time."""
        document = self.found[name].result()
        if any(r["id"] in ABOUT_TIME and r["verdict"] == "fails" for r in document["requirements"]):
            concurrent.futures.wait(self.found.values())
            print(f"{name or 'the sound server'}: late beside {len(self.found) - 1} others; alone:", flush=True)
            document = self.check(*self.where[name])
        return document

    def failed_of(self, name, requirement):
        """What a deviating server fails. Where one answer comes seconds late, the ones behind it are taken for answers to something else:
        the deviation must be named alone then."""
        failed = {r["id"]: r for r in self.found[name].result()["requirements"] if r["verdict"] == "fails"}
        if requirement not in failed and any("answers something else" in r["came"] for r in failed.values()):
            concurrent.futures.wait(self.found.values())
            print(f"{name}: late beside {len(self.found) - 1} others; alone:", flush=True)
            failed = {r["id"]: r for r in self.check(*self.where[name])["requirements"] if r["verdict"] == "fails"}
        return failed

    def test_deviations(self):
        sound = self.judged_of_sound(None)
        self.assertEqual([r for r in sound["requirements"] if r["verdict"] != "holds"], [])
        named = 0
        for name, (what, requirement) in deviating_ins.DEVIATIONS.items():
            failed = self.failed_of(name, requirement)
            with self.subTest(name):
                self.assertIn(requirement, failed, f"{what}; named instead: {sorted(failed)}")
                r = failed[requirement]
                print(f"{name}: {what}. {r['id']} ({r['clause']}): sent {r['sent']}; expected {r['expected']}; "
                      f"came {r['came']}; {len(failed) - 1} others fail with it", flush=True)
                named += 1
        print(f"{named} of {len(deviating_ins.DEVIATIONS)} deviations named; the sound server: {sound['holds']} requirements hold, 0 fail", flush=True)
        self.assertGreaterEqual(len(deviating_ins.DEVIATIONS), 20)

    def test_the_virtual_ins_is_sound(self):
        """It shares no line with the server in Python; without a run it has no raw data to upload."""
        for profile in VIRTUAL:
            document = self.judged_of_sound(profile)
            rest = [r for r in document["requirements"] if r["verdict"] != "holds"]
            self.assertEqual([(r["id"], r["verdict"]) for r in rest], [("memory.page" if profile == "memory.toml" else "upload.begin", "not tried")], rest)
            self.assertEqual("isotp.address" in {r["id"] for r in document["requirements"]}, profile in ("extended.toml", "mixed.toml"))
            print(f"sim_ins under {profile}: {document['holds']} requirements hold, 0 fail", flush=True)

    def test_ends_where_an_ins_falls_silent(self):
        """Three sessions in a row without an answer are enough: what is behind them is not tried, and not waited for."""
        concurrent.futures.wait(self.found.values())
        pool = concurrent.futures.ThreadPoolExecutor(1)
        self.addCleanup(pool.shutdown)
        cut_off = pool.submit(self.check, *self.where["wrong_nrc"])
        time.sleep(3.0)  # a check of all requirements takes 20 s and more
        os.kill(self.children["wrong_nrc"], signal.SIGKILL)
        requirements = cut_off.result()["requirements"]
        silent = [r for r in requirements if "the INS fell silent after" in r.get("why", "")]
        self.assertTrue(any(r["verdict"] == "holds" for r in requirements))
        self.assertGreater(len(silent), 20)
        self.assertEqual({r["verdict"] for r in silent}, {"not tried"})
        print(f"an INS that falls silent: {len(silent)} requirements are not tried, {silent[0]['why']}", flush=True)

    def test_no_answer_is_an_error(self):
        done = subprocess.run([case.bench.BIN / "selfcal", "device", "check", NOBODYS], capture_output=True,
                              text=True, timeout=60, check=False)
        self.assertEqual((done.returncode, done.stdout), (case.DEVICE_TROUBLE, ""))
        self.assertRegex(done.stderr, f"{NOBODYS}: no answer")


if __name__ == "__main__":
    unittest.main()
