"""Puts a frame's rectangles together, checks its hashes, and writes it as PNG."""
import math
import struct
import zlib

from .messages import COLOR, DEPTH, ENTRY_BYTES, Trouble, expect
from .xxh64 import xxh64

PIXEL_BYTES = {COLOR: 3, DEPTH: 4}


def plane_hash(pixels, row_bytes):
    """The XXH64 of the XXH64s of a plane's strips of 128 rows."""
    strips = range(0, len(pixels), 128 * row_bytes)
    return xxh64(b"".join(xxh64(pixels[at:at + 128 * row_bytes]).to_bytes(8, "little") for at in strips))


class Picture:
    """A frame on its way, of raw colour and depth as f32. It starts as background, or as a copy of its base."""
    def __init__(self, begin, request, base=None):
        for field in ("width", "height", "planes"):
            expect(getattr(begin, field) == request[field], f"FRAME_BEGIN has another {field} than FRAME")
        self.begin, self.bytes, self.rectangle, self.data = begin, 0, None, b""
        if base:
            self.planes = {plane: bytearray(pixels) for plane, pixels in base.planes.items()}
        else:
            empty = {COLOR: bytes(begin.background), DEPTH: struct.pack("<f", math.inf)}
            self.planes = {plane: bytearray(pixel * (begin.width * begin.height))
                           for plane, pixel in empty.items() if begin.planes >> plane & 1}

    def add(self, rect):
        """Takes a RECT: a rectangle, or a piece of one."""
        rectangle = (rect.plane, rect.codec, rect.scale, rect.x, rect.y, rect.w, rect.h, rect.total)
        expect(rect.plane in self.planes and rect.codec == 0, "RECT is not in the asked planes, or not raw")
        expect(rect.scale in (1, 2, 4), "RECT has an unknown scale")
        expect(1 <= rect.w <= self.begin.width - rect.x and 1 <= rect.h <= self.begin.height - rect.y,
               "RECT is not within the picture")
        expect(self.rectangle in (None, rectangle) and rect.offset == len(self.data), "RECT is not the next piece")
        size, scale = PIXEL_BYTES[rect.plane], rect.scale
        row = -(-rect.w // scale) * size  # rounded up
        expect(rect.total == -(-rect.h // scale) * row, "RECT has another size than its pixels")
        expect(1 <= rect.bytes == len(rect.rest) <= rect.total - rect.offset, "RECT's piece is not as long as it says")
        self.rectangle, self.data, self.bytes = rectangle, self.data + rect.rest, self.bytes + rect.bytes
        if len(self.data) < rect.total:
            return
        for y in range(rect.h):
            pixels = self.data[y // scale * row:(y // scale + 1) * row]
            if scale > 1:
                pixels = b"".join(pixels[at:at + size] * scale for at in range(0, row, size))[:rect.w * size]
            at = ((rect.y + y) * self.begin.width + rect.x) * size
            self.planes[rect.plane][at:at + len(pixels)] = pixels
        self.rectangle, self.data = None, b""

    def end(self, end):
        """Takes FRAME_END; returns its hashes by plane."""
        expect(self.rectangle is None, "FRAME_END comes within a rectangle")
        expect((end.pass_, end.planes) == (self.begin.pass_, self.begin.planes), "FRAME_END is not that of FRAME_BEGIN")
        n_hashes = len(self.planes) * end.has_hashes
        expect(len(end.rest) >= 8 * n_hashes + ENTRY_BYTES * end.n_entries, "FRAME_END is too short")
        hashes = dict(zip(self.planes, struct.unpack_from(f"<{n_hashes}Q", end.rest)))
        for plane, hash_ in hashes.items():
            if plane_hash(self.planes[plane], self.begin.width * PIXEL_BYTES[plane]) != hash_:
                raise Trouble(4, f"plane {plane} of the picture does not have the hash of FRAME_END: it is damaged")
        return hashes

    def write(self, path):
        """As PNG. Its rows begin with the number of their filter; 0 is none."""
        width, height, row = self.begin.width, self.begin.height, 3 * self.begin.width
        rows = b"".join(b"\0" + self.planes[COLOR][y * row:(y + 1) * row] for y in range(height))
        with open(path, "wb") as file:
            file.write(b"\x89PNG\r\n\x1a\n")
            for kind, data in ((b"IHDR", struct.pack(">IIBBBBB", width, height, 8, 2, 0, 0, 0)),
                               (b"IDAT", zlib.compress(rows)), (b"IEND", b"")):
                file.write(struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data)))
