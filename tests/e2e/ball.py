"""ball.py FILE N colors|scan: writes a LAS file of N points of a ball of radius 10, at survey coordinates, in no order.
Either they are red above and blue below, or their classes are 2 and 6 by halves, their returns by thirds from top to
bottom, and their intensity by height."""
import math, random, struct, sys

path, n, is_scan = sys.argv[1], int(sys.argv[2]), sys.argv[3] == "scan"
random.seed(1)
header = bytearray(227)
header[0:4] = b"LASF"
header[24:26] = bytes([1, 2])
struct.pack_into("<HI", header, 94, 227, 227)
struct.pack_into("<BHI", header, 104, *((0, 20) if is_scan else (2, 26)), n)
struct.pack_into("<6d", header, 131, 0.001, 0.001, 0.001, 412000.0, 5312000.0, 120.0)
with open(path, "wb") as f:
    f.write(header)
    for i in range(n):
        z = 2 * random.random() - 1
        a = 2 * math.pi * random.random()
        r = math.sqrt(1 - z * z)
        at = [round(10000 * c) for c in (r * math.cos(a), r * math.sin(a), z)]
        if is_scan:
            number = 1 if z > 1 / 3 else 2 if z > -1 / 3 else 3
            kind = 2 if at[0] > 0 else 6
            f.write(struct.pack("<3iHBBBBH", *at, int(30000 * (1 - z)), number | 3 << 3, kind, 0, 0, 0))
        else:
            color = (60000, 5000, 5000) if z > 0 else (5000, 5000, 60000)
            f.write(struct.pack("<3iHBBBBH3H", *at, 0, 0, 2, 0, 0, 0, *color))
