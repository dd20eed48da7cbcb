"""A bench to run the real programs on: virtual INS, service and operator's program on one CAN interface.

Used by tools/demo and by tests/integration, inside tools/vcan_run and tools/private_bus. Everything it starts ends
with it; everything it writes lies in its own folder.
"""
import json
import os
import secrets
import signal
import subprocess
import time
from pathlib import Path

import dbus
import freshness
import service_bus

ROOT = Path(__file__).resolve().parents[2]
BIN = Path(os.environ.get("SELFCAL_BIN", ROOT / "build" / "bin"))
freshness.warn_if_old(BIN, "selfcald", "sim_ins", "selfcal")

# The paper's Table 3, in the names and units of the interfaces.
TABLE3 = (
    {f"accel_bias_{a}": 100.0 for a in "xyz"}
    | {f"gyro_drift_{a}": 0.01 for a in "xyz"}
    | {f"accel_scale_pos_{a}": 100.0 for a in "xyz"}
    | {f"accel_scale_neg_{a}": -100.0 for a in "xyz"}
    | {f"accel_misalignment_{p}": 30.0 for p in ("yx", "zx", "zy")}
    | {f"gyro_scale_{a}": 30.0 for a in "xyz"}
    | {f"gyro_misalignment_{p}": 30.0 for p in ("xy", "xz", "yx", "yz", "zx", "zy")}
)


