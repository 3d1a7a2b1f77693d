# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import copy
import pickle
import threading

import numpy as np
import pytest
from conftest import K, T_WORLD_CAMERA, cloud_of, depth_of_wall, planar_map

import planar_mapping as pm

NEAR_WALL = cloud_of(depth_of_wall(3.04))


def mapped(xyz, **options):
    made = pm.PlanarMap(resolution=0.1)
    made.insert(xyz, T_WORLD_CAMERA, **options)
    return made


def test_a_wall_is_occupied_free_before_and_unknown_behind(wall_map):
    points = [[3.06, 1.0, 1.0], [1.5, 1.0, 1.0], [5.0, 1.0, 1.0], [np.nan, 0.0, 0.0]]
    assert wall_map.state(points).tolist() == [pm.OCCUPIED, pm.FREE, pm.UNKNOWN, pm.UNKNOWN]
    belief = wall_map.probability(points)
    assert belief[0] > 0.5 and belief[1:].tolist() == [0.0, 0.5, 0.5]


def test_cuboids_and_planes_are_structured_arrays(wall_map):
    cuboids = wall_map.cuboids()
    assert cuboids.dtype.names == ("center", "size", "orientation", "plane_id", "probability", "state")
    assert len(wall_map) == len(cuboids) > 0
    on_wall = cuboids[cuboids["plane_id"] == 0]
    assert np.allclose(on_wall["center"][:, 0], 3.09, atol=0.06)
    assert np.allclose(np.linalg.norm(cuboids["orientation"], axis=1), 1.0)
    assert (cuboids["state"] == pm.OCCUPIED).all() and (wall_map.unknown_cuboids()["state"] == pm.UNKNOWN).all()
    planes = wall_map.planes()
    assert np.allclose(planes["normal"], [-1.0, 0.0, 0.0], atol=1e-3)  # towards the sensor
    assert sorted(planes["offset"].round(2)) == [2.54, 3.04] and planes["frames"].tolist() == [1, 1]
    low, high = wall_map.bounds()
    assert low[0] < 2.6 and high[0] > 3.03
    assert pm.PlanarMap().bounds() is None and len(pm.PlanarMap().cuboids()) == 0


def test_what_is_returned_does_not_change_with_the_map():
    made = mapped(NEAR_WALL)
    before = made.cuboids()
    kept = before.copy()
    made.insert(cloud_of(depth_of_wall(2.0)), T_WORLD_CAMERA)
    assert (before == kept).all() and len(made.cuboids()) != len(kept)


@pytest.mark.parametrize("make", [
    lambda xyz: xyz.reshape(-1, 3).astype(np.float64),
    lambda xyz: np.concatenate([xyz, np.ones_like(xyz[..., :1])], axis=-1).reshape(-1, 4)[:, :3],  # every fourth float left out
    lambda xyz: np.asfortranarray(xyz.reshape(-1, 3)),
    lambda xyz: xyz.reshape(-1, 3)[::-1][::-1].copy()[:, :],
    lambda xyz: xyz.reshape(-1, 3).astype(">f4"),
    lambda xyz: xyz.reshape(-1, 3).tolist(),
])
def test_clouds_of_any_layout_give_the_same_map(make):
    expected = mapped(np.ascontiguousarray(NEAR_WALL.reshape(-1, 3)))
    assert (mapped(make(NEAR_WALL)).cuboids() == expected.cuboids()).all()


def test_parts_of_organized_clouds_are_read_as_they_are():
    wide = np.full((120, 170, 3), np.nan, np.float32)
    wide[:, 5:165] = NEAR_WALL
    assert (mapped(wide[:, 5:165], K=K).cuboids() == mapped(NEAR_WALL, K=K).cuboids()).all()


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_questions_of_any_layout_give_the_same_answers(wall_map, dtype):
    points = np.random.default_rng(1).uniform([0.0, -2.0, -0.5], [4.0, 2.0, 2.5], (500, 3)).astype(dtype)
    expected = wall_map.state(points.astype(np.float64))
    assert set(expected) == {pm.FREE, pm.OCCUPIED, pm.UNKNOWN}
    assert (wall_map.state(points) == expected).all()
    assert (wall_map.state(np.asfortranarray(points)) == expected).all()
    assert (wall_map.state(points[::-2]) == expected[::-2]).all()
    assert wall_map.state(points[0]).tolist() == expected[:1].tolist()
    assert wall_map.state(np.empty((0, 3))).shape == (0,)
    assert wall_map.state(np.zeros((2, 3), int)).shape == (2,)


