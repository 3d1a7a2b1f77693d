# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import pathlib
import sqlite3
import struct
import subprocess
import sys

import numpy as np
import pytest

import planar_mapping
from conftest import planar_map

pytest.importorskip("planar_mapping._atlas", reason="built without Ceres or SQLite")

FORMAT_PAGE = pathlib.Path(__file__).parents[2] / "docs/atlas_format.md"


def rigid(x=0.0):
    return struct.pack("<12d", 1, 0, 0, x, 0, 1, 0, 0, 0, 0, 1, 0)


@pytest.fixture
def path(tmp_path, wall_map):
    """Two submaps with a keyframe each, written by sqlite3 as docs/atlas_format.md has it."""
    seed = tmp_path / "a.atlas"
    schema = FORMAT_PAGE.read_text().split("```sql\n")[1].split("```")[0]
    data = sqlite3.connect(seed)
    data.executescript(schema + f"PRAGMA application_id = {0x504d4154}; PRAGMA user_version = 4;")
    data.execute("INSERT INTO sessions VALUES (0, 'wall', 'version: 1')")
    pmap = wall_map.__reduce_ex__(2)[2]
    camera = struct.pack("<7d", 100, 101, 79.5, 59.5, 0.5, 0, 0.01)
    features = struct.pack("<6d", 1, 2, 0.25, 3, 4, 0.5)
    for i in range(2):
        data.execute("INSERT INTO submaps VALUES (?, 0, 0, ?)", (i, rigid(0.5 * i)))
        data.execute("INSERT INTO maps VALUES (?, ?)", (i, pmap))
        data.execute(
            "INSERT INTO keyframes VALUES (?, ?, ?, 'a.png', ?, ?, ?, 160, 120, ?, ?, 2, ?, 3, ?, x'', 0, 0)",
            (i, i, 7 + i, 0.5 * i, rigid(2.0), camera, features, b"abcd", struct.pack("<6H", *range(6)), b"\x89PNG"),
        )
    covariance = np.diag([1e-4] * 6).astype("<f8").tobytes()
    for i, kind in enumerate(["neighbour", "loop"]):
        data.execute("INSERT INTO links VALUES (?, ?, 'used', 0, 1, 0, 1, ?, ?, 40, 50, 20, 0.9, 0.01, 4.5, 1.5)", (i, kind, rigid(-0.5), covariance))
    data.commit()
    data.close()
    return seed


def test_rows_are_what_the_file_holds(path, wall_map):
    atlas = planar_mapping.Atlas(path)
    assert repr(atlas) == "<Atlas of 2 submaps, 2 keyframes, 2 links>"
    assert atlas.sessions() == [{"id": 0, "source": "wall", "configuration": "version: 1"}]
    submap = atlas.submaps()[1]
    assert submap["component"] == 0 and submap["T"][0, 3] == 0.5
    assert (submap["map"].cuboids() == wall_map.cuboids()).all()
    keyframe = atlas.keyframes()[1]
    assert keyframe["frame"] == 8 and keyframe["size"] == (160, 120) and keyframe["K"][1, 1] == 101
    assert keyframe["features"].tolist() == [[1, 2, 0.25], [3, 4, 0.5]]
    assert keyframe["descriptors"].tobytes() == b"abcd" and keyframe["descriptors"].shape == (2, 2)
    assert keyframe["inverse_depths"].tolist() == [[0, 1, 2], [3, 4, 5]]
    assert keyframe["thumbnail"] == b"\x89PNG"
    assert keyframe["points"].shape == (0, 3) and keyframe["is_scan"] is False
    link = atlas.links()[1]
    assert link["kind"] == "loop" and link["state"] == "used" and link["to_keyframe"] == 1
    assert link["covariance"].shape == (6, 6) and link["T"][0, 3] == -0.5 and link["residual"] == 1.5


def test_a_component_is_a_map_and_a_trajectory(path, tmp_path):
    atlas = planar_mapping.Atlas(str(path))
    planar_map("atlas", "export", path, tmp_path / "map.pmap")
    atlas.map().save(tmp_path / "same.pmap")
    assert (tmp_path / "map.pmap").read_bytes() == (tmp_path / "same.pmap").read_bytes()
    times, poses = atlas.trajectory()
    assert times.tolist() == [0.0, 0.5] and poses[:, 0, 3].tolist() == [2.0, 2.5]
    for ask in (atlas.map, atlas.trajectory):
        with pytest.raises(planar_mapping.InputError, match="has no component 5"):
            ask(5)


