"""ISO 15765-2 of one end on a classic CAN socket, normal addressing: messages in, messages out. Shares no line with our C++."""
import socket
import struct

EXTENDED = 0x80000000


class Transport:
    def __init__(self, interface, receive_id, transmit_id, functional_id, flag=EXTENDED):
        self.flag = flag
        self.can = socket.socket(socket.AF_CAN, socket.SOCK_RAW, socket.CAN_RAW)
        self.can.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4 << 20)
        self.receive_id, self.transmit_id, self.functional_id = receive_id, transmit_id, functional_id
        filters = [(i | flag, 0xDFFFFFFF) for i in (receive_id, functional_id)]
        self.can.setsockopt(socket.SOL_CAN_RAW, socket.CAN_RAW_FILTER, b"".join(struct.pack("=II", *f) for f in filters))
        self.can.bind((interface,))

    def _put(self, data):
        frame = struct.pack("=IB3x8s", self.transmit_id | self.flag, 8, bytes(data).ljust(8, b"\x55"))
        while True:
            try:
                self.can.send(frame)
                return
            except OSError as error:
                if error.errno != 105:  # ENOBUFS: the queue is full
                    raise

    def _frame(self, seconds):
        self.can.settimeout(seconds)
        try:
            frame = self.can.recv(16)
        except TimeoutError:
            return None, b""
        identifier, length = struct.unpack("=IB", frame[:5])
        return identifier & 0x1FFFFFFF, frame[8:8 + length]

    def receive(self, seconds):
        """(message, whether it was for all); None where none came."""
        identifier, data = self._frame(seconds)
        if not data:
            return None
        kind = data[0] >> 4
        if kind == 0 and 0 < data[0] <= 7:
            return data[1:1 + data[0]], identifier == self.functional_id
        if kind != 1 or identifier != self.receive_id:
            return None
        length = (data[0] & 0xF) << 8 | data[1]
        message, sequence = data[2:], 1
        self._put([0x30, 0, 0])
        while len(message) < length:
            identifier, data = self._frame(1.0)
            if identifier == self.functional_id:
                continue
            if not data or data[0] != 0x20 | sequence:
                return None
            message += data[1:]
            sequence = (sequence + 1) % 16
        return message[:length], False

    def send(self, message):
        if len(message) <= 7:
            return self._put([len(message), *message])
        self._put([0x10 | len(message) >> 8, len(message) & 0xFF, *message[:6]])
        while True:
            identifier, data = self._frame(1.0)
            if not data:
                return None
            if identifier == self.receive_id and data[0] == 0x30:
                break
        sequence = 1
        for at in range(6, len(message), 7):
            self._put([0x20 | sequence, *message[at:at + 7]])
            sequence = (sequence + 1) % 16
        return None
