"""screen.py XWD X Y WIDTH HEIGHT OUT: a part of the screen that Xvfb keeps in a file (-fbdir), as OUT.ppm or OUT.png."""
import struct
import sys
import zlib

path, out = sys.argv[1], sys.argv[6]
x, y, width, height = map(int, sys.argv[2:6])
with open(path, "rb") as file:
    data = file.read()
header = struct.unpack(">25I", data[:100])
header_size, bits, stride, n_colors = header[0], header[11], header[12], header[19]
assert bits == 32 and header[7] == 0, "a screen of 32 bits a pixel, little-endian, is expected"
start = header_size + 12 * n_colors
rows = []
for row in range(y, y + height):
    line = data[start + row * stride + 4 * x:start + row * stride + 4 * (x + width)]
    rgb = bytearray(3 * width)
    rgb[0::3], rgb[1::3], rgb[2::3] = line[2::4], line[1::4], line[0::4]
    rows.append(rgb)


def chunk(name, content):
    return struct.pack(">I", len(content)) + name + content + struct.pack(">I", zlib.crc32(name + content))


with open(out, "wb") as file:
    if out.endswith(".png"):
        filtered = bytearray()
        above = bytes(3 * width)
        for rgb in rows:  # each as the difference to the row above
            filtered += b"\2" + bytes((a - b) & 255 for a, b in zip(rgb, above))
            above = rgb
        file.write(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">2I5B", width, height, 8, 2, 0, 0, 0))
                   + chunk(b"IDAT", zlib.compress(bytes(filtered), 9)) + chunk(b"IEND", b""))
    else:
        file.write(b"P6\n%d %d\n255\n" % (width, height) + b"".join(rows))
