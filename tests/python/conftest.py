# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import os
import subprocess

import numpy as np
import pytest

import planar_mapping

PLANAR_MAP = os.environ["PLANAR_MAP"]  # the program that was built
K = np.array([[100.0, 0.0, 79.5], [0.0, 100.0, 59.5], [0.0, 0.0, 1.0]])


def depth_of_wall(distance):
    """A wall ahead of a camera of 160 x 120 pixels, with a step of half a metre in its right half."""
    depth = np.full((120, 160), distance)
    depth[:, 80:] -= 0.5
    return depth


def cloud_of(depth):
    rows, columns = np.mgrid[: depth.shape[0], : depth.shape[1]]
    xyz = np.stack([(columns - K[0, 2]) * depth / K[0, 0], (rows - K[1, 2]) * depth / K[1, 1], depth], axis=-1)
    return xyz.astype(np.float32)


# A camera that looks along x of the world, a metre above the ground.
T_WORLD_CAMERA = np.array([[0.0, 0.0, 1.0, 0.0], [-1.0, 0.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0], [0.0, 0.0, 0.0, 1.0]])


@pytest.fixture(scope="session")
def wall_map():
    made = planar_mapping.PlanarMap(resolution=0.1)
    made.insert(cloud_of(depth_of_wall(3.04)), T_WORLD_CAMERA, timestamp=2.5)
    return made


@pytest.fixture(scope="session")
def sequence(tmp_path_factory):
    """Three clouds of a simulated room, with poses."""
    folder = tmp_path_factory.mktemp("room")
    planar_map("simulate", "room", "--frames", "3", "--width", "160", "--height", "120", "-o", folder, "--force", "-q")
    return folder


def planar_map(*arguments):
    return subprocess.run([PLANAR_MAP, *map(str, arguments)], check=True, capture_output=True, text=True)
