# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
# Prints what a map file holds and lists its cuboids (docs/file_format.md): python3 read_map.py map.pmap
import sys
import zlib

import numpy as np
import zstandard

class Section:
    def __init__(self, data):
        self.data, self.at = data, 0

    def column(self, n, dtype):
        size = np.dtype(dtype).itemsize
        planes = np.frombuffer(self.data, np.uint8, n * size, self.at).reshape(size, n)
        self.at += n * size
        return planes.T.copy().view(dtype).reshape(n)

    def columns(self, n, dtype, count):
        return np.stack([self.column(n, dtype) for _ in range(count)], axis=1)

    def count(self):
        return int(self.column(1, "<u8")[0])

    def labels(self, n):
        packed = self.column((n + 3) // 4, "u1")
        return (packed[:, None] >> [0, 2, 4, 6] & 3).reshape(-1)[:n]

    def tree(self, dimensions, side):
        # Regions, and the labels of their cells: [region, tile or block, cell]
        n, bundles = self.count(), 8**dimensions
        regions = self.columns(n, "<i2", dimensions).astype(int)
        labels = np.repeat(self.labels(n)[:, None], bundles, axis=1)
        labels[labels[:, 0] == 3] = self.labels(bundles * (labels[:, 0] == 3).sum()).reshape(-1, bundles)
        cells = np.repeat(labels[..., None], side**dimensions, axis=2)
        cells[labels == 3] = self.labels(side**dimensions * (labels == 3).sum()).reshape(-1, side**dimensions)
        return regions, cells

def cells_of(regions, cells, label, side):  # lattice coordinates of the cells with a label
    region, bundle, cell = np.nonzero(cells == label)
    axes = range(regions.shape[1])
    return np.stack([(8 * regions[region, k] + bundle // 8**k % 8) * side + cell // side**k % side for k in axes], axis=1)

if len(sys.argv) != 2:
    sys.exit("usage: python3 read_map.py map.pmap")
try:
    data = open(sys.argv[1], "rb").read()
except OSError as error:
    sys.exit(f"{sys.argv[1]}: {error.strerror}")
if data[:4] != b"PMAP" or data[4:5] != b"\5":
    sys.exit(f"{sys.argv[1]}: no planar map of version 5")
is_finished = data[5] == 1
size, checksum = int.from_bytes(data[8:16], "little"), int.from_bytes(data[16:20], "little")
if zlib.crc32(data[20:], zlib.crc32(data[:16])) != checksum:
    sys.exit(f"{sys.argv[1]}: the map is damaged")
content, at, sections = zstandard.ZstdDecompressor().decompress(data[20:], size), 0, {}
while at < size:
    name, length = content[at : at + 8].rstrip(b"\0").decode(), int.from_bytes(content[at + 8 : at + 16], "little")
    sections[name] = Section(content[at + 16 : at + 16 + length])
    at += 16 + length
params = dict(line.split() for line in sections["PARAMS"].data.decode().splitlines())
print("finished" if is_finished else "full", "map, resolution", params["resolution"], "m")
c = sections["CUBOIDS"]
orientations = c.columns(c.count(), "<f8", 4)  # quaternions x y z w
n = c.count()
orientation, plane_id = c.column(n, "<u4"), c.column(n, "<i4")
probability = np.ones(n) if is_finished else c.column(n, "<f4")
steps = c.column(6 * n, "<u4").reshape(6, n).T.astype(int) - 1  # folded: 0, -1, 1, -2, 2, ...
lengths = np.where(steps % 2, -(steps + 1) // 2, steps // 2) * (0.25 * float(params["resolution"]))
lengths[steps < 0] = c.column(c.count(), "<f8")  # centre x y z, size u v n
# What is in no region of the tree is unknown with `unseen unknown`, else free.
space = sections["SPACE"].tree(3, 4)[1]
print("free cells", (space == 0).sum())
print("unknown cells", (space == 2).sum())
if not is_finished:
    planes, cells = sections["PLANES"], sections["CELLS"]
    planes.column(1, "<i4")  # the next id
    print("planes", planes.count())
    print("plane cells", len(cells_of(*cells.tree(2, 8), 1, 8)))
    cells.columns(1, "<i4", 3)  # where regions of non-planar cells start
    print("other cells", len(cells_of(*cells.tree(3, 4), 1, 4)))
    print("frames", sections["POSES"].count())
print("cuboids", n)
for i in range(n):
    print(*lengths[i], *orientations[orientation[i]], plane_id[i], probability[i])
