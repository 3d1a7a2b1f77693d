# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import importlib.util
import os
import pathlib
import subprocess
import sys

import numpy as np
import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SCRIPT = ROOT / "scripts/public_trajectories.py"


@pytest.fixture(scope="module")
def ruler():
    spec = importlib.util.spec_from_file_location("public_trajectories", SCRIPT)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_error_is_what_a_rigid_motion_leaves(ruler):
    truth = np.random.default_rng(7).uniform(-3.0, 3.0, (200, 3))
    turn = np.linalg.qr(np.random.default_rng(8).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    assert ruler.absolute_error(truth, truth @ turn.T + [5.0, -2.0, 1.0]) == pytest.approx(0.0, abs=1e-9)
    off = np.tile([[0.1, 0.0, 0.0], [-0.1, 0.0, 0.0]], (100, 1))
    assert ruler.absolute_error(truth, (truth + off) @ turn.T) == pytest.approx(0.1, rel=0.05)
    mirrored = truth * [1.0, 1.0, -1.0]
    assert ruler.absolute_error(truth, mirrored) > 0.5


def test_frames_that_were_not_found_are_left_out(ruler):
    in_truth, in_estimate = ruler.matched(np.array([0.0, 1.0, 2.0, 3.0]), np.array([1.0, 2.5, 3.0]))
    assert in_truth.tolist() == [1, 3] and in_estimate.tolist() == [0, 2]


def test_a_sequence_is_measured(tmp_path):
    sequences = tmp_path / "data"
    sequences.mkdir()
    (sequences / "rgbd_icl_five").symlink_to(ROOT / "examples/data/rgbd_icl_five")
    tools = pathlib.Path(os.environ["PLANAR_MAP"]).parent
    command = [sys.executable, SCRIPT, sequences, "--bin", tools]
    nothing = subprocess.run(command, capture_output=True, text=True, check=False)
    assert nothing.returncode == 1 and "no sequence of the names" in nothing.stderr
    out = subprocess.run([*command, "--all", "--keep", tmp_path / "kept"], capture_output=True, text=True, check=True).stdout
    name, frames, found, error, bar = (cell.strip() for cell in out.splitlines()[-1].strip("|").split("|"))
    assert (name, frames, found, bar) == ("rgbd_icl_five", "5", "5", "")
    assert 0.0 < float(error) < 0.05
    assert (tmp_path / "kept/rgbd_icl_five/sequence.atlas").exists()
