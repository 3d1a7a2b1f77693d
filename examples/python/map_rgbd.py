# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Maps depth images and draws the map: python3 map_rgbd.py [SEQUENCE] [PICTURE.png]

SEQUENCE is a folder with calib.yaml, depth/ and poses.txt (docs/quick_start.md), by default ../data/rgbd_icl_five."""
import pathlib
import sys

import matplotlib
import numpy as np

matplotlib.use("Agg")
import matplotlib.pyplot as plt  # noqa: E402
from mpl_toolkits.mplot3d.art3d import Poly3DCollection  # noqa: E402

import planar_mapping  # noqa: E402


def rotation_of(quaternion):
    x, y, z, w = quaternion
    return np.array([[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
                     [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
                     [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]])


def pose_of(line):
    """A line of a TUM file: timestamp tx ty tz qx qy qz qw."""
    T = np.eye(4)
    T[:3, :3], T[:3, 3] = rotation_of(line[4:8]), line[1:4]
    return line[0], T


def z_up(T_world_camera):
    """Turns a world whose vertical is another axis, to tell by what is upwards in an image."""
    up = -T_world_camera[:3, 1]
    axis = np.argmax(np.abs(up))
    T = np.eye(4)
    T[2, :3] = np.sign(up[axis]) * np.eye(3)[axis]
    T[0, :3] = np.eye(3)[(axis + 1) % 3]
    T[1, :3] = np.cross(T[2, :3], T[0, :3])
    return T


# %% The sequence
here = pathlib.Path(__file__).resolve().parent
folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else here.parent / "data/rgbd_icl_five"
picture = sys.argv[2] if len(sys.argv) > 2 else "map.png"
if not (folder / "calib.yaml").is_file():
    sys.exit(f"{folder}: there is no calib.yaml in it; docs/quick_start.md describes the folder")
lines = [line.split("#")[0].split(":") for line in (folder / "calib.yaml").read_text().splitlines()]
calibration = {line[0]: float(line[1]) for line in lines if len(line) == 2}
K = np.array([[calibration["fx"], 0.0, calibration["cx"]], [0.0, calibration["fy"], calibration["cy"]], [0.0, 0.0, 1.0]])
frames = [(path, *pose_of(line)) for path, line in
          zip(sorted((folder / "depth").glob("*.png")), np.loadtxt(folder / "poses.txt", ndmin=2))]
turn = z_up(frames[0][2])

# %% The map
world = planar_mapping.PlanarMap(resolution=0.1, max_range=8.0)
for path, time, T_world_camera in frames:
    depth = planar_mapping.read_depth(path)
    world.insert_depth(depth, K, calibration["depth_scale"], turn @ T_world_camera, timestamp=time)
print(f"{world.frames} frames, {len(world.planes())} planes, {len(world)} cuboids")

# %% What is at half the height of the map? Where do rays from the last camera end there?
(low, high), (times, poses) = world.bounds(), world.trajectory()
height = 0.5 * (low[2] + high[2])
x, y = np.meshgrid(np.arange(low[0], high[0], 0.05), np.arange(low[1], high[1], 0.05))
state = world.state(np.stack([x, y, np.full_like(x, height)], axis=-1).reshape(-1, 3)).reshape(x.shape)
angles = np.radians(np.arange(0, 360, 5))
rays = world.cast_rays([*poses[-1, :2, 3], height], np.stack([np.cos(angles), np.sin(angles), 0 * angles], axis=-1), 20.0)
ends = rays["point"][rays["state"] == planar_mapping.OCCUPIED]

# %% A picture of it
figure = plt.figure(figsize=(12, 5))
left = figure.add_subplot(1, 2, 1)
left.set_title(f"state at z = {height:.2f} m: free, occupied, unknown")
left.imshow(state, origin="lower", extent=(low[0], high[0], low[1], high[1]), vmin=0, vmax=2, interpolation="nearest",
            cmap=matplotlib.colors.ListedColormap(["white", "black", "lightgray"]))
left.plot(poses[:, 0, 3], poses[:, 1, 3], "b.-", label="path")
left.plot(ends[:, 0], ends[:, 1], "r.", label="ends of rays")
left.legend()
right = figure.add_subplot(1, 2, 2, projection="3d")
right.set_title(f"{len(world)} cuboids, coloured by plane")
cuboids = world.cuboids()
signs = np.array([[i & 1, i >> 1 & 1, i >> 2] for i in range(8)]) - 0.5  # of the eight corners
for cuboid in cuboids[cuboids["center"][:, 2] < low[2] + 0.8 * (high[2] - low[2])]:  # without the ceiling
    corners = cuboid["center"] + (signs * cuboid["size"]) @ rotation_of(cuboid["orientation"]).T
    faces = [corners[face] for face in ([0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5])]
    right.add_collection3d(Poly3DCollection(faces, facecolor=plt.cm.tab20(cuboid["plane_id"] % 20), edgecolor="gray", linewidth=0.2))
right.auto_scale_xyz(*zip(low, high))
right.set_box_aspect(high - low)
from_path = poses[:, :2, 3].mean(axis=0) - 0.5 * (low + high)[:2]
right.view_init(elev=40, azim=np.degrees(np.arctan2(from_path[1], from_path[0])))
figure.savefig(picture, dpi=100)
print(picture)
