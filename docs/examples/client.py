#!/usr/bin/env python3
"""A client of psrd to learn the protocol from: Python and its standard library, written from proto/PROTOCOL.md alone.

    client.py                            lists the models of a server
    client.py teapot teapot.png          draws one picture, in view 0
    client.py teapot teapot.png --view   moves a camera in view 1; writes the picture in which it comes to rest

Pixels travel raw, as the standard library reads neither zstd nor JPEG; a viewer on a slow line asks for those.
"""
import argparse
import math
import os
import socket
import struct
import sys

from wire.messages import (BASE, COLOR, DEPTH, FLAG_SHARP, INSTANCE, LIGHT, MAGIC, MESSAGES, NAMES, REFINE, RESOLUTION,
                           SCALES, SHARP, VIEWS, Trouble, expect, pack, unpack)
from wire.picture import Picture

EXIT_STATUS = {1: 2, 2: 3, 3: 3, 4: 3, 5: 4, 6: 4, 7: 4, 8: 5, 13: 7}  # by the code of ERROR; of others 6
SILENCE_S = 30
FOV = math.radians(35)


class Connection:
    def __init__(self, address):
        self.address, self.buffer, self.last_id = address, b"", 0
        host, _, port = address.removeprefix("tcp://").rpartition(":")
        try:
            if address.startswith("unix:"):
                self.socket = socket.socket(socket.AF_UNIX)
                self.socket.connect(address.removeprefix("unix:"))
            elif host and port.isdecimal() and int(port) < 65536:
                self.socket = socket.create_connection((host.strip("[]"), int(port)))
                self.socket.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
            else:
                raise Trouble(2, f"{address} is no address; give HOST:PORT or unix:PATH")
        except OSError as error:
            raise Trouble(6, f"{address} does not answer ({error.strerror}); does psrd run there?") from None
        self.socket.settimeout(SILENCE_S)
        self.send("HELLO", magic=MAGIC, major=0, minor=2, client="client.py")
        self.welcome = self.answer(0, "WELCOME")[1]

    def send(self, kind, id=0, view=0, more=b"", /, **fields):
        number, table = MESSAGES[kind]
        payload = pack(table, **fields) + more
        self.socket.sendall(struct.pack("<IHHIHH", 16 + len(payload), number, 0, id, view, 0) + payload)

    def request(self, kind, view=0, more=b"", /, **fields):
        """Sends a message with a new id, and returns that. Ids rise, over all types and views."""
        self.last_id += 1
        self.send(kind, self.last_id, view, more, **fields)
        return self.last_id

    def read(self, size):
        """The next bytes of the stream; fewer at its end. Sends PING to a server that is silent."""
        pinged = False
        while len(self.buffer) < size:
            try:
                data = self.socket.recv(1 << 16)
            except TimeoutError:
                if pinged:
                    raise Trouble(6, f"{self.address} answered nothing for {2 * SILENCE_S} s, not even PING") from None
                pinged = True
                self.send("PING")
                continue
            if not data:
                break
            self.buffer += data
        data, self.buffer = self.buffer[:size], self.buffer[size:]
        return data

    def receive(self):
        """The next message that is more than a sign of life: its kind, fields, id and view."""
        while True:
            header = self.read(16)
            if len(header) < 16:
                raise Trouble(6, f"{self.address} closed the connection")
            length, number, flags, id, view, reserved = struct.unpack("<IHHIHH", header)
            expect(16 <= length <= 65536 and flags <= 1 and reserved == 0, "a header is damaged")
            payload = self.read(length - 16)
            if len(payload) < length - 16:
                raise Trouble(6, f"{self.address} closed the connection within a message")
            if number not in NAMES:
                expect(flags == 1, f"a message has the unknown type {number}")
                continue
            kind = NAMES[number]
            fields = unpack(MESSAGES[kind][1], payload)
            expect(flags == 0, f"{kind} says that it may be skipped")
            expect(len(fields.rest) <= 256 or kind in ("RECT", "FRAME_END"), f"{kind} is too long")
            if kind == "PING":
                self.send("PONG", token=fields.token)
            elif kind == "GOODBYE":
                raise Trouble(6, f"{self.address} says goodbye: {fields.text or f'reason {fields.reason}'}")
            elif kind == "ERROR":
                raise Trouble(EXIT_STATUS.get(fields.code, 6), fields.text)
            elif kind != "PONG":
                return kind, fields, id, view

    def answer(self, to, *kinds):
        """The next answer in view 0, when one request alone is open: its kind and fields."""
        kind, fields, id, view = self.receive()
        expect(id == to and view == 0 and kind in kinds, f"{kind} with id {id} answers nothing")
        return kind, fields

    def leave(self):
        """Says GOODBYE, and reads to the end of the stream."""
        self.send("GOODBYE")
        while self.read(1 << 16):
            pass
        self.socket.close()


