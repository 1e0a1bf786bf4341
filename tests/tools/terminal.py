#!/usr/bin/env python3
"""terminal.py COLSxROWS WIDTHxHEIGHT STEPS COMMAND...: a terminal for a program, which shows its last picture.

STEPS are words apart by blanks: wait:TEXT waits until the last row says TEXT, keys:TEXT types it (\\x1b and so on are
read as Python does), size:COLSxROWS:WIDTHxHEIGHT changes the size, signal:NAME sends a signal, picture:FILE writes the
picture that the kitty or sixel protocol shows now as PPM, run:COMMAND runs a shell command. At the end it waits for the
program and prints "exit STATUS", "restored" if the screen, cursor, mouse and settings are as before, and else what is
not."""
import base64
import codecs
import fcntl
import os
import pty
import re
import select
import signal
import struct
import subprocess
import sys
import termios
import time

PATIENCE = 30


def fail(text):
    print(text)
    sys.exit(1)


def sixels(data):
    """Rows of (r, g, b) of a sixel picture."""
    body = data[data.index(b"q") + 1:].decode("latin-1")
    colors, pixels = {}, {}
    color = x = row = 0
    for token in re.finditer(r'"[\d;]*|#(\d+)(?:;2;(\d+);(\d+);(\d+))?|!(\d+)([?-~])|([?-~])|([$-])', body):
        if token[1]:
            color = int(token[1])
            if token[2]:
                colors[color] = tuple(round(int(token[k]) * 255 / 100) for k in (2, 3, 4))
        elif token[6] or token[7]:
            n, bits = int(token[5] or 1), ord(token[6] or token[7]) - 63
            for k in range(6):
                if bits >> k & 1:
                    for i in range(n):
                        pixels[x + i, row + k] = color
            x += n
        elif token[8] == "$":
            x = 0
        elif token[8] == "-":
            x, row = 0, row + 6
    width, height = max(p[0] for p in pixels) + 1, max(p[1] for p in pixels) + 1
    return width, height, b"".join(bytes(colors[pixels.get((i, j), 0)]) for j in range(height) for i in range(width))


def kitty(output):
    """The last whole picture of RGBA."""
    found = None
    for part in re.finditer(rb"\x1b_Ga=T,([^;\x1b]*)(?:;[^\x1b]*)?\x1b\\((?:\x1b_Gm=[01][^\x1b]*\x1b\\)*)", output):
        found = part
    if found is None:
        fail("no picture")
    keys = dict(k.split("=") for k in found[1].decode().split(","))
    first = re.match(rb"\x1b_G[^;\x1b]*;([^\x1b]*)\x1b", found[0])
    parts = ([first[1]] if first else []) + re.findall(rb"\x1b_Gm=[01];([^\x1b]*)\x1b", found[2])
    pixels = b"".join(map(base64.b64decode, parts))
    rgb = bytearray(len(pixels) // 4 * 3)
    for k in range(3):
        rgb[k::3] = pixels[k::4]
    return int(keys["s"]), int(keys["v"]), bytes(rgb)


class Terminal:
    def __init__(self, cells, pixels, command):
        self.output = bytearray()
        self.row, self.scanned, self.forgotten = "", 0, 0
        self.pid, self.fd = pty.fork()
        if self.pid == 0:
            self.fd = 0
            self.resize(cells, pixels)
            os.execvp(command[0], command)
        self.resize(cells, pixels)
        self.before = termios.tcgetattr(self.fd)

    def resize(self, cells, pixels):
        cols, rows = map(int, cells.split("x"))
        fcntl.ioctl(self.fd, termios.TIOCSWINSZ, struct.pack("HHHH", rows, cols, *map(int, pixels.split("x"))))

    def read(self, seconds):
        """False: the program has closed its terminal."""
        if not select.select([self.fd], [], [], seconds)[0]:
            return True
        try:
            data = os.read(self.fd, 65536)
        except OSError:
            return False
        self.output += data
        if b"\x1b[c" in data:
            os.write(self.fd, b"\x1b[?62;4c")
        return bool(data)

    def last_row(self):
        start = max(self.scanned - 1024, 0)  # a row may have come in two parts
        self.scanned = len(self.output)
        for row in re.finditer(rb"\x1b\[\d+;1H\x1b\[0m([^\x1b]*)\x1b\[K", self.output[start:]):
            if start + row.end() > self.forgotten:
                self.row = row[1].decode()
        return self.row

    def forget_row(self):
        self.row, self.forgotten = "", len(self.output)

    def wait(self, text):
        end = time.monotonic() + PATIENCE
        while text not in self.last_row():
            if time.monotonic() > end or not self.read(0.1):
                fail("never said '%s' but '%s'; %r" % (text, self.last_row(), self.output[-300:]))

    def picture(self, path):
        last_sixel = self.output.rfind(b"\x1bP")
        if last_sixel >= 0:
            width, height, rgb = sixels(self.output[last_sixel + 2:self.output.index(b"\x1b\\", last_sixel)])
        else:
            width, height, rgb = kitty(self.output)
        with open(path, "wb") as file:
            file.write(b"P6\n%d %d\n255\n" % (width, height) + rgb)

    def step(self, step):
        name, _, value = step.partition(":")
        if name == "wait":
            self.wait(value.replace("_", " "))
        elif name == "keys":
            self.forget_row()
            os.write(self.fd, codecs.decode(value, "unicode_escape").encode("latin-1"))
        elif name == "size":
            self.forget_row()
            self.resize(*value.split(":"))
        elif name == "signal":
            os.kill(self.pid, getattr(signal, value))
        elif name == "picture":
            self.picture(value)
        elif name == "run":
            subprocess.run(value.replace("_", " "), shell=True, check=True)
        else:
            fail("no step " + step)

    def end(self):
        end = time.monotonic() + PATIENCE
        while self.read(0.1):
            pid, status = os.waitpid(self.pid, os.WNOHANG)
            if pid:
                break
            if time.monotonic() > end:
                os.kill(self.pid, signal.SIGKILL)
                fail("the program does not end")
        else:
            status = os.waitpid(self.pid, 0)[1]
        while select.select([self.fd], [], [], 0)[0] and self.read(0):
            pass
        print("exit", os.waitstatus_to_exitcode(status))
        off = [mode for mode in ("?1049l", "?25h", "?1002l") if b"\x1b[" + mode.encode() not in self.output]
        if b"\x1b[?1049h" not in self.output:
            off = []
        try:
            now = termios.tcgetattr(self.fd)
            off += ["settings"] if now[:4] != self.before[:4] else []
        except termios.error:
            pass
        print("not restored: " + " ".join(off) if off else "restored")


terminal = Terminal(sys.argv[1], sys.argv[2], sys.argv[4:])
for word in sys.argv[3].split():
    terminal.step(word)
terminal.end()
