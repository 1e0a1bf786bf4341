"""The messages of proto/PROTOCOL.md that client.py speaks: its tables, and what packs and unpacks by them."""
import math
import struct
from types import SimpleNamespace

# A payload is a line of NAME:LETTERS, with the letters of the module struct, or "string"; "7x" are reserved bytes.
CAMERA = "camera_kind:B 7x camera_eye:3d camera_target:3d camera_up:3d camera_extent:d camera_near_z:d"
SETTINGS = "settings_scale:B settings_smooth:B settings_pass:B settings_splats:B 4x settings_spacing_px:d"
FORMAT = "width:I height:I planes:I color_codec:B color_quality:B depth_format:B depth_codec:B data_codec:B"
MESSAGES = {
    "HELLO": (1, "magic:8s routing_key:Q major:H minor:H 4x capabilities:Q 16x token:string client:string"),
    "WELCOME": (2, "major:H minor:H 4x capabilities:Q max_message:I max_side:I max_pixels:I max_instances:I "
                   "max_lights:I max_scenes:I max_open:I max_models:I idle_timeout_ms:I 4x server:string"),
    "GOODBYE": (3, "reason:H 2x text:string"),
    "PING": (4, "token:Q"),
    "PONG": (5, "token:Q"),
    "ERROR": (6, "code:H 2x text:string"),
    "LIST": (16, ""),
    "LIST_ENTRY": (17, "state:B 7x file_bytes:Q content_id:16s name:string"),
    "LIST_END": (18, "n_entries:I"),
    "OPEN": (19, "resolution:H levels:B 1x name:string"),
    "PROGRESS": (20, "stage:H 6x done:Q total:Q"),
    "OPENED": (21, "handle:I representations:B colors:B octree_levels:B of_levels:B content_id:16s box_min:3d box_max:3d "
                   "origin:3d scale:d spacing:d resolution:I n_levels:I n_samples:Q n_blocks:Q bytes:Q up:3d"),
    "SCENE": (32, "slot:H flags:H n_instances:H n_lights:H ambient:d background:3B 5x"),  # INSTANCEs and LIGHTs follow
    "FRAME": (33, f"slot:H pass_limit:H {FORMAT} budget:B flags:H time_budget_us:Q error_bound:d {SETTINGS} "
                  f"base:I 4x {CAMERA} depth_min:d depth_max:d"),
    "FRAME_BEGIN": (34, f"pass_:H base_pass:H {FORMAT} background:3B base:I refine:H 2x {SETTINGS} "
                        f"depth_min:d depth_max:d {CAMERA}"),
    "RECT": (35, "plane:B codec:B scale:B 1x x:H y:H w:H h:H total:I offset:I bytes:I"),  # data follow
    "FRAME_END": (36, "pass_:H final:B status:B planes:I error_px:d n_entries:H has_hashes:B 5x "
                      "depth_min:d depth_max:d"),  # hashes and ENTRIES follow
    "SUPERSEDED": (37, "by:I"),
    "ACK": (39, "pass_:H 2x"),
}
NAMES = {number: name for name, (number, _) in MESSAGES.items()}
INSTANCE = "handle:I representation:B color_by:B 2x rotation:4d translation:3d scale:d"
LIGHT = "kind:B flags:B color:3B 3x intensity:d position:3d direction:3d inner:d outer:d reference:d"
ENTRY_BYTES = 18

MAGIC = bytes.fromhex("89 70 73 72 70 0D 0A 1A")
COLOR, DEPTH = 0, 1  # planes
VIEWS, REFINE, BASE, SCALES, RESOLUTION, SHARP = (1 << bit for bit in (0, 1, 2, 5, 21, 22))  # capabilities
FLAG_SHARP = 2  # of FRAME


class Trouble(Exception):
    """A sentence for people, and the exit code, as psr's: 3 file or model, 4 bad data, 5 limit, 6 connection, ..."""
    def __init__(self, status, text):
        super().__init__(text)
        self.status = status


def expect(condition, otherwise):
    if not condition:
        raise Trouble(6, f"the server broke the protocol: {otherwise}")


def fields_of(table):
    for field in table.split():
        name, _, letters = field.rpartition(":")
        yield name, letters


def pack(table, **values):
    """The bytes of a payload; fields that are not named are 0 or empty."""
    data = b""
    for name, letters in fields_of(table):
        value = values.pop(name, None)
        if letters == "string":
            text = (value or "").encode()
            data += struct.pack("<H", len(text)) + text
        elif value is None:
            data += bytes(struct.calcsize("<" + letters))
        else:
            data += struct.pack("<" + letters, *(value if isinstance(value, (tuple, list)) else [value]))
    assert not values, f"no such fields: {values}"
    return data


def unpack(table, data):
    """The fields of a payload, and as `rest` the bytes behind them."""
    fields, at = SimpleNamespace(), 0
    for name, letters in fields_of(table):
        size = struct.calcsize("<H" if letters == "string" else "<" + letters)
        expect(at + size <= len(data), "a payload is too short")
        value = struct.unpack_from("<H" if letters == "string" else "<" + letters, data, at)
        at += size
        if letters == "string":
            text, at = data[at:at + value[0]], at + value[0]
            value = [text.decode(errors="replace")]
            expect(at <= len(data) and len(text) <= 511, "a text is too long")
            expect(value[0].encode() == text, "a text is not UTF-8")
            expect(not any(c < " " or "\x7f" <= c <= "\x9f" for c in value[0]), "a text has control characters")
        expect(all(math.isfinite(x) for x in value if isinstance(x, float)), "a number is not finite")
        expect(name or not any(data[at - size:at]), "a reserved field is not 0")
        if name:
            setattr(fields, name, value[0] if len(value) == 1 else value)
    fields.rest = data[at:]
    return fields