def list_models(connection):
    id = connection.request("LIST")
    while True:
        kind, entry = connection.answer(id, "LIST_ENTRY", "LIST_END")
        if kind == "LIST_END":
            break
        print({1: "ready ", 2: "loaded", 3: "source"}.get(entry.state, "failed"), entry.name)


def open_model(connection, name, side):
    """Opens a model for pictures of this greater side. A server that builds it first tells how far it is."""
    takes_resolution = connection.welcome.capabilities & RESOLUTION
    id = connection.request("OPEN", name=name, resolution=side if takes_resolution else 0)
    while True:
        kind, fields = connection.answer(id, "PROGRESS", "OPENED")
        if kind == "OPENED":
            return fields
        stage = ("waiting", "importing", "sampling", "selecting", "writing", "loading")[min(fields.stage, 5)]
        print(f"{name}: {stage}", f"{fields.done} of {fields.total}" if fields.total else "", file=sys.stderr)


def send_scene(connection, model):
    """Puts into slot 0 the model as its file has it, and a light from above, in front, on the left."""
    light = add((-1, model.up), (-1, sides(model.up)[1]), (0.5, sides(model.up)[0]))
    instances = pack(INSTANCE, handle=model.handle, rotation=(0, 0, 0, 1), scale=1.0)
    lights = pack(LIGHT, kind=1, color=(255, 255, 255), intensity=1.0, direction=light)
    connection.request("SCENE", 0, instances + lights, n_instances=1, n_lights=1, ambient=0.25, background=(32, 48, 64))
    return light


def draw(connection, camera, width, height):
    """Returns a picture of colour and depth, in full quality (budget 0)."""
    request = {"width": width, "height": height, "planes": 1 << COLOR | 1 << DEPTH, "depth_format": 1}
    id = connection.request("FRAME", **request, **camera)
    picture = Picture(connection.answer(id, "FRAME_BEGIN")[1], request)
    while True:
        kind, fields = connection.answer(id, "RECT", "FRAME_END")
        if kind == "FRAME_END":
            break
        picture.add(fields)
    hashes = picture.end(fields)
    print(f"color {hashes[COLOR]:016x}\ndepth {hashes[DEPTH]:016x}")
    return picture


def move(connection, cameras, width, height):
    """Asks for frames as a viewer does, four cameras at once, as a hand moves faster than frames come.

    The server draws the first and the last of the four, and supersedes the others. They are coarse, to be quick, and
    based on the frame that is shown. Where the camera rests a sharp frame follows, then one of refinement level 1,
    which is returned.
    """
    needed = VIEWS | REFINE | BASE | SCALES | SHARP
    if connection.welcome.capabilities & needed != needed:
        raise Trouble(4, f"{connection.address} does not offer views, refinement, bases, scales and sharp frames")
    request = {"width": width, "height": height, "planes": 1 << COLOR, "pass_limit": 1, "flags": FLAG_SHARP,
               "budget": 3, "settings_scale": 2, "settings_spacing_px": 1.0}
    bases = {}  # by open id: the id that FRAME named as its base, or 0
    begun = {}  # by open id: the picture on its way
    acknowledged = {}  # by open id, and id of a base: the last two pictures, by pass
    newest = shown = 0
    while True:
        if shown == newest and cameras:
            for camera in cameras[:4]:
                newest = connection.request("FRAME", 1, base=shown, **request, **camera)
                bases[newest] = shown
            cameras = cameras[4:]
        kind, fields, id, view = connection.receive()
        expect(id in bases and view == 1, f"{kind} with id {id} answers nothing")
        if kind == "FRAME_BEGIN":
            base = acknowledged.get(fields.base, {}).get(fields.base_pass)
            expect(base or not fields.base, f"frame {id} has a base that was not acknowledged")
            begun[id] = Picture(fields, request, base)
        elif kind == "SUPERSEDED":
            print(f"{id} superseded by {fields.by}")
            del bases[id]
            begun.pop(id, None)
        else:
            expect(kind in ("RECT", "FRAME_END") and id in begun, f"{kind} of frame {id} comes before FRAME_BEGIN")
            if kind == "RECT":
                begun[id].add(fields)
                continue
            picture = begun.pop(id)
            hashes = picture.end(fields)
            connection.send("ACK", id, 1, pass_=fields.pass_)
            shown = max(shown, id)
            acknowledged[id] = dict([*acknowledged.get(id, {}).items(), (fields.pass_, picture)][-2:])
            begin = picture.begin
            print(f"{id}.{begin.pass_} color {hashes[COLOR]:016x} level {begin.refine} scale {begin.settings_scale} on",
                  f"base {begin.base}.{begin.base_pass}" if begin.base else "background", f"{picture.bytes} bytes")
            if fields.final:
                del bases[id]
        if not bases and not cameras:
            return picture
        acknowledged = {i: pictures for i, pictures in acknowledged.items() if i in {shown, *bases, *bases.values()}}


