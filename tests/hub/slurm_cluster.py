"""A Slurm cluster of a test's own: controller and nodes as processes on this machine, in a temporary folder, gone afterwards.

Nodes are slurmd with a name and a port each (-N), munged has a socket of its own: nothing of the machine's is used or changed."""
import getpass
import os
import secrets
import shutil
import signal
import socket
import subprocess
import tempfile
import time
from pathlib import Path

from cluster import free_port

PROGRAMS = ("munged", "slurmctld", "slurmd", "sbatch", "squeue")
CONF = """ClusterName=depot
SlurmctldHost={host}
SlurmctldAddr=127.0.0.1
SlurmUser={user}
SlurmdUser={user}
AuthType=auth/munge
AuthInfo=socket={folder}/munge.socket
CredType=cred/munge
StateSaveLocation={folder}/state
SlurmdSpoolDir={folder}/spool-%n
SlurmctldPidFile={folder}/ctld.pid
SlurmdPidFile={folder}/slurmd-%n.pid
SlurmctldLogFile={folder}/ctld.log
SlurmdLogFile={folder}/slurmd-%n.log
ProctrackType=proctrack/linuxproc
TaskPlugin=task/none
SelectType=select/cons_tres
SelectTypeParameters=CR_Core
SchedulerParameters=batch_sched_delay=0,bf_interval=5,sched_min_interval=100000
MpiDefault=none
ReturnToService=2
SlurmdTimeout=10
JobRequeue=1
KillWait=2
SlurmctldPort={port}
{nodes}
PartitionName=all Nodes=ALL Default=YES MaxTime=INFINITE State=UP
"""


def missing_programs():
    path = os.environ["PATH"] + ":/usr/sbin:/sbin"
    return [name for name in PROGRAMS if shutil.which(name, path=path) is None]


def command_line(process):
    try:
        return Path(f"/proc/{process}/cmdline").read_bytes().split(b"\0")
    except OSError:
        return []


def environment_of(process):
    try:
        return Path(f"/proc/{process}/environ").read_bytes().split(b"\0")
    except OSError:
        return []


def parent_of(process):
    try:
        return int(Path(f"/proc/{process}/stat").read_text(encoding="ascii", errors="replace").rsplit(")", 1)[1].split()[1])
    except OSError:
        return 0


def processes():
    return [int(path.name) for path in Path("/proc").iterdir() if path.name.isdigit()]


class SlurmCluster:
    def __init__(self, nodes=("w1", "w2"), preexec=None):
        if missing := missing_programs():
            raise SystemExit(f"{', '.join(missing)} not installed (config/packages.txt; tests/run installs them)")
        self.folder = Path(tempfile.mkdtemp(prefix="selfcal-slurm."))
        self.nodes, self.preexec, self.daemons = nodes, preexec, {}
        self.environment = os.environ | {"SLURM_CONF": str(self.folder / "slurm.conf"), "PATH": os.environ["PATH"] + ":/usr/sbin:/sbin"}

    def _start(self, name, *command):
        with open(self.folder / f"{name}.out", "ab") as output:
            self.daemons[name] = subprocess.Popen([str(word) for word in command], env=self.environment, stdin=subprocess.DEVNULL, stdout=output,
                                                  stderr=output, preexec_fn=self.preexec, cwd=self.folder)

    def __enter__(self):
        host = socket.gethostname().split(".")[0]
        nodes = "\n".join(f"NodeName={name} NodeHostname={host} NodeAddr=127.0.0.1 Port={free_port()} CPUs=1 RealMemory=500" for name in self.nodes)
        (self.folder / "state").mkdir()
        (self.folder / "slurm.conf").write_text(CONF.format(host=host, user=getpass.getuser(), folder=self.folder, port=free_port(), nodes=nodes),
                                                encoding="ascii")
        key = self.folder / "munge.key"
        key.write_bytes(secrets.token_bytes(1024))
        key.chmod(0o400)
        # Clients come by the socket, so its folder lets them in; --force takes a temporary folder for its home.
        self._start("munged", "munged", "--foreground", "--force", f"--key-file={key}", f"--socket={self.folder}/munge.socket",
                    f"--pid-file={self.folder}/munged.pid", f"--seed-file={self.folder}/munged.seed", f"--log-file={self.folder}/munged.log")
        self._wait(lambda: (self.folder / "munge.socket").exists(), "munged")
        self._start("slurmctld", "slurmctld", "-D", "-f", self.folder / "slurm.conf")
        for name in self.nodes:
            self.start_node(name)
        self._wait(lambda: self.ask("sinfo", "-h", "-o", "%T").split() == ["idle"], "the cluster's nodes")
        return self

    def _wait(self, ready, what, limit_s=60):
        end = time.monotonic() + limit_s
        while not ready():
            if time.monotonic() > end:
                logs = "\n".join(path.read_text(errors="replace")[-800:] for path in sorted(self.folder.glob("*.log")))
                self.__exit__()
                raise SystemExit(f"{what}: not there after {limit_s} s\n{logs}")
            time.sleep(0.2)

    def __exit__(self, *_):
        for job in self.own("slurmstepd") + [p for p in processes() if f"SLURM_CONF={self.folder}/slurm.conf".encode() in environment_of(p) and
                                             any(word.startswith(b"SLURM_JOB_ID=") for word in environment_of(p))]:
            self._kill(job)
        for daemon in self.daemons.values():
            daemon.kill()
            daemon.wait()
        shutil.rmtree(self.folder, ignore_errors=True)

    def own(self, name):
        """Processes of this cluster called so, by the configuration in their environment."""
        mark = f"SLURM_CONF={self.folder}/slurm.conf".encode()
        return [p for p in processes() if (words := command_line(p)) and name.encode() in words[0] and mark in environment_of(p)]

    @staticmethod
    def _kill(process):
        try:
            os.kill(process, signal.SIGKILL)
        except ProcessLookupError:
            pass

    def ask(self, *command):
        return subprocess.run(command, env=self.environment, capture_output=True, text=True, check=False).stdout

    def start_node(self, name):
        self._start(name, "slurmd", "-D", "-N", name, "-f", self.folder / "slurm.conf")

    def workers(self, node=None):
        """Processes of `selfcal batch work` in jobs of this cluster, of one node or all."""
        mark = f"SLURM_CONF={self.folder}/slurm.conf".encode()
        of_node = None if node is None else f"SLURMD_NODENAME={node}".encode()
        found = []
        for process in processes():
            words = command_line(process)
            if b"batch" in words and b"work" in words:
                environment = environment_of(process)
                if mark in environment and (of_node is None or of_node in environment):
                    found.append(process)
        return found

    def kill_worker(self, draw):
        """One of the workers that run, at random; whether there was one."""
        workers = self.workers()
        if workers:
            self._kill(draw.choice(workers))
        return bool(workers)

    def kill_node(self, name):
        """As by a power cut: its daemon, its job steps and what they run."""
        steps = []
        for worker in self.workers(name):   # up to the job's slurmstepd
            process = worker
            while process > 1 and process != self.daemons[name].pid and process not in steps:
                steps.append(process)
                process = parent_of(process)
        self.daemons[name].kill()
        for process in reversed(steps):
            self._kill(process)
        self.daemons.pop(name).wait()
