# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import numpy as np
import pytest
from conftest import K, cloud_of, depth_of_wall

import planar_mapping as pm

CLOUD = np.zeros((10, 3), np.float32)
IMAGE = np.ones((120, 160), np.uint16)


def turned(value):
    T = np.eye(4)
    T[0, 0] = value
    return T


@pytest.mark.parametrize("call, error, message", [
    (lambda m: m.state(np.zeros((3, 2))), pm.InputError, r"points must have the shape \(N, 3\), not \(3, 2\)"),
    (lambda m: m.state(np.zeros((2, 2, 3))), pm.InputError, r"not \(2, 2, 3\)"),
    (lambda m: m.state(1.0), pm.InputError, r"not \(\)"),
    (lambda m: m.state(["a", "b", "c"]), TypeError, "points must be an array of numbers, not of <U1"),
    (lambda m: m.state(None), TypeError, "not of object"),
    (lambda m: m.probability(np.zeros((3, 3), complex)), TypeError, "complex"),
    (lambda m: m.probability(np.zeros((3, 3), bool)), TypeError, "bool"),
    (lambda m: m.cast_rays(np.zeros((3, 3)), np.ones((2, 3))), pm.InputError, "3 origins, but 2 directions"),
    (lambda m: m.cast_rays(np.zeros(3), [[1, 0, 0], [np.nan, 0, 1]]), pm.ParameterError, "ray 1: "),
    (lambda m: m.cast_rays(np.zeros(3), np.zeros(3)), pm.ParameterError, "ray 0: "),
    (lambda m: m.cast_rays(np.zeros(3), np.ones(3), -1.0), pm.ParameterError, "range"),
    (lambda m: m.insert(np.zeros(3)), pm.InputError, r"xyz must have the shape \(N, 3\)"),
    (lambda m: m.insert(np.zeros((10, 4))), pm.InputError, r"not \(10, 4\)"),
    (lambda m: m.insert(CLOUD, np.eye(3)), pm.InputError, r"T must be a matrix of shape \(4, 4\), not \(3, 3\)"),
    (lambda m: m.insert(CLOUD, np.ones((4, 4))), pm.InputError, "last row"),
    (lambda m: m.insert(CLOUD, turned(2.0)), pm.InputError, "not orthonormal"),
    (lambda m: m.insert(CLOUD, turned(np.nan)), pm.InputError, "^T is not finite"),
    (lambda m: m.insert(CLOUD, K=K), pm.InputError, "organized"),
    (lambda m: m.insert(CLOUD, planes=pm.segment(CLOUD[:5])), pm.InputError, "of 5 points, this one has 10"),
    (lambda m: m.insert(CLOUD, planes="wall"), TypeError, "incompatible function arguments"),
    (lambda m: m.insert(CLOUD, distance_threshold=-1.0), pm.ParameterError, "distance_threshold"),
    (lambda m: m.insert(CLOUD, min_inliers=0), pm.ParameterError, "min_inliers"),
    (lambda m: m.insert_depth(np.zeros((4, 5, 1)), K), pm.InputError, r"\(H, W\), not \(4, 5, 1\)"),
    (lambda m: m.insert_depth("depth.png", K), TypeError, "incompatible function arguments"),
    (lambda m: m.insert_depth(np.zeros((0, 5)), K), pm.InputError, r"\(0, 5\)"),
    (lambda m: m.insert_depth(IMAGE.astype(bool), K), TypeError, "of numbers, not of bool"),
    (lambda m: m.insert_depth(IMAGE, np.eye(4)), pm.InputError, r"K must be a matrix of shape \(3, 3\)"),
    (lambda m: m.insert_depth(IMAGE, np.ones((3, 3))), pm.InputError, "K must be"),
    (lambda m: m.insert_depth(IMAGE, np.diag([0.0, 1.0, 1.0])), pm.ParameterError, "fx"),
    (lambda m: m.insert_depth(IMAGE, np.diag([np.nan, 1.0, 1.0])), pm.ParameterError, "fx"),
    (lambda m: m.insert_depth(IMAGE, K, 0.0), pm.ParameterError, "depth_scale"),
    (lambda m: m.insert_depth(IMAGE, K, max_depth=np.nan), pm.ParameterError, "max_depth"),
    (lambda m: m.export("map.nix"), pm.ParameterError, "extension"),
    (lambda m: m.save("/nowhere/map.pmap"), pm.IoError, "/nowhere/"),
    (lambda m: m.save("map.txt"), pm.ParameterError, r"saved as \*.pmap"),
    (lambda m: pm.PlanarMap.load("nowhere.pmap"), FileNotFoundError, "nowhere.pmap: no such file"),
    (lambda m: pm.PlanarMap(-1.0), pm.ParameterError, "resolution = -1 m"),
    (lambda m: pm.PlanarMap(np.nan), pm.ParameterError, "resolution"),
    (lambda m: pm.PlanarMap(profile="large"), pm.InputError, "must be one of compact, paper"),
    (lambda m: pm.PlanarMap(up=[0, 0]), pm.InputError, "up"),
    (lambda m: pm.PlanarMap(up=[0, 0, 0]), pm.ParameterError, "up"),
    (lambda m: pm.segment(CLOUD, method="best"), pm.InputError, "automatic, multi_ransac"),
    (lambda m: pm.segment(CLOUD, distance_threshold=np.nan), pm.ParameterError, "distance_threshold"),
    (lambda m: pm.approximate(CLOUD, resolution=0.0), pm.ParameterError, "resolution"),
    (lambda m: pm.approximate(1e6 * np.random.default_rng(1).normal(size=(1000, 3))), pm.InputError, "metres"),
    (lambda m: pm.read_cloud(__file__), pm.IoError, "neither a PCD nor a PLY"),
    (lambda m: pm.read_depth(__file__), pm.IoError, "PNG"),
])
def test_mistakes_get_a_sentence_and_change_nothing(call, error, message):
    made = pm.PlanarMap()
    with pytest.raises(error, match=message):
        call(made)
    assert made.frames == 0


