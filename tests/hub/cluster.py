"""A PostgreSQL of a test's own: a cluster in a temporary folder, TLS with a certificate of its own, gone afterwards.

Sets log in by TCP with TLS and SCRAM, as at a depot; the owner comes by the Unix socket. PostgreSQL refuses to run as root, so
root starts it as user postgres."""
import os
import shutil
import socket
import subprocess
import tempfile
import time
from pathlib import Path

OWNER = "postgres"


def programs():
    """The folder of initdb and pg_ctl: Debian keeps them off the path, one folder for each version."""
    found = sorted(Path("/usr/lib/postgresql").glob("*/bin/initdb"), key=lambda path: int(path.parts[-3]))
    if not found:
        raise SystemExit("PostgreSQL is not installed (config/packages.txt; tests/run installs it)")
    return found[-1].parent


def free_port():
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        return listener.getsockname()[1]


class Cluster:
    def __init__(self, options="", address="127.0.0.1"):
        self.folder = Path(tempfile.mkdtemp(prefix="selfcal-hub."))
        self.folder.chmod(0o755)   # the socket is everybody's, the data are not
        self.port, self.options, self.address, self.bin = free_port(), options, address, programs()
        self.data = self.folder / "data"
        self.as_owner = []
        if os.geteuid() == 0:
            shutil.chown(self.folder, OWNER, OWNER)
            self.as_owner = ["runuser", "-u", OWNER, "--"]
        self.user = OWNER

    def run(self, *command, check=True, **more):
        return subprocess.run([*self.as_owner, *map(str, command)], cwd=self.folder, check=check, capture_output=True, text=True,
                              **more)

    def __enter__(self):
        try:
            self.run(self.bin / "initdb", "-D", self.data, "-A", "trust", "-U", OWNER, "--no-sync", "-E", "UTF8", "--locale=C")
            self.run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-days", "2", "-subj", "/CN=localhost", "-addext",
                     "subjectAltName=DNS:localhost,IP:127.0.0.1", "-keyout", self.data / "server.key", "-out", self.data / "server.crt")
            shutil.copy(self.data / "server.crt", self.folder / "root.crt")
            (self.folder / "root.crt").chmod(0o644)
            (self.data / "server.key").chmod(0o600)
            (self.data / "pg_hba.conf").write_text(f"local all {OWNER} trust\nlocal all all scram-sha-256\n"
                                                   f"hostssl all all {self.address}/24 scram-sha-256\n", encoding="ascii")
            self.start()
            self.run(self.bin / "createdb", "-h", self.folder, "-p", str(self.port), "-U", OWNER, "selfcal")
        except subprocess.CalledProcessError as error:
            self.__exit__()
            raise SystemExit(f"{error.cmd}: {error.stdout}{error.stderr}") from error
        return self

    def __exit__(self, *_):
        self.run(self.bin / "pg_ctl", "-D", self.data, "-m", "immediate", "stop", check=False)
        shutil.rmtree(self.folder, ignore_errors=True)

    def start(self):
        words = f"-k {self.folder} -p {self.port} -c listen_addresses={self.address} -c ssl=on -c max_connections=80 {self.options}"
        self.run(self.bin / "pg_ctl", "-D", self.data, "-o", words, "-l", self.folder / "log", "-w", "-t", "60", "start")

    def stop(self, mode="fast"):
        self.run(self.bin / "pg_ctl", "-D", self.data, "-m", mode, "-w", "stop")

    def kill(self):
        """As by a power cut, and back: what was committed must be there."""
        self.stop("immediate")
        time.sleep(0.2)
        self.start()

    @property
    def owner(self):
        return f"host={self.folder} port={self.port} dbname=selfcal user={OWNER}"

    def by_tls(self, role, password, root="root.crt", mode="verify-full"):
        return (f"host=localhost hostaddr={self.address} port={self.port} dbname=selfcal user={role} password={password} sslmode={mode} "
                f"sslrootcert={self.folder / root}")

    def psql(self, sql, connection=None, check=True):
        """What one statement answers, without padding; with check=False the error's text."""
        done = subprocess.run(["psql", "-X", "-q", "-A", "-t", "-v", "ON_ERROR_STOP=1", "-d", connection or self.owner, "-c",
                               f"SET search_path = selfcal, public; {sql}"], capture_output=True, text=True, check=False)
        if check and done.returncode != 0:
            raise AssertionError(f"{sql}: {done.stderr.strip()}")
        return done.stdout.strip() if done.returncode == 0 else done.stderr.strip()