def add(*terms):
    """The sum of vectors, each after its factor."""
    return tuple(sum(factor * vector[i] for factor, vector in terms) for i in range(3))


def sides(up):
    """The right and the front of a model: +X and +Z where +Y is up, +X and -Y where +Z is up."""
    x, y, z = up
    front = (0, -z, y) if abs(x) < 0.9 else (y, -x, 0)  # right angles to up, from +X or from +Z
    front = tuple(a / math.hypot(*front) for a in front)
    right = (y * front[2] - z * front[1], z * front[0] - x * front[2], x * front[1] - y * front[0])  # up x front
    return right, front


def camera_from(model, azimuth, elevation, aspect):
    """A camera at these angles, in degrees, whose picture shows all of the model's box."""
    azimuth, elevation = math.radians(azimuth), math.radians(elevation)
    right, front = sides(model.up)
    towards = add((math.cos(elevation) * math.cos(azimuth), front), (math.cos(elevation) * math.sin(azimuth), right),
                  (math.sin(elevation), model.up))
    center = add((0.5, model.box_min), (0.5, model.box_max))
    radius = math.dist(model.box_min, model.box_max) / 2 or model.spacing
    distance = radius / math.sin(math.atan(math.tan(FOV / 2) * min(1, aspect)))
    return {"camera_kind": 1, "camera_eye": add((1, center), (distance, towards)), "camera_target": center,
            "camera_up": model.up, "camera_extent": FOV}


def main():
    parser = argparse.ArgumentParser(description="Lists the models of a psrd, or has it draw one.")
    parser.add_argument("model", nargs="?", help="a model of the list; without one the list is printed")
    parser.add_argument("output", nargs="?", help="the PNG file to write")
    parser.add_argument("--server", default=os.environ.get("PSR_SERVER", "127.0.0.1:7447"), metavar="ADDR",
                        help="HOST:PORT or unix:PATH [%(default)s]")
    parser.add_argument("--size", default="640x480", metavar="WxH", help="of the picture [%(default)s]")
    parser.add_argument("--view", action="store_true", help="move the camera, as a viewer does")
    options = parser.parse_intermixed_args()
    width, _, height = options.size.partition("x")
    if not (width.isdecimal() and height.isdecimal() and 0 < int(width) <= 16384 and 0 < int(height) <= 16384):
        parser.error(f"--size takes WxH of 1 to 16384 pixels, such as 640x480, not {options.size}")
    if options.model and not options.output:
        parser.error("a picture needs a file: client.py MODEL FILE.png")
    width, height = int(width), int(height)

    connection = Connection(options.server)
    if options.model:
        model = open_model(connection, options.model, max(width, height))
        send_scene(connection, model)
        cameras = [camera_from(model, azimuth, 20, width / height) for azimuth in range(-45, 31, 5)]
        if options.view:
            picture = move(connection, cameras, width, height)
        else:
            picture = draw(connection, cameras[-1], width, height)
        picture.write(options.output)
    else:
        list_models(connection)
    connection.leave()


if __name__ == "__main__":
    try:
        main()
    except Trouble as trouble:
        print(f"client.py: {trouble}", file=sys.stderr)
        sys.exit(trouble.status)
    except OSError as error:
        what = f"cannot write {error.filename}" if error.filename else "the connection broke"
        print(f"client.py: {what}: {error.strerror}", file=sys.stderr)
        sys.exit(3 if error.filename else 6)
