"""ROS bags written from their published formats, by nothing that the importer is made of: ROS 2 messages in CDR (OMG CDR, either
endianness) into rosbag2's SQLite tables, ROS 1 messages into a bag of version 2.0 (wiki.ros.org/Bags/Format/2.0)."""
import bz2
import sqlite3
import struct


def header_cdr(order, stamp, frame):
    name = frame.encode() + b"\0"
    return struct.pack(order + "iII", stamp // 10**9, stamp % 10**9, len(name)) + name


def padded(data, alignment):
    return data + b"\0" * (-len(data) % alignment)


def imu_cdr(order, stamp, gyro, accel, frame="imu_link"):
    body = padded(header_cdr(order, stamp, frame), 8)
    body += struct.pack(order + "37d", 0, 0, 0, 1, *[-1] + [0] * 8, *gyro, *[0.0] * 9, *accel, *[0.0] * 9)
    return bytes([0, order == "<", 0, 0]) + body


def joints_cdr(order, stamp, names, positions):
    body = padded(header_cdr(order, stamp, "base"), 4) + struct.pack(order + "I", len(names))
    for name in names:
        body = padded(body, 4) + struct.pack(order + "I", len(name) + 1) + name.encode() + b"\0"
    body = padded(padded(body, 4) + struct.pack(order + "I", len(positions)), 8)
    body += struct.pack(f"{order}{len(positions)}d", *positions) + struct.pack(order + "II", 0, 0)
    return bytes([0, order == "<", 0, 0]) + body


def temperature_cdr(order, stamp, celsius):
    return bytes([0, order == "<", 0, 0]) + padded(header_cdr(order, stamp, "imu"), 8) + struct.pack(order + "2d", celsius, 0.0)


def header_ros1(number, stamp, frame):
    return struct.pack("<IIII", number, stamp // 10**9, stamp % 10**9, len(frame)) + frame.encode()


def imu_ros1(number, stamp, gyro, accel):
    return header_ros1(number, stamp, "imu_link") + struct.pack("<37d", 0, 0, 0, 1, *[-1] + [0] * 8, *gyro, *[0.0] * 9, *accel, *[0.0] * 9)


def joints_ros1(number, stamp, names, positions):
    body = header_ros1(number, stamp, "") + struct.pack("<I", len(names))
    for name in names:
        body += struct.pack("<I", len(name)) + name.encode()
    return body + struct.pack(f"<I{len(positions)}dII", len(positions), *positions, 0, 0)


def temperature_ros1(number, stamp, celsius):
    return header_ros1(number, stamp, "imu") + struct.pack("<2d", celsius, 0.0)


def write_sqlite(path, topics, messages):
    """topics: {name: type}; messages: (topic, time of reception in ns, bytes)."""
    path.unlink(missing_ok=True)
    with sqlite3.connect(path) as database:
        database.executescript("""
            CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
            CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
            CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
                                serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
            CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
            CREATE INDEX timestamp_idx ON messages (timestamp ASC);""")
        number = {name: k + 1 for k, name in enumerate(topics)}
        database.executemany("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", [(number[n], n, t) for n, t in topics.items()])
        database.executemany("INSERT INTO messages(topic_id, timestamp, data) VALUES (?, ?, ?)",
                             ((number[t], at, data) for t, at, data in messages))
    database.close()


def fields(**values):
    out = b""
    for name, value in values.items():
        value = {int: lambda v: struct.pack("<I", v), bytes: lambda v: v, str: str.encode}[type(value)](value)
        out += struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
    return out


def record(head, data):
    return struct.pack("<I", len(head)) + head + struct.pack("<I", len(data)) + data


def time_ros1(at):
    return struct.pack("<II", at // 10**9, at % 10**9)


def write_ros1(path, topics, messages, compression="none", chunk_bytes=768 * 1024):
    """topics: {name: (type, md5sum, definition)}; messages in order of reception: (topic, ns, bytes)."""
    number = {name: k for k, name in enumerate(topics)}

    def connection(name):
        kind, md5sum, definition = topics[name]
        return record(fields(op=b"\x07", conn=number[name], topic=name),
                      fields(topic=name, type=kind, md5sum=md5sum, message_definition=definition))

    out, infos, chunk, index, times = bytearray(), [], bytearray(), {}, []

    def close_chunk():
        data = bz2.compress(bytes(chunk)) if compression == "bz2" else bytes(chunk)
        infos.append((first + len(out), min(times), max(times), {c: len(e) for c, e in index.items()}))
        out.extend(record(fields(op=b"\x05", compression=compression, size=len(chunk)), data))
        for conn, entries in index.items():
            out.extend(record(fields(op=b"\x04", ver=1, conn=conn, count=len(entries)),
                              b"".join(time_ros1(at) + struct.pack("<I", offset) for at, offset in entries)))
        chunk.clear()
        index.clear()
        times.clear()

    first = len(b"#ROSBAG V2.0\n") + 4096
    told = set()
    for topic, at, data in messages:
        if topic not in told:
            told.add(topic)
            chunk += connection(topic)
        index.setdefault(number[topic], []).append((at, len(chunk)))
        times.append(at)
        chunk += record(fields(op=b"\x02", conn=number[topic], time=time_ros1(at)), data)
        if len(chunk) > chunk_bytes:
            close_chunk()
    if chunk:
        close_chunk()
    end = first + len(out)
    for name in topics:
        out += connection(name)
    for position, begin, last, counts in infos:
        out += record(fields(op=b"\x06", ver=1, chunk_pos=struct.pack("<Q", position), start_time=time_ros1(begin),
                             end_time=time_ros1(last), count=len(counts)),
                      b"".join(struct.pack("<II", *pair) for pair in counts.items()))
    head = fields(op=b"\x03", index_pos=struct.pack("<Q", end), conn_count=len(topics), chunk_count=len(infos))
    padding = 4096 - 8 - len(head)
    path.write_bytes(b"#ROSBAG V2.0\n" + record(head, b" " * padding) + bytes(out))
