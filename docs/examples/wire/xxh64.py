"""XXH64, as doc/xxhash_spec.md of github.com/Cyan4973/xxHash describes it."""
import struct

P1, P2, P3 = 0x9E3779B185EBCA87, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9
P4, P5 = 0x85EBCA77C2B2AE63, 0x27D4EB2F165667C5
MASK = 2**64 - 1


def rotate(x, bits):
    x &= MASK
    return (x << bits | x >> (64 - bits)) & MASK


def mix(accumulator, lane):
    return rotate(accumulator + lane * P2, 31) * P1 & MASK


def xxh64(data, seed=0):
    n_stripes = len(data) // 32
    a, b, c, d = seed + P1 + P2, seed + P2, seed, seed - P1
    for i, j, k, l in struct.iter_unpack("<4Q", data[:32 * n_stripes]):
        a, b, c, d = mix(a, i), mix(b, j), mix(c, k), mix(d, l)
    if n_stripes:
        h = rotate(a, 1) + rotate(b, 7) + rotate(c, 12) + rotate(d, 18)
        for accumulator in (a, b, c, d):
            h = ((h ^ mix(0, accumulator)) * P1 + P4) & MASK
    else:
        h = seed + P5
    h = h + len(data) & MASK

    tail = data[32 * n_stripes:]
    while len(tail) >= 8:
        h = rotate(h ^ mix(0, int.from_bytes(tail[:8], "little")), 27) * P1 + P4 & MASK
        tail = tail[8:]
    if len(tail) >= 4:
        h = rotate(h ^ int.from_bytes(tail[:4], "little") * P1 & MASK, 23) * P2 + P3 & MASK
        tail = tail[4:]
    for byte in tail:
        h = rotate(h ^ byte * P5 & MASK, 11) * P1 & MASK

    h = (h ^ h >> 33) * P2 & MASK
    h = (h ^ h >> 29) * P3 & MASK
    return h ^ h >> 32
