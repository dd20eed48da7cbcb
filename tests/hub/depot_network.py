"""A depot's network on one machine: the hub's namespace with a bridge, and a namespace for each set, joined to it by a veth.

Nothing of the machine's own network is used or changed: the process that makes a Network leaves it for a new namespace, with all
that it starts afterwards; the namespaces go with the processes in them. Needs root."""
import ctypes
import os
import subprocess

HUB = "10.77.0.1"   # in namespaces of our own: any will do
CLONE_NEWNET = 0x40000000


def ip(*words):
    subprocess.run(["ip", *map(str, words)], check=True, capture_output=True, text=True)


class Place:
    """A set's own namespace. What is to run there is started with `enter` before it."""

    def __init__(self, number):
        self.link = f"set{number}"
        # Holds the namespace while sets are killed and started anew; ends with our end of its pipe.
        self.holder = subprocess.Popen(["unshare", "--net", "cat"], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.holder.stdin.write("there\n")
        self.holder.stdin.flush()
        self.holder.stdout.readline()   # it runs, so its namespace is made
        self.enter = ["nsenter", f"--net=/proc/{self.holder.pid}/ns/net"]
        ip("link", "add", self.link, "type", "veth", "peer", "name", "eth0", "netns", self.holder.pid)
        ip("link", "set", self.link, "master", "depot", "up")
        for words in (("link", "set", "lo", "up"), ("addr", "add", f"10.77.0.{number + 2}/24", "dev", "eth0"), ("link", "set", "eth0", "up")):
            subprocess.run([*self.enter, "ip", *words], check=True)

    def cut(self):
        """As a cable that is pulled: the set is told nothing, its packets go nowhere."""
        ip("link", "set", self.link, "down")

    def mend(self):
        ip("link", "set", self.link, "up")


class Network:
    def __init__(self):
        if ctypes.CDLL(None, use_errno=True).unshare(CLONE_NEWNET) != 0:
            raise SystemExit(f"a network namespace: {os.strerror(ctypes.get_errno())}")
        ip("link", "set", "lo", "up")
        ip("link", "add", "depot", "type", "bridge")
        ip("addr", "add", f"{HUB}/24", "dev", "depot")
        ip("link", "set", "depot", "up")
        self.places = []

    def join(self, number):
        self.places.append(Place(number))
        return self.places[-1]

    def close(self):
        for place in self.places:
            place.holder.stdin.close()
            place.holder.wait()