def test_errors_are_those_python_knows():
    assert issubclass(pm.InputError, ValueError) and issubclass(pm.ParameterError, ValueError)
    assert issubclass(pm.IoError, OSError) and issubclass(pm.OutputExistsError, FileExistsError)
    assert issubclass(pm.MissingFileError, FileNotFoundError) and issubclass(pm.MissingFileError, pm.IoError)
    assert issubclass(pm.ConfigError, ValueError) and issubclass(pm.OutputExistsError, pm.IoError)
    for name in ["InputError", "ParameterError", "IoError", "ConfigError", "OutputExistsError"]:
        assert issubclass(getattr(pm, name), pm.Error) and getattr(pm, name).__module__ == "planar_mapping"


def test_points_without_a_measurement_are_left_out():
    made = pm.PlanarMap()
    cloud = cloud_of(depth_of_wall(3.0))
    cloud[::7] = np.nan
    cloud[1, 1] = np.inf
    lost = np.isnan(cloud[..., 0]).sum() + 1
    assert made.insert(cloud).dropped_points >= lost
    assert pm.segment(cloud).labels[0, 0] == -1
    assert made.insert(np.full((10, 3), np.nan)).dropped_points == 10
    assert made.insert(np.empty((0, 3))).cells_added == 0
    assert "cells_added=0" in repr(made.insert(np.empty((0, 3))))


def test_what_is_too_far_away_is_not_lost_in_silence():
    utm = np.random.default_rng(1).uniform(0, 10, (1000, 3)) + [450000.0, 5400000.0, 300.0]
    with pytest.raises(pm.InputError, match="farther from the origin than a map reaches"):
        pm.PlanarMap().insert(utm)
    with pytest.raises(pm.InputError, match="farther from the origin than a map reaches"):
        pm.approximate(utm)