def toml(value):
    """A value, or a table of plain values, as TOML."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value)
    if isinstance(value, (list, tuple)):
        return "[" + ", ".join(toml(v) for v in value) + "]"
    return repr(value)


def toml_section(name, entries):
    lines = [f"[{name}]"] if name else []
    return "\n".join(lines + [f"{key} = {toml(value)}" for key, value in entries.items()]) + "\n"


class Bench:
    """sim: sections of sim.toml as nested dicts. ins: keys of the INS's section in selfcald.toml. sim_options: further
    command-line arguments of sim_ins."""

    def __init__(self, folder, *, interface="vcan0", name="unit", speed=100.0, seed=1, sim=None, ins=None,
                 daemon=None, sim_options=()):
        self.folder = Path(folder)
        self.folder.mkdir(parents=True, exist_ok=True)
        self.interface, self.name, self.speed, self.seed = interface, name, speed, seed
        self.sim_options = list(sim_options)
        self.sim_process = self.daemon_process = self.service_bus = None
        self.truth_file = self.folder / "truth.json"
        self.key_file = self.folder / "ins.key"
        self.key_file.touch(mode=0o600)
        self.key_file.write_text(secrets.token_hex(16) + "\n", encoding="ascii")
        self.ins_keys = {"interface": interface, "key_file": str(self.key_file), "time_scale": speed} | (ins or {})
        self.write_sim_config(sim or {})
        self.write_daemon_config([self], daemon or {})

    # --- configuration ---------------------------------------------------------------------------------------
    def write_sim_config(self, sections):
        plain = {k: v for k, v in sections.items() if not isinstance(v, dict)}
        text = toml_section("", plain)
        for name, entries in sections.items():
            if isinstance(entries, dict):
                text += toml_section(name, entries)
        (self.folder / "sim.toml").write_text(text, encoding="utf-8")

    def write_daemon_config(self, benches, daemon):
        """The service of this bench serves the INS of all `benches`."""
        service = {"state_directory": str(self.folder / "state"), "bus": "system"} | daemon
        text = toml_section("daemon", service)
        for one in benches:
            text += toml_section(f"ins.{one.name}", one.ins_keys)
        (self.folder / "selfcald.toml").write_text(text, encoding="utf-8")

    # --- programs --------------------------------------------------------------------------------------------
    def _spawn(self, name, arguments):
        with open(self.folder / f"{name}.log", "ab") as log:
            return subprocess.Popen([str(a) for a in arguments], stdin=subprocess.DEVNULL, stdout=log, stderr=log)

    def log(self, name):
        return (self.folder / f"{name}.log").read_text(encoding="utf-8", errors="replace")

    def start_ins(self, *more):
        self.sim_process = self._spawn("sim_ins", [
            BIN / "sim_ins", "--interface", self.interface, "--config", self.folder / "sim.toml",
            "--seed", self.seed, "--key", self.key_file, "--flash", self.folder / "flash.bin",
            "--truth", self.truth_file, "--speed", self.speed, *self.sim_options, *more])
        self._wait_for(lambda: self.truth_file.exists(), self.sim_process, "sim_ins")

    def spawn_daemon(self):
        self.daemon_process = self._spawn("selfcald", [BIN / "selfcald", "--config", self.folder / "selfcald.toml"])

    def start_daemon(self):
        self.spawn_daemon()
        self._wait_for(lambda: self.of_service_bus(lambda bus: bus.has_service(), True) and
                       self.selfcal("status", "--json", check=False).returncode == 0, self.daemon_process, "selfcald")

    def _wait_for(self, ready, process, name, seconds=120.0):
        end = time.monotonic() + seconds
        while not ready():
            if process.poll() is not None:
                raise RuntimeError(f"{name} ended with status {process.returncode}:\n{self.log(name)}")
            if time.monotonic() > end:
                raise RuntimeError(f"{name} not ready after {seconds:g} s:\n{self.log(name)}")
            time.sleep(0.05)

    def start(self):
        self.start_ins()
        self.start_daemon()
        return self

    @staticmethod
    def _end(process, how):
        if process is not None and process.poll() is None:
            process.send_signal(how)
            try:
                process.wait(10)
            except subprocess.TimeoutExpired:
                process.kill()
                process.wait()

    def kill_ins(self):
        self._end(self.sim_process, signal.SIGKILL)

    def kill_daemon(self):
        self._end(self.daemon_process, signal.SIGKILL)

    def end_daemon(self):
        self._end(self.daemon_process, signal.SIGTERM)

    def stop(self):
        self.leave_service_bus()
        self.end_daemon()
        self._end(self.sim_process, signal.SIGTERM)

    def __enter__(self):
        return self.start()

    def __exit__(self, *_):
        self.stop()

    # --- the operator's program --------------------------------------------------------------------------------
    def selfcal(self, *arguments, check=True, timeout=180, **more):
        done = subprocess.run([str(BIN / "selfcal"), *map(str, arguments)], capture_output=True, text=True,
                              stdin=subprocess.DEVNULL, timeout=timeout, check=False, **more)
        if check and done.returncode != 0:
            raise RuntimeError(f"selfcal {' '.join(map(str, arguments))}: status {done.returncode}\n{done.stderr}")
        return done

    def start_run(self, *options):
        """Begins a run and returns its number."""
        return json.loads(self.selfcal("run", self.name, "--detach", "--json", *options).stdout)["run"]

    def document(self, run):
        return json.loads(self.selfcal("show", run, "--json").stdout)

    def status(self):
        return json.loads(self.selfcal("status", self.name, "--json").stdout)["instruments"][0]

    def wait_until(self, condition, what, timeout=60.0):
        """Polls `condition(self.status())`."""
        end = time.monotonic() + timeout
        while not condition(seen := self.status()):
            if time.monotonic() > end:
                raise RuntimeError(f"{what}: not within {timeout:g} s; last status {seen}")
            time.sleep(0.05)
        return seen

    def wait_for_end(self, run, timeout=300.0):
        """The run's document, as `selfcal show` has it in the beginning and in the end; between, the service itself is asked."""
        end = time.monotonic() + timeout
        document = self.document(run)
        while document["exit_status"] is None:
            if time.monotonic() > end:
                raise RuntimeError(f"run {run} has not ended within {timeout:g} s; state {document['state']}")
            time.sleep(0.1)
            document = self.document_of_service(run) or self.document(run)
        return self.document(run)

    def document_of_service(self, run):
        """None where the service does not answer."""
        return self.of_service_bus(lambda bus: bus.document(run), None)

    def of_service_bus(self, question, unknown):
        """`unknown` where there is no bus to be asked."""
        try:
            self.service_bus = self.service_bus or service_bus.ServiceBus()
            return question(self.service_bus)
        except dbus.DBusException:
            self.leave_service_bus()
            return unknown

    def leave_service_bus(self):
        if self.service_bus is not None:
            self.service_bus.close()
            self.service_bus = None

    def truth(self):
        return {p["name"]: p["value"] for p in json.loads(self.truth_file.read_text(encoding="utf-8"))["parameters"]}
