"""The service's documents over D-Bus, asked by this process itself: a start of `selfcal` for each question takes most of what a guest
with one processor has. No line is shared with the programs'."""
import json
import os
import socket
import struct

CALL, RETURN, ERROR = 1, 2, 3
PATH, INTERFACE, MEMBER, DESTINATION, SIGNATURE = 1, 2, 3, 6, 8
SYSTEM = "unix:path=/var/run/dbus/system_bus_socket"
BUS, SERVICE = "org.freedesktop.DBus", "org.selfcal.Manager1"
PATIENCE_S = 180.0


def padded(data, to=8):
    return data + bytes(-len(data) % to)


def string(text):
    return struct.pack("<I", len(text)) + text.encode() + b"\0"


def field(code, kind, text):
    value = bytes([len(text)]) + text.encode() + b"\0" if kind == "g" else string(text)
    return bytes([code, 1]) + kind.encode() + b"\0" + value


def call_message(serial, name, path, interface, member, signature="", body=b""):
    fields = [field(PATH, "o", path), field(INTERFACE, "s", interface), field(MEMBER, "s", member), field(DESTINATION, "s", name)]
    if signature:
        fields.append(field(SIGNATURE, "g", signature))
    packed = b"".join(padded(one) for one in fields[:-1]) + fields[-1]  # the last is not padded within the length that is told
    return padded(struct.pack("<cBBBIII", b"l", CALL, 0, 1, len(body), serial, len(packed)) + packed) + body


class ServiceBus:
    """One connection; it asks one thing at a time."""

    def __init__(self):
        address = os.environ.get("SELFCAL_BUS") or os.environ.get("DBUS_SYSTEM_BUS_ADDRESS") or SYSTEM
        self.serial = 0
        self.socket = socket.socket(socket.AF_UNIX)
        self.socket.settimeout(PATIENCE_S)
        try:
            self.socket.connect(address.removeprefix("unix:path=").split(",")[0])
            self.socket.sendall(b"\0AUTH EXTERNAL " + str(os.getuid()).encode().hex().encode() + b"\r\n")
            answer = self.socket.recv(4096)
            if not answer.startswith(b"OK "):
                raise ConnectionError(f"the bus does not let us in: {answer}")
            self.socket.sendall(b"BEGIN\r\n")
            self.ask(BUS, "/org/freedesktop/DBus", BUS, "Hello")
        except OSError:
            self.close()
            raise

    def close(self):
        self.socket.close()

    def take(self, length):
        data = b""
        while len(data) < length:
            more = self.socket.recv(length - len(data))
            if not more:
                raise ConnectionError("the bus ended the connection")
            data += more
        return data

    def ask(self, *message):
        """The string that is the answer's first; None where the answer is an error."""
        self.serial += 1
        self.socket.sendall(call_message(self.serial, *message))
        while True:
            order, kind, _, _, body_length, _, fields_length = struct.unpack("<cBBBIII", head := self.take(16))
            if order != b"l":
                _, kind, _, _, body_length, _, fields_length = struct.unpack(">cBBBIII", head)
            body = self.take(fields_length + -fields_length % 8 + body_length)[fields_length + -fields_length % 8:]
            if kind == ERROR:
                return None
            if kind == RETURN:
                length, = struct.unpack("<I" if order == b"l" else ">I", body[:4])
                return body[4:4 + length].decode()

    def has_service(self):
        return self.ask(BUS, "/org/freedesktop/DBus", BUS, "GetNameOwner", "s", string(SERVICE)) is not None

    def document(self, run):
        """What `selfcal show RUN --json` prints; None where the service has none or is not there."""
        text = self.ask(SERVICE, "/org/selfcal/Manager", SERVICE, "Show", "t", struct.pack("<Q", run))
        return None if text is None else json.loads(text)
