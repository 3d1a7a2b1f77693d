# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import os
import signal
import subprocess
import sys

import numpy as np
import pytest
from conftest import planar_map

import planar_mapping as pm


def test_run_is_the_program(sequence, tmp_path):
    seen = []
    metrics = pm.run("pcd_sequence.yaml", sequence, tmp_path / "ours", settings={"kl_occupancy.enabled": False},
                     threads=1, progress=lambda done, frames, report: seen.append((done, frames, report["planes"])))
    planar_map("run", "pcd_sequence.yaml", "-i", sequence, "-o", tmp_path / "theirs", "-q",
               "--set", "kl_occupancy.enabled=false")
    assert (tmp_path / "ours/map.pmap").read_bytes() == (tmp_path / "theirs/map.pmap").read_bytes()
    assert metrics["frames"] == 3 and [entry[:2] for entry in seen] == [(1, 3), (2, 3), (3, 3)]
    assert len(pm.PlanarMap.load(tmp_path / "ours/map.pmap")) == metrics["cuboids"]["total"]
    with pytest.raises(pm.OutputExistsError, match="overwrite=True"):
        pm.run("pcd_sequence.yaml", sequence, tmp_path / "ours")
    clouds = sorted((sequence / "clouds").iterdir())
    again = pm.run("pcd_sequence.yaml", clouds, str(tmp_path / "ours"), frames="0:2", overwrite=True)
    assert again["frames"] == 2


def test_insert_makes_the_map_of_the_program_by_default(sequence, tmp_path):
    cloud = sorted((sequence / "clouds").iterdir())[0]
    xyz, _ = pm.read_cloud(cloud)
    for name, points in [("organized", xyz), ("dense", xyz[np.isfinite(xyz).all(axis=-1)])]:
        file = tmp_path / f"{name}.pcd"
        shape = points.shape[:-1] if points.ndim == 3 else (1, len(points))
        header = ("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
                  f"WIDTH {shape[1]}\nHEIGHT {shape[0]}\nPOINTS {shape[0] * shape[1]}\nDATA binary\n")
        file.write_bytes(header.encode() + points.astype(np.float32).tobytes())
        pm.run("single_pcd.yaml", file, tmp_path / name)
        world = pm.PlanarMap()
        world.insert(points)
        expected = pm.PlanarMap.load(tmp_path / name / "map.pmap")
        assert len(expected) > 10 and world.resolution == expected.resolution
        assert np.array_equal(world.cuboids(), expected.cuboids())
        assert np.array_equal(pm.approximate(points)["center"], expected.cuboids()["center"])
        assert len(pm.segment(points)) >= len(expected.planes())


def test_bad_configurations_list_their_problems(sequence, tmp_path):
    config = tmp_path / "bad.yaml"
    config.write_text("version: 1\nstages:\n  - stage: multi_plane_segmentation\n    distance_treshold_m: 1\n  - stage: x\n")
    with pytest.raises(pm.ConfigError) as caught:
        pm.run(config, sequence, tmp_path / "out")
    assert len(caught.value.problems) == 2 and "did you mean 'distance_threshold_m'" in caught.value.problems[0]
    with pytest.raises(pm.ConfigError, match="ready: .*single_pcd.yaml"):
        pm.run("no_such.yaml", sequence, tmp_path / "out")
    up = "planar_cuboid_approximation.up"
    with pytest.raises(pm.ConfigError, match=r"^settings: .*up=\[0.0, 1.0\]: .* not a list of 2"):
        pm.run("single_pcd.yaml", sequence, tmp_path / "out", settings={up: np.array([0.0, 1.0])})
    for vector in [np.array([0.0, 0.0, 1.0]), (0, 0, 1)]:  # the configuration is read before the input
        with pytest.raises(pm.MissingFileError):
            pm.run("single_pcd.yaml", "nowhere.pcd", tmp_path / "out", settings={up: vector})
    with pytest.raises(pm.IoError, match="nowhere.pcd"):
        pm.run("single_pcd.yaml", "nowhere.pcd", tmp_path / "out")
    with pytest.raises(TypeError):
        pm.run("single_pcd.yaml", 7, tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_what_progress_raises_ends_the_run_and_saves_it(sequence, tmp_path):
    def fail(done, frames, report):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        pm.run("pcd_sequence.yaml", sequence, tmp_path / "out", progress=fail)
    assert 1 <= pm.PlanarMap.load(tmp_path / "out/map.pmap").frames < 3  # a frame in work is ended


def test_interrupt_ends_the_run_and_saves_it(sequence, tmp_path):
    with pytest.raises(KeyboardInterrupt):
        pm.run("pcd_sequence.yaml", sequence, tmp_path / "out",
               progress=lambda done, frames, report: os.kill(os.getpid(), signal.SIGINT))
    assert 1 <= pm.PlanarMap.load(tmp_path / "out/map.pmap").frames < 3
    metrics = pm.run("pcd_sequence.yaml", sequence, tmp_path / "out", resume=True)
    assert metrics["frames"] == 3


def test_import_loads_neither_opencv_nor_pcl_io():
    code = "import planar_mapping; print(open('/proc/self/maps').read())"
    maps = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout
    assert "libplanar_mapping_map" in maps and "opencv" not in maps and "vtk" not in maps.lower()


def test_maps_in_the_coordinates_of_a_country_say_their_origin(sequence, tmp_path):
    poses = tmp_path / "utm.txt"
    lines = [line.split() for line in (sequence / "poses.txt").read_text().splitlines() if not line.startswith("#")]
    poses.write_text("".join(" ".join([t, str(float(x) + 501000), str(float(y) + 4500000), *rest]) + "\n" for t, x, y, *rest in lines))
    pm.run("pcd_sequence.yaml", sorted((sequence / "clouds").iterdir()), tmp_path / "out", poses=poses)
    made = pm.PlanarMap.load(tmp_path / "out/map.pmap")
    assert made.origin.tolist() == [501000.0, 4500000.0, 0.0] and abs(made.bounds()).max() < 100
    assert pm.PlanarMap().origin.tolist() == [0.0, 0.0, 0.0]
