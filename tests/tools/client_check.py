#!/usr/bin/env python3
"""Checks docs/examples/client.py (in PYTHONPATH) for tests/e2e/python.sh.

    messages               packs and unpacks proto/vectors.txt
    refused                feeds the client what proto/vectors.txt says that it refuses
    hashes                 compares with the hashes of proto/planes.txt
    pixels PNG PPM         compares the client's picture with another
    camera ADDR MODEL WxH  prints the options with which psr shot draws the client's picture
"""
import re
import socket
import struct
import sys
import zlib
from types import SimpleNamespace

import client
from wire import messages
from wire.picture import Picture, plane_hash

FALLBACK = ("state", "stage", "reason", "status")  # fields whose unknown values `later` messages show as their fallback
OTHER_NAMES = {"pass": "pass_", "is_final": "final"}


def vectors(path):
    """Words of the head line, fields by name, bytes by the word before them."""
    entries = []
    for line in open(path, encoding="utf-8"):
        line = line.rstrip("\n")
        if not line or line.startswith("#"):
            continue
        if line.startswith("  "):
            entries[-1][2][part] = entries[-1][2].get(part, b"") + bytes.fromhex(line)
        elif " = " in line:
            name, _, value = line.partition(" = ")
            name = re.sub(r"\W", "_", name)
            entries[-1][1][OTHER_NAMES.get(name, name)] = value
        elif line in ("hex", "from", "to"):
            part = line
        else:
            entries.append((line.split(), {}, {}))
    assert entries
    return entries


def parts_of(kind, data):
    """Tables and prefixes of names of a payload's parts."""
    table = messages.MESSAGES[kind][1]
    yield table, ""
    fields = messages.unpack(table, data)
    if kind == "SCENE":
        yield from ((messages.INSTANCE, f"instance_{i}_") for i in range(fields.n_instances))
        yield from ((messages.LIGHT, f"light_{i}_") for i in range(fields.n_lights))
    if kind == "FRAME_END":
        planes = (plane for plane in range(7) if fields.planes >> plane & 1 and fields.has_hashes)
        yield from ((f"hash_{plane}:Q", "") for plane in planes)
        yield from (("id:H ns:Q count:Q", f"entry_{i}_") for i in range(fields.n_entries))


def like(value, text):
    """A vector's text as a value of the same type."""
    if isinstance(value, tuple):
        return tuple(like(v, t) for v, t in zip(value, text.split(), strict=True))
    return bytes.fromhex(text) if isinstance(value, bytes) else type(value)(text)


def check_messages():
    n = 0
    for (sort, name, kind, *ids), expected, parts in vectors("proto/vectors.txt"):
        if sort == "refused" or kind not in messages.MESSAGES:
            continue
        header, rest = parts["hex"][:16], parts["hex"][16:]
        number = messages.MESSAGES[kind][0]
        assert header == struct.pack("<IHHIHH", 16 + len(rest), number, 0, int(ids[0]), int(ids[1]), 0), name
        for table, prefix in list(parts_of(kind, rest)):
            fields = vars(messages.unpack(table, rest))
            after = fields.pop("rest")
            for field, value in fields.items():
                if field == "magic" or sort == "later" and field in FALLBACK:
                    continue
                text = expected.pop(prefix + field, None)
                is_same = value == like(value, text) if text is not None else not value
                assert is_same, f"{name}: {field} is {value}, expected {text}"
            assert messages.pack(table, **fields) == rest[:len(rest) - len(after)], name
            rest = after
        if kind == "RECT":
            assert rest == bytes.fromhex(expected.pop("data")), name
        else:
            assert sort == "later" or not rest, name
        assert sort == "later" or not expected, f"{name}: {expected}"
        n += 1
    print(f"{n} messages")
    assert n > 40


def feed(data):
    """What a client makes of a server's bytes; the planes of a picture of 1024x256."""
    begin = SimpleNamespace(width=1024, height=256, planes=3, background=(0, 0, 0), pass_=0)
    connection = client.Connection.__new__(client.Connection)
    server, connection.socket = socket.socketpair()
    connection.address, connection.buffer, picture = "the server", b"", Picture(begin, vars(begin))
    server.sendall(data)
    server.close()
    while True:
        try:
            kind, fields, _, _ = connection.receive()
        except messages.Trouble as trouble:
            if "closed the connection" in str(trouble) and "within" not in str(trouble):
                return picture.planes
            raise
        if kind == "RECT":
            picture.add(fields)
        if kind == "FRAME_END":
            picture.end(fields)


def status_of(data):
    """The exit code with which the client ends on these bytes; 0 if it takes them."""
    try:
        feed(data)
    except messages.Trouble as trouble:
        return trouble.status
    return 0


def check_refused():
    n = 0
    for (sort, name, *words), _, parts in vectors("proto/vectors.txt"):
        if name == "rect_raw_color":
            assert feed(parts["hex"])[0][(20 * 1024 + 10) * 3:][:6] == bytes(range(1, 7)), "a good RECT is not drawn"
        if name == "frame_end":
            assert status_of(parts["hex"]) == 4, "a picture of another hash is taken"
        must = name.startswith("rect_") or words[0] == "PROTOCOL"
        number = struct.unpack_from("<H", parts["hex"], 4)[0]
        if sort != "refused" or words[1] != "server" or number not in messages.NAMES or not must:
            continue
        assert status_of(parts["hex"]) == 6, f"{name} was not refused"
        n += 1
    assert n > 10


def check_hashes():
    n = 0
    for (sort, name, *size), _, parts in vectors("proto/planes.txt"):
        if sort == "hash":
            width, _, bytes_of_pixel = map(int, size)
            assert plane_hash(parts["from"], width * bytes_of_pixel).to_bytes(8, "little") == parts["to"], name
            n += 1
    assert n > 4


def check_pixels(png, ppm):
    data = open(png, "rb").read()
    width, height = struct.unpack_from(">II", data, 16)
    length, = struct.unpack_from(">I", data, 33)
    rows = zlib.decompress(data[41:41 + length])
    expected = open(ppm, "rb").read()
    head = b"P6\n%d %d\n255\n" % (width, height)
    assert expected.startswith(head), "another size"
    pixels = b"".join(rows[y * (3 * width + 1) + 1:(y + 1) * (3 * width + 1)] for y in range(height))
    assert pixels == expected[len(head):], "other pixels"
    assert len(set(struct.iter_unpack("3B", pixels))) > 50, "hardly a picture"


def print_camera(address, name, size):
    width, height = map(int, size.split("x"))
    connection = client.Connection(address)
    model = client.open_model(connection, name, max(width, height))
    light = client.send_scene(connection, model)
    camera = client.camera_from(model, 30, 20, width / height)
    connection.leave()
    for option, vector in (("--eye", camera["camera_eye"]), ("--target", camera["camera_target"]), ("--up", model.up)):
        print(option, ",".join(map(repr, vector)))
    print("--light dir:" + ",".join(map(repr, light)), "--ambient 0.25 --background #203040")


CHECKS = {"messages": check_messages, "refused": check_refused, "hashes": check_hashes, "pixels": check_pixels,
          "camera": print_camera}
CHECKS[sys.argv[1]](*sys.argv[2:])