def test_a_cloud_in_the_world_is_seen_from_the_origin_of_its_sensor():
    origin = np.array([1.5, -2.25, 0.5])
    seen = (np.round(NEAR_WALL @ T_WORLD_CAMERA[:3, :3].T * 1024) / 1024).reshape(-1, 3).astype(np.float32)
    T = np.eye(4)
    T[:3, 3] = origin
    posed, world = pm.PlanarMap(resolution=0.1), pm.PlanarMap(resolution=0.1)
    posed.insert(seen, T)
    world.insert((seen + origin).astype(np.float32), origin=origin)
    assert len(world) > 0 and np.array_equal(world.cuboids(), posed.cuboids())
    assert len(world.free_cuboids()) > 0
    planes = pm.segment((seen + origin).astype(np.float32))
    given = pm.PlanarMap(resolution=0.1)
    given.insert((seen + origin).astype(np.float32), origin=origin, planes=planes)
    assert len(given.planes()) == len(world.planes())
    with pytest.raises(pm.InputError, match="not both"):
        world.insert(seen, T, origin=origin)


def test_depth_images_are_clouds():
    depth = depth_of_wall(3.04)
    depth[10:20, 10:20] = 0.0
    cloud = cloud_of(depth)
    cloud[10:20, 10:20] = np.nan
    expected = mapped(cloud, K=K).cuboids()
    counts = (5000 * depth).round().astype(np.uint16)
    for image, scale in [(counts, 5000.0), (counts.astype(">u2"), 5000.0), (counts.astype(np.int32), 5000.0), (depth, 1.0), (depth.astype(np.float32), 1.0),
                         (np.where(depth > 0, depth, np.nan), 1.0), (np.where(depth > 0, depth, np.inf), 1.0)]:
        made = pm.PlanarMap(resolution=0.1)
        made.insert_depth(image, K, scale, T_WORLD_CAMERA)
        cuboids = made.cuboids()
        assert len(cuboids) == len(expected)  # the rays of pixels are rounded differently
        assert np.allclose(cuboids["center"], expected["center"], atol=1e-6)
        assert np.allclose(cuboids["size"], expected["size"], atol=1e-6)


def test_points_beyond_max_depth_clear_space_but_are_not_mapped():
    made = pm.PlanarMap(resolution=0.1)
    made.insert_depth(depth_of_wall(3.04), K, 1.0, T_WORLD_CAMERA, max_depth=2.7)
    assert made.state([[3.06, 1.0, 1.0], [2.9, 1.0, 1.0], [2.56, -1.0, 1.0]]).tolist()[1:] == [pm.FREE, pm.OCCUPIED]
    assert len(made.planes()) == 1


def test_rays_end_at_the_wall(wall_map):
    hits = wall_map.cast_rays([0.0, 0.0, 1.0], [[1.0, 0.4, 0.0], [1.0, -0.4, 0.0]], range=20.0)
    assert hits["state"].tolist() == [pm.OCCUPIED, pm.OCCUPIED]
    assert np.allclose(hits["point"][:, 0], [3.04, 2.54], atol=0.06)
    assert np.allclose(hits["distance"], np.linalg.norm(hits["point"] - [0.0, 0.0, 1.0], axis=1))
    assert (wall_map.cuboids()[hits["cuboid"]]["plane_id"] >= 0).all()
    behind = wall_map.cast_rays([[5.0, 1.0, 1.0]], [[1.0, 0.0, 0.0]])[0]
    assert behind["state"] == pm.UNKNOWN and behind["distance"] == 0.0 and behind["cuboid"] == -1
    nothing = wall_map.cast_rays([0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], 5.0, through_unknown=True)[0]
    assert nothing["distance"] == np.inf and nothing["state"] == pm.UNKNOWN and np.isnan(nothing["point"]).all()
    near = wall_map.cast_rays([0.0, 0.0, 1.0], [1.0, 0.4, 0.0], 2.0, through_unknown=True)[0]
    assert near["distance"] == np.inf and near["state"] == pm.FREE
    empty = pm.PlanarMap().cast_rays([0.0, 0.0, 0.0], [1.0, 0.0, 0.0], through_unknown=True)
    assert empty["state"].tolist() == [pm.UNKNOWN]


def test_segment_labels_points_and_serves_insert_and_approximate():
    planes = pm.segment(NEAR_WALL, distance_threshold=0.05)
    assert len(planes) == 2 and planes.labels.shape == (120, 160)
    assert (planes.labels[:, 85:] == planes.labels[0, 159]).all() and (planes.labels[:, :75] == planes.labels[0, 0]).all()
    for k in range(2):
        inliers = planes.inliers(k)
        assert (np.flatnonzero(planes.labels.ravel() == k) == inliers).all() and len(inliers) == planes.planes["inliers"][k]
        assert not inliers.flags.writeable
        off = NEAR_WALL.reshape(-1, 3)[inliers] @ planes.planes["normal"][k] + planes.planes["offset"][k]
        assert np.abs(off).max() < 0.05
    assert (mapped(NEAR_WALL, planes=planes).cuboids() == mapped(NEAR_WALL, distance_threshold=0.05).cuboids()).all()
    cuboids = pm.approximate(NEAR_WALL, T_WORLD_CAMERA, planes=planes)
    assert (cuboids == pm.approximate(NEAR_WALL, T_WORLD_CAMERA, distance_threshold=0.05)).all() and len(cuboids) > 0
    with pytest.raises(IndexError):
        planes.inliers(2)


