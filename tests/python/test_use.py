# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What people do with the package in their first hour."""
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

import planar_mapping as pm
from conftest import K, PLANAR_MAP, T_WORLD_CAMERA, cloud_of, depth_of_wall, planar_map

VIEWER = pathlib.Path(PLANAR_MAP).with_name("planar_map_viewer")


def depth_map(image, **options):
    made = pm.PlanarMap(resolution=0.1)
    made.insert_depth(image, K, T=T_WORLD_CAMERA, **options)
    return made


def test_depth_is_metres_as_floats_and_millimetres_as_integers():
    depth = depth_of_wall(3.04)
    metres = depth_map(depth)
    millimetres = depth_map((1000 * depth).astype(np.uint16))
    assert metres.bounds()[1, 0] == pytest.approx(3.04, abs=0.1)
    np.testing.assert_allclose(metres.bounds(), millimetres.bounds(), atol=1e-3)


@pytest.mark.parametrize("image, options, words", [
    (1000 * depth_of_wall(3.04), {}, "all depths are beyond max_depth.*depth_scale"),  # millimetres as floats
    ((1000 * depth_of_wall(3.04)).astype(np.uint16), {"depth_scale": 1.0}, "all depths are beyond max_depth"),
    (depth_of_wall(3.04), {"depth_scale": 1000.0}, "all depths are below 1 cm"),
])
def test_depths_that_cannot_be_are_refused(image, options, words):
    with pytest.raises(pm.InputError, match=words):
        depth_map(image, **options)
    assert depth_map(np.zeros((120, 160))).frames == 1  # nothing measured is no error


@pytest.mark.parametrize("factor", [2, 0.5])
def test_matrix_of_images_of_another_size_is_refused(factor):
    other = K.copy()
    other[:2] *= factor
    with pytest.raises(pm.InputError, match="K is of images of another size.*the image has 160 x 120"):
        pm.PlanarMap().insert_depth(depth_of_wall(3.04), other)
    cropped = K.copy()
    cropped[1, 2] = 10.0  # the upper part of an image
    pm.PlanarMap().insert_depth(depth_of_wall(3.04), cropped)


@pytest.mark.parametrize("call, words", [
    (lambda: pm.PlanarMap(resolutoin=0.1), r"PlanarMap\(\) has no argument 'resolutoin'; did you mean 'resolution'\?"),
    (lambda: pm.PlanarMap().insert_depth(depth_of_wall(3.0), K, scale=1.0), "did you mean 'depth_scale'"),
    (lambda: pm.segment(np.zeros((3, 3)), distance_treshold=0.1), "did you mean 'distance_threshold'"),
    (lambda: pm.PlanarMap().bounds(frames=3), "bounds.. has no argument 'frames'; it has none"),
    (lambda: pm.run("a", "b", overwite=True), "did you mean 'overwrite'"),
])
def test_misspelled_keywords_name_the_nearest(call, words):
    with pytest.raises(TypeError, match=words):
        call()


def test_run_chooses_the_configuration_as_the_command_does(sequence, tmp_path):
    metrics = pm.run(sequence, tmp_path / "python")
    planar_map("run", sequence, "-o", tmp_path / "command", "-q")
    assert metrics["planes"] > 0
    assert (tmp_path / "python/map.pmap").read_bytes() == (tmp_path / "command/map.pmap").read_bytes()


def test_state_of_a_box(wall_map):
    state, cuboids = wall_map.state_of_box([3.0, 0.5, 0.5], [3.1, 1.0, 1.0])
    assert state == pm.OCCUPIED and len(cuboids) > 0
    assert wall_map.cuboids()["center"][cuboids][:, 0] == pytest.approx(3.04, abs=0.1)
    assert wall_map.state_of_box([1.0, 0.0, 0.9], [1.5, 0.1, 1.1])[0] == pm.FREE
    state, cuboids = wall_map.state_of_box([9.0, 0.0, 0.9], [9.5, 0.1, 1.1])
    assert state == pm.UNKNOWN and len(cuboids) == 0
    with pytest.raises(pm.ParameterError):
        wall_map.state_of_box([1.0, 0.0, 0.0], [0.0, 0.0, 0.0])


def test_mesh_is_the_cuboids(wall_map):
    vertices, faces = wall_map.mesh()
    count = len(wall_map)
    assert vertices.shape == (8 * count, 3) and faces.shape == (12 * count, 3)
    a, b, c = (vertices[faces[:, i]] for i in range(3))
    volumes = np.einsum("ij,ij->i", a, np.cross(b, c)).reshape(count, 12).sum(axis=1) / 6  # outwards: positive
    np.testing.assert_allclose(volumes, wall_map.cuboids()["size"].prod(axis=1), rtol=1e-9)
    low, high = wall_map.bounds()
    np.testing.assert_allclose([vertices.min(axis=0), vertices.max(axis=0)], [low, high], atol=1e-9)


def test_arrays_fit_into_open3d(wall_map):
    o3d = pytest.importorskip("open3d", reason="Open3D is not installed (python3-open3d)")
    vertices, faces = wall_map.mesh()
    mesh = o3d.geometry.TriangleMesh(o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces))
    assert len(mesh.triangles) == 12 * len(wall_map)
    assert mesh.get_max_bound()[0] == pytest.approx(wall_map.bounds()[1, 0])
    cloud = o3d.geometry.PointCloud(o3d.utility.Vector3dVector(cloud_of(depth_of_wall(3.04)).reshape(-1, 3).astype(float)))
    made = pm.PlanarMap()
    made.insert(np.asarray(cloud.points), T_WORLD_CAMERA)
    assert len(made) > 0


