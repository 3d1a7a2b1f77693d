#!/usr/bin/env python3
# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Writes inputs to begin fuzzing with: make_seeds.py PLANAR_MAP FOLDER. Needs numpy and zstandard.

tests/fuzz/corpus holds what scripts/fuzz.sh made of them; configurations are read from config/."""
import io
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import zlib

import numpy
import zstandard

program, root = sys.argv[1], pathlib.Path(sys.argv[2])
config = pathlib.Path(__file__).parents[2] / "config"
random.seed(1)


def seed(target, name, content):
    (root / target).mkdir(parents=True, exist_ok=True)
    (root / target / name).write_bytes(content.encode() if isinstance(content, str) else content)


def png(channels, bits, width=4, height=4):
    kind = {1: 0, 3: 2, 4: 6}[channels]
    row = b"\0" + bytes(random.randrange(256) for _ in range(width * channels * bits // 8))

    def chunk(name, content):
        return (struct.pack(">I", len(content)) + name + content +
                struct.pack(">I", zlib.crc32(name + content)))

    header = struct.pack(">IIBBBBB", width, height, bits, kind, 0, 0, 0)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
            chunk(b"IDAT", zlib.compress(row * height)) + chunk(b"IEND", b""))


def pcd(data, count, size=4):
    body = data if isinstance(data, bytes) else data.encode()
    kind = "ascii" if isinstance(data, str) else "binary"
    head = (f"# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE {size} {size} {size}\nTYPE F F F\n"
            f"COUNT 1 1 1\nWIDTH {count}\nHEIGHT 1\nVIEWPOINT 0 0 0 1 0 0 0\nPOINTS {count}\n")
    return head.encode() + f"DATA {kind}\n".encode() + body


points = numpy.random.default_rng(1).uniform(-1, 1, (8, 3)).astype(numpy.float32)
text = "\n".join(" ".join(str(v) for v in p) for p in points) + "\n"
binary = pcd(points.tobytes(), 8)
ply = "ply\nformat %s 1.0\nelement vertex 8\n" + "".join(
    f"property float {c}\n" for c in "xyz") + "end_header\n"
scan = numpy.hstack([points, points[:, :1]]).astype(numpy.float32).tobytes()
clouds = {
    "ascii": pcd(text, 8), "binary": binary, "double": pcd(points.astype(float).tobytes(), 8, 8),
    "compressed": binary.replace(b"DATA binary\n", b"DATA binary_compressed\n" + struct.pack(
        "<II", 99, 96) + b"".join(bytes([31]) + points.T.tobytes()[i:i + 32]
                                  for i in range(0, 96, 32))),
    "ply_ascii": (ply % "ascii" + text).encode(),
    "ply_binary": (ply % "binary_little_endian").encode() + points.tobytes(),
    "ply_big": (ply % "binary_big_endian").encode() + points.astype(">f4").tobytes(),
}
for name, content in clouds.items():
    seed("cloud", name, b"\0" + content)
seed("cloud", "scan", b"\1" + scan)

images = {"gray": png(1, 8), "rgb": png(3, 8), "rgba": png(4, 8), "depth": png(1, 16)}
try:
    from PIL import Image
    jpeg = io.BytesIO()
    Image.new("RGB", (8, 8), (9, 99, 200)).save(jpeg, "JPEG")
    images["jpeg"] = jpeg.getvalue()
except ImportError:
    pass
for name, content in images.items():
    seed("image", name, content)

tum = "# t x y z q\n0.0 0 0 0 0 0 0 1\n0.1 1.5 -2 0.3 0 0 0.6 0.8\n"
kitti = "1 0 0 0 0 1 0 0 0 0 1 0\n0 -1 0 2.5 1 0 0 1 0 0 1 1e-3\n"
seed("poses", "tum", tum)
seed("poses", "kitti", kitti)

camera = "image_width: 4\nimage_height: 4\nfx: 4.0\nfy: 4.0\ncx: 1.5\ncy: 1.5\n"
stereo = camera + "baseline_m: 0.12\n"
raw = camera + ("rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1]\ntranslation_m: [-0.1, 0, 0]\n"
                "k1: 0.1\nk2_right: -0.2\nfx_right: 4.5\n")
for name, content in {"rgbd": camera + "depth_scale: 5000\n", "stereo": stereo, "raw": raw}.items():
    seed("calibration", name, content)

for file in config.glob("*.yaml"):
    effective = subprocess.run([program, "config", "--effective", str(file)], check=True,
                               capture_output=True, text=True).stdout
    seed("configuration", "effective_" + file.stem, effective)


def word(value):
    return struct.pack("<I", len(value)) + value


def frame(encoding, points_of_cloud):
    pose = struct.pack("<12d", 1, 0, 0, 1, 0, 1, 0, 2, 0, 0, 1, 3)
    feature = struct.pack("<qifff3d", 7, 2, 1.0, 2.0, float("nan"), 0.1, 0.2, 2.0)
    return (struct.pack("<Qd", 1, 0.5) + word(b"left/0.png") + word(b"") + b"\0\1\0\0" + pose + b"\1" + pose +
            b"\1" + struct.pack("<4d2i", 4, 4, 0.5, 0.5, 2, 2) + b"\1" + struct.pack("<d", 0.12) +
            struct.pack("<3Q", 4, 1, 1) + struct.pack("<I", 1) + feature + struct.pack("<II", 0, 1) +
            word(b"stereo_ms") + struct.pack("<d", 3) + struct.pack("<Id", 1, 12.5) +
            struct.pack("<I", 1) + word(b"note") + struct.pack("<I", 0) +
            struct.pack("<IIBB", 2, 2, 0, encoding) + points_of_cloud)


seed("message", "envelope", b"\0" + struct.pack("<IHHQ", 0x45464D50, 6, 3, 1))
seed("message", "welcome", b"\1" + word(b"version: 1\n") + struct.pack("<QIQ", 3, 4, 65536))
seed("message", "count", b"\2" + struct.pack("<Q", 6))
seed("message", "bye", b"\3\1" + word(b"why"))
seed("message", "input", b"\4\0\2" + struct.pack("<QQ", 6, 77) + word(b"name"))
seed("message", "raw", b"\5" + frame(0, struct.pack("<12f", *range(12))) + word(b""))
seed("message", "compact", b"\5" + frame(1, b"\0" + b"\x81\x80\x80\x80\x08\1\2" * 3) + word(b"gray"))

for i in range(20):
    seed("session", str(i), bytes(random.randrange(256) for _ in range(20 + 10 * i)))
    seed("insert", str(i), bytes(random.randrange(256) for _ in range(100 + 80 * i)))

NAMES = [line.strip().strip('",') for line in
         (pathlib.Path(__file__).with_name("layout_names.inc")).read_text().splitlines()]


def folder(name, files):
    content = b""
    for path, data in files.items():
        data = data.encode() if isinstance(data, str) else data
        content += struct.pack("<BH", NAMES.index(path), len(data)) + data
    seed("layouts", name, content)


gray, depth = images["gray"], images["depth"]
euroc = ("sensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [1, 0, 0, %s, 0, 1, 0, 0, 0, 0,"
         " 1, 0, 0, 0, 0, 1]\nresolution: [4, 4]\ncamera_model: pinhole\nintrinsics: [4, 4, 1.5, "
         "1.5]\ndistortion_model: radial-tangential\ndistortion_coefficients: [0, 0, 0, 0]\n")
list_of = "#timestamp [ns],filename\n1,1.png\n"
matrices = "".join(f"P{i}: 4 0 1.5 {-0.5 * (i % 2)} 0 4 1.5 0 0 0 1 0\n" for i in range(4))
folder("clouds", {"clouds/0.pcd": clouds["ascii"], "poses.txt": tum.splitlines()[1] + "\n"})
folder("rgbd", {"calib.yaml": camera + "depth_scale: 5000\n", "depth/0.png": depth,
                "rgb/0.png": images["rgb"], "poses.txt": tum.splitlines()[1] + "\n"})
folder("stereo", {"calib.yaml": stereo, "left/0.png": gray, "right/0.png": gray})
folder("kitti", {"calib.txt": matrices, "times.txt": "0\n", "image_0/000000.png": gray,
                 "image_1/000000.png": gray, "poses.txt": kitti.splitlines()[0] + "\n"})
folder("velodyne", {"calib.txt": matrices + "Tr: 0 -1 0 0 0 0 -1 0 1 0 0 0\n", "times.txt": "0\n",
                    "velodyne/000000.bin": scan, "poses.txt": kitti.splitlines()[0] + "\n"})
folder("tum", {"calib.yaml": camera + "depth_scale: 5000\n", "depth.txt": "0.0 depth/0.png\n",
               "rgb.txt": "0.01 rgb/0.png\n", "depth/0.png": depth, "rgb/0.png": images["rgb"],
               "groundtruth.txt": tum})
folder("icl", {"associations.txt": "0 depth/0.png 0 rgb/0.png\n", "depth/0.png": depth,
               "rgb/0.png": images["rgb"], "traj.gt.freiburg": tum})
folder("middlebury", {"calib.txt": "cam0=[4 0 1.5; 0 4 1.5; 0 0 1]\ncam1=[4 0 1.6; 0 4 1.5; 0 0 1]"
                      "\ndoffs=0.1\nbaseline=100\nwidth=4\nheight=4\n",
                      "im0.png": gray, "im1.png": gray})
folder("euroc", {"mav0/cam0/sensor.yaml": euroc % "0", "mav0/cam1/sensor.yaml": euroc % "0.1",
                 "mav0/cam0/data.csv": list_of, "mav0/cam1/data.csv": list_of,
                 "mav0/cam0/data/1.png": gray, "mav0/cam1/data/1.png": gray,
                 "mav0/state_groundtruth_estimate0/data.csv":
                     "#t,x,y,z,w,x,y,z\n1,0,0,0,1,0,0,0\n"})
folder("posed", {"calib.yaml": camera + "depth_scale: 5000\n", "0.depth.png": depth,
                 "0.pose.txt": "1 0 0 0\n0 1 0 0\n0 0 1 0\n0 0 0 1\n"})

with tempfile.TemporaryDirectory() as work:
    for cells, count in [("1.0", 20), ("0.7", 30)]:  # small: many executions
        rng = numpy.random.default_rng(count)
        room = rng.uniform(-1, 1, (3 * count, 3))
        room[:count, 2] = -1
        room[count:2 * count, 0] = 1
        file = pathlib.Path(work) / "room.pcd"
        file.write_bytes(pcd(room.astype(numpy.float32).tobytes(), 3 * count))
        for profile in ("paper", "compact"):
            subprocess.run([program, "run", config / "single_pcd.yaml", "-i", file, "-o",
                            work + "/out", "--force", "-q", "--profile", profile, "--set",
                            "planar_cuboid_approximation.resolution_m=" + cells], check=True)
            subprocess.run([program, "convert", work + "/out/map.pmap", work + "/finished.pmap",
                            "--force", "--finished"], check=True, stdout=subprocess.DEVNULL)
            for flag, name in ((0, "out/map.pmap"), (1, "finished.pmap")):
                data = (pathlib.Path(work) / name).read_bytes()
                size = struct.unpack("<Q", data[8:16])[0]
                sections = zstandard.ZstdDecompressor().decompress(data[20:], max_output_size=size)
                seed("map", f"{profile}_{cells}_{flag}", bytes([flag]) + sections)