def test_loops_are_refused_and_taken_back(path):
    atlas = planar_mapping.Atlas(path)
    atlas.solve(without_loops=[1])
    assert atlas.links()[1]["state"] == planar_mapping.Atlas(path).links()[1]["state"] == "refused"
    atlas.solve(with_loops=[1])
    assert planar_mapping.Atlas(path).links()[1]["state"] != "refused"
    with pytest.raises(planar_mapping.InputError, match="there is no loop 0"):
        atlas.solve(without_loops=[0])


@pytest.fixture(scope="module")
def room(tmp_path_factory):
    """A folder of image pairs, and the frames of it whose depth is known."""
    folder = tmp_path_factory.mktemp("room")
    planar_map("simulate", "room", "--write", "both", "--frames", "8", "--step", "0.1", "--width", "320", "--height", "240", "-o", folder, "-q")
    planar_map("run", folder, "-o", folder / "out", "--frames", "::2", "--atlas", folder / "room.atlas", "-q")
    pairs, clouds = planar_mapping.Sequence(folder), planar_mapping.Sequence(folder / "measured")
    return folder, [(pairs[i]["left"], clouds[i]["xyz"], pairs[i]["K"], pairs[i]["T"]) for i in range(8)]


def test_a_frame_is_found_where_it_is(room):
    folder, frames = room
    atlas = planar_mapping.Atlas(folder / "room.atlas")
    image, xyz, K, T = frames[3]
    place = atlas.localize(image, xyz, K)
    assert np.allclose(place["T"][:3, 3], T[:3, 3], atol=0.05) and np.allclose(place["T"][:3, :3], T[:3, :3], atol=0.02)
    assert (np.linalg.eigvalsh(place["covariance"]) > 0).all()
    assert (place["component"], place["session"], place["submap"]) == (0, 0, 0)
    assert place["inliers"] >= 12 and {"matches", "off_plane", "log_odds", "agreement", "seen_through"} <= place.keys()
    assert {row["id"] for row in atlas.keyframes()} >= {place["keyframe"]}
    assert atlas.localize_scan(np.ones((3, 3))) is None
    color = np.repeat(image[..., None], 3, axis=2) if image.ndim == 2 else image
    assert np.allclose(atlas.localize(color, xyz.astype(float), K)["T"], place["T"], atol=1e-3)
    atlas.solve()
    assert (atlas.localize(image, xyz, K)["T"] == place["T"]).all()


def test_a_frame_of_elsewhere_is_none(room, path):
    folder, frames = room
    image, xyz, K, _ = frames[3]
    atlas = planar_mapping.Atlas(folder / "room.atlas")
    assert atlas.localize(np.zeros_like(image), xyz, K) is None
    assert atlas.localize(image, np.full_like(xyz, np.nan), K) is None
    with pytest.raises(planar_mapping.InputError, match="as large as its image"):
        atlas.localize(image, xyz[1:], K)
    with pytest.raises(planar_mapping.InputError, match=r"shape \(H, W\)"):
        atlas.localize(image[0], xyz, K)
    with pytest.raises(TypeError, match="uint8"):
        atlas.localize(image.astype(float), xyz, K)
    with pytest.raises(planar_mapping.InputError, match="descriptors of another size"):
        planar_mapping.Atlas(path).localize(image, xyz, K)


def test_what_is_no_atlas_raises(tmp_path, path):
    with pytest.raises(planar_mapping.MissingFileError):
        planar_mapping.Atlas(tmp_path / "none.atlas")
    (tmp_path / "text.atlas").write_text("no database")
    with pytest.raises(planar_mapping.IoError, match="is no atlas"):
        planar_mapping.Atlas(tmp_path / "text.atlas")
    with pytest.raises(TypeError, match="did you mean 'component'"):
        planar_mapping.Atlas(path).map(componnent=1)


def test_the_import_loads_neither_ceres_nor_opencv():
    code = "import planar_mapping; print('ceres' in open('/proc/self/maps').read())"
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout == "False\n"