def test_columns_fit_into_a_data_frame(wall_map):
    table = pm.columns(wall_map.cuboids())
    assert list(table)[:3] == ["center_x", "center_y", "center_z"] and "orientation_w" in table and "plane_id" in table
    assert {column.shape for column in table.values()} == {(len(wall_map),)}
    np.testing.assert_array_equal(table["size_z"], wall_map.cuboids()["size"][:, 2])
    with pytest.raises(TypeError, match="a table with fields"):
        pm.columns(np.zeros((3, 3)))
    pandas = pytest.importorskip("pandas", reason="pandas is not installed (python3-pandas)")
    assert pandas.DataFrame(table).shape == (len(wall_map), 13)


def test_sequences_are_read_frame_by_frame(sequence):
    frames = pm.Sequence(sequence)
    assert len(frames) == 3 and "3 frames" in repr(frames)
    times, poses = pm.read_poses(sequence / "poses.txt")
    for i, frame in enumerate(frames):
        np.testing.assert_allclose(frame["T"], poses[i], atol=1e-9)
        assert frame["timestamp"] == pytest.approx(times[i])
        cloud, _ = pm.read_cloud(sequence / "clouds" / f"{i:06}.pcd")
        np.testing.assert_array_equal(frame["xyz"], cloud)
    assert frames[-1]["name"] == frame["name"]
    with pytest.raises(IndexError):
        frames[3]
    with pytest.raises(pm.IoError):
        pm.Sequence(sequence / "nothing")


def test_calibration_is_read(tmp_path):
    (tmp_path / "calib.yaml").write_text("image_width: 640\nimage_height: 480\nfx: 525\nfy: 524\ncx: 319.5\ncy: 239.5\ndepth_scale: 5000\n")
    read = pm.read_calibration(tmp_path / "calib.yaml")
    assert read["K"].tolist() == [[525, 0, 319.5], [0, 524, 239.5], [0, 0, 1]]
    assert read["size"] == (640, 480) and read["depth_scale"] == 5000 and read["baseline"] is None and read["rectified"]


def test_poses_of_clouds_are_found(tmp_path):
    planar_map("simulate", "room", "--write", "images", "--frames", "60", "--width", "160", "--height", "120", "-o", tmp_path, "--force", "-q")
    matrix = pm.read_calibration(tmp_path / "calib.yaml")["K"]
    rows, columns = np.mgrid[:120, :160]
    frames = []
    for path, T in list(zip(sorted((tmp_path / "depth_gt").glob("*.png")), pm.read_poses(tmp_path / "poses.txt")[1]))[:6]:
        z = pm.read_depth(path) / 1000
        z[z == 0] = np.nan
        xyz = np.stack([(columns - matrix[0, 2]) * z / matrix[0, 0], (rows - matrix[1, 2]) * z / matrix[1, 1], z], axis=-1)
        frames.append({"xyz": xyz.astype(np.float32), "T": T})
    odometry = pm.Odometry()
    assert np.array_equal(odometry.add(frames[0]["xyz"], frames[0]["T"]), frames[0]["T"])
    for frame in frames[1:]:
        T = odometry.add(frame["xyz"])
        assert np.linalg.norm(T[:3, 3] - frame["T"][:3, 3]) < 0.02
        assert np.arccos(min(1.0, (np.trace(T[:3, :3].T @ frame["T"][:3, :3]) - 1) / 2)) < np.radians(0.5)
    away = frames[0]["xyz"] * np.float32(0.2)
    assert odometry.add(away) is None


def test_show_makes_a_page(wall_map, tmp_path):
    try:
        page = wall_map.show(tmp_path / "map.html", open_browser=False)
    except pm.ParameterError as error:
        pytest.skip(str(error))
    assert pathlib.Path(page.path).stat().st_size > 500_000
    assert page._repr_html_().startswith("<iframe srcdoc=") and "<script" in page._repr_html_()


@pytest.mark.skipif(not VIEWER.exists(), reason="planar_map_viewer was not built")
def test_snapshot_draws_the_map(wall_map, tmp_path):
    wall_map.snapshot(tmp_path / "map.png", size=(320, 240), color="height")
    picture = (tmp_path / "map.png").read_bytes()
    assert picture[:4] == b"\x89PNG" and int.from_bytes(picture[16:20], "big") == 320
    with pytest.raises(pm.OutputExistsError, match="overwrite=True"):
        wall_map.snapshot(tmp_path / "map.png")
    with pytest.raises(pm.Error, match="sideways"):
        wall_map.snapshot(tmp_path / "other.png", camera="sideways")


def test_missing_numpy_says_what_to_install(tmp_path):
    (tmp_path / "numpy.py").write_text("raise ImportError('no NumPy')\n")
    environment = dict(os.environ, PYTHONPATH=os.pathsep.join([str(tmp_path), os.environ.get("PYTHONPATH", "")]))
    done = subprocess.run([sys.executable, "-c", "import planar_mapping"], env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 1 and "planar_mapping needs NumPy (apt-get install python3-numpy" in done.stderr