def test_maps_are_those_of_the_program(sequence, tmp_path):
    """planar_map run with the same parameters."""
    config = tmp_path / "config.yaml"
    config.write_text("version: 1\nstages:\n  - stage: multi_plane_segmentation\n    distance_threshold_m: 0.05\n"
                      "  - stage: planar_cuboid_approximation\n    resolution_m: 0.1\n")
    made = pm.PlanarMap(resolution=0.1)
    clouds = sorted((sequence / "clouds").iterdir())
    for i, path in enumerate(clouds):
        xyz, T = pm.read_cloud(path)
        assert xyz.shape == (120, 160, 3) and xyz.dtype == np.float32
        made.insert(xyz, T, min_inliers=100, timestamp=i)
    planar_map("run", config, "-i", *clouds, "-o", tmp_path / "out", "-q")
    theirs = pm.PlanarMap.load(tmp_path / "out" / "map.pmap")
    assert theirs.frames == 3 and len(theirs) > 50
    assert (made.cuboids() == theirs.cuboids()).all() and (made.planes() == theirs.planes()).all()
    assert (made.trajectory()[1] == theirs.trajectory()[1]).all()


@pytest.mark.parametrize("extension", ["csv", "json", "ply", "obj", "sdf", "pmap", "bt", "glb", "pgm", "vtp"])
def test_exports_are_those_of_convert(wall_map, tmp_path, extension):
    ours, theirs = tmp_path / "ours", tmp_path / "theirs"
    for folder in (ours, theirs):
        folder.mkdir()
    wall_map.save(tmp_path / "map.pmap")
    wall_map.export(str(ours / f"map.{extension}"))
    planar_map("convert", tmp_path / "map.pmap", theirs / f"map.{extension}")
    written = {path.name: path.read_bytes() for path in ours.iterdir()}
    assert written and written == {path.name: path.read_bytes() for path in theirs.iterdir()}


def test_saved_copied_and_pickled_maps_are_the_same(wall_map, tmp_path):
    wall_map.save(tmp_path / "map.pmap")
    with pytest.raises(pm.IoError):
        wall_map.save(tmp_path / "map.pmap")
    wall_map.save(tmp_path / "map.pmap", overwrite=True)
    for other in [pm.PlanarMap.load(tmp_path / "map.pmap"), copy.copy(wall_map), copy.deepcopy(wall_map),
                  pickle.loads(pickle.dumps(wall_map))]:
        assert (other.cuboids() == wall_map.cuboids()).all() and other.resolution == 0.1
        assert other.trajectory()[0].tolist() == [2.5] and (other.trajectory()[1][0] == T_WORLD_CAMERA).all()
    finished = wall_map.finished()
    assert finished.is_finished and not wall_map.is_finished and len(finished) == len(wall_map)
    with pytest.raises(pm.InputError, match="finished"):
        finished.insert(NEAR_WALL)


def test_merging_moves_the_other_map(wall_map):
    T = np.eye(4)
    T[0, 3] = 10.0
    merged = copy.copy(wall_map)
    merged.merge(wall_map, T)
    assert merged.frames == 2 and merged.state([[3.06, 1.0, 1.0], [13.06, 1.0, 1.0]]).tolist() == [1, 1]
    merged.merge(merged)  # a map of itself does not wait for itself
    assert merged.frames == 2  # of the same times


def test_threads_ask_while_one_inserts():
    made = pm.PlanarMap(resolution=0.1)
    problems = []
    done = threading.Event()

    def ask():
        points = np.random.default_rng(2).uniform(-3.0, 3.0, (2000, 3))
        try:
            while not done.is_set():
                assert len(made.state(points)) == 2000
                made.cuboids()
        except Exception as problem:  # noqa: BLE001
            problems.append(problem)

    threads = [threading.Thread(target=ask) for _ in range(3)]
    for thread in threads:
        thread.start()
    for i in range(10):
        made.insert(cloud_of(depth_of_wall(3.0 + 0.01 * i)), T_WORLD_CAMERA)
    done.set()
    for thread in threads:
        thread.join()
    assert not problems and made.frames == 10


def test_long_calls_leave_the_interpreter_to_others(wall_map):
    points = np.random.default_rng(3).uniform([0.0, -2.0, -0.5], [4.0, 2.0, 2.5], (1_000_000, 3))
    thread = threading.Thread(target=wall_map.state, args=(points,))
    thread.start()
    steps = 0
    while thread.is_alive():
        steps += 1
    assert steps > 1000
