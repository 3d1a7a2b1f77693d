# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Plans of a simulated room: the same in Python and in files, read back by the programs they are for."""
import shutil
import subprocess

import numpy as np
import pytest

import planar_mapping as pm

SENSOR = np.array([2.0, 1.5, 0.5])


def scan(low=(0.0, 0.0, 0.0), high=(5.0, 3.0, 2.4), pillar=((3.5, 1.2), (3.9, 1.6))):
    """Ranges of all directions in a room with a pillar."""
    azimuth, elevation = np.meshgrid(np.radians(np.arange(0, 360, 0.5)), np.radians(np.arange(-60, 60, 0.75)))
    rays = np.stack([np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)], -1)
    with np.errstate(divide="ignore", invalid="ignore"):
        limits = np.where(rays > 0, np.array(high), np.array(low))
        ranges = np.nanmin(np.where(rays == 0, np.inf, (limits - SENSOR) / rays), -1)
        sides = [(np.array(side) - SENSOR[:2]) / rays[..., :2] for side in pillar]
        enter, leave = np.minimum(*sides).max(-1), np.maximum(*sides).min(-1)
    ranges = np.where((enter < leave) & (enter > 0), np.minimum(ranges, enter), ranges)
    return (ranges[..., None] * rays).astype(np.float32).reshape(-1, 3)


@pytest.fixture(scope="module")
def room():
    made = pm.PlanarMap(resolution=0.1)
    T = np.eye(4)
    T[:3, 3] = SENSOR
    made.insert(scan(), T)
    return made


def test_a_plan_is_an_array_with_an_origin(room):
    plan = room.plan()
    assert plan.values.dtype == np.int8 and set(np.unique(plan.values)) == {-1, 0, 100}
    assert plan.is_standable(2.0, 1.5) and not plan.is_standable(3.7, 1.4) and not plan.is_standable(9.0, 1.5)
    column, row = ((np.array([2.0, 1.5]) - plan.origin) / plan.cell).astype(int)
    assert plan.values[row, column] == 0 and abs(plan.heights[row, column]) < 0.06
    assert 8.0 < plan.cell**2 * (plan.values == 0).sum() < 15.0
    # The pillar's near face is 1.5 m away and in one of two cells.
    assert 1.35 < plan.distances()[row, column] < 1.6
    assert "m2 free" in plan.note and len(room.plans()) == 1
    tall = room.plan(pm.Robot(height=3.0))
    assert (tall.values == 0).sum() < 0.1 * (plan.values == 0).sum() and "--robot-height" in tall.note
    with pytest.raises(pm.ParameterError):
        pm.Robot(height=-1.0)
    with pytest.raises(IndexError):
        room.plan(storey=1)


def test_files_hold_the_same_plan(room, tmp_path):
    room.export(tmp_path / "plan.pgm", distance=True)
    plan = room.plan()
    head, _, pixels = (tmp_path / "plan.pgm").read_bytes().partition(b"\n255\n")
    assert head.startswith(b"P5") and (tmp_path / "plan.yaml").read_text().count("robot 1.2 m high") == 1
    values = np.frombuffer(pixels, np.uint8).reshape(plan.values.shape)[::-1]
    assert (values == np.select([plan.values == 0, plan.values == 100], [254, 0], 205)).all()
    assert np.array_equal(np.load(tmp_path / "plan.npy"), plan.distances())


def test_a_dxf_is_read_by_ezdxf(room, tmp_path):
    ezdxf = pytest.importorskip("ezdxf")
    room.export(tmp_path / "plan.dxf")
    drawing = ezdxf.readfile(tmp_path / "plan.dxf")
    assert not drawing.audit().has_errors
    walls = list(drawing.modelspace().query("POLYLINE[layer=='WALLS']"))
    points = np.array([[v.dxf.location.vec2 for v in wall.vertices] for wall in walls])
    assert len(walls) >= 4 and all(wall.is_closed for wall in walls)
    assert np.allclose(points.min((0, 1)), [0.0, 0.0], atol=0.2) and np.allclose(points.max((0, 1)), [5.0, 3.0], atol=0.2)


def test_an_svg_is_drawn_by_rsvg(room, tmp_path):
    if shutil.which("rsvg-convert") is None:
        pytest.skip("rsvg-convert is not installed")
    image = pytest.importorskip("matplotlib.image")
    room.export(tmp_path / "plan.svg")
    subprocess.run(["rsvg-convert", "-w", "600", tmp_path / "plan.svg", "-o", tmp_path / "plan.png"], check=True)
    pixels = image.imread(tmp_path / "plan.png")[..., :3]
    is_wall, is_floor = (pixels.max(-1) < 0.35), (np.abs(pixels - [0.91, 0.933, 0.957]).max(-1) < 0.01)
    assert 0.005 < is_wall.mean() < 0.3 and 0.25 < is_floor.mean() < 0.8
