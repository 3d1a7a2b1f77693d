#!/usr/bin/env python3
"""Absolute trajectory errors on public sequences that you have, by the usual rule (rigid alignment, root mean square):

    scripts/public_trajectories.py FOLDER [--bin build/bin] [--frames ::2] [--keep DIR] [--all]

FOLDER has sequences under the names of their publishers, at any depth: rgbd_dataset_freiburg1_room, MH_01_easy, sequences/00 ...
--all takes any folder that planar_map reads and that has true poses. Poses are found from the images (motion_estimation.poses=ignore),
loops are closed (--atlas). trajectory_tum.txt in --keep is a file for evo: evo_ape tum truth_tum.txt trajectory_tum.txt -a.
Exit status 1 if no sequence was found.
"""
import argparse
import os
import re
import subprocess
import sys
import tempfile

import numpy as np

# Folder, and the error that good SLAM systems stay below, metres (None: no figure in common use).
SEQUENCES = [
    (r"rgbd_dataset_freiburg1_room", 0.06),
    (r"rgbd_dataset_freiburg1_desk", 0.03),
    (r"rgbd_dataset_freiburg2_desk", 0.03),
    (r"rgbd_dataset_freiburg3_long_office_household", 0.03),
    (r"living_room_traj\d\w*", None),
    (r"office_room_traj\d\w*|traj\d_frei_png", None),
    (r"MH_0\d_\w+|V\d_0\d_\w+", None),
    (r"sequences/00", 4.0),
    (r"sequences/05", 2.5),
    (r"sequences/07", 1.2),
]


def poses_of(path):
    """Times (N,) and positions (N, 3) of a file in the format of TUM."""
    rows = np.loadtxt(path, comments="#", ndmin=2)
    return rows[:, 0], rows[:, 1:4]


def absolute_error(truth, estimate):
    """Root mean square of the distances once the estimate (N, 3) was laid onto the truth (N, 3) by the best rigid motion."""
    a = estimate - estimate.mean(axis=0)
    b = truth - truth.mean(axis=0)
    u, _, vt = np.linalg.svd(b.T @ a)
    rotation = u @ np.diag([1.0, 1.0, np.sign(np.linalg.det(u @ vt))]) @ vt
    return float(np.sqrt(((a @ rotation.T - b) ** 2).sum(axis=1).mean()))


def matched(truth_times, times):
    """Indices into the truth and the estimate of poses of the same frame."""
    where = np.clip(np.searchsorted(truth_times, times), 1, len(truth_times) - 1)
    nearest = where - (times - truth_times[where - 1] < truth_times[where] - times)
    is_same = np.abs(truth_times[nearest] - times) < 1e-3
    return nearest[is_same], np.flatnonzero(is_same)


def sequences_in(folder, take_all):
    for path, names, files in os.walk(folder, followlinks=True):
        names.sort()
        tail = os.sep.join(path.split(os.sep)[-2:])
        for pattern, bar in SEQUENCES:
            if re.search(f"(^|/)({pattern})$", tail):
                yield path, bar
                names.clear()
                break
        else:
            if take_all and ("calib.yaml" in files or "poses.txt" in files):
                yield path, None
                names.clear()


def run(planar_map, folder, out, *options):
    command = [planar_map, "run", "-i", folder, "-o", out, "--force", "-q", *options]
    return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True, check=False)


def measured(planar_map, folder, frames, out):
    """(frames with a true pose, frames found, error in metres), or a sentence."""
    # The true poses of the frames, as the program reads them: of the camera, at the frames' times.
    given = run(planar_map, folder, os.path.join(out, "truth"), "--frames", frames, "--set", "motion_estimation.poses=use")
    if given.returncode != 0:
        return given.stderr.strip().splitlines()[-1]
    found = run(planar_map, folder, out, "--frames", frames, "--set", "motion_estimation.poses=ignore",
                "--atlas", os.path.join(out, "sequence.atlas"))
    if found.returncode != 0:
        return found.stderr.strip().splitlines()[-1]
    os.replace(os.path.join(out, "truth", "trajectory_tum.txt"), os.path.join(out, "truth_tum.txt"))
    truth_times, truth = poses_of(os.path.join(out, "truth_tum.txt"))
    times, estimate = poses_of(os.path.join(out, "trajectory_tum.txt"))
    in_truth, in_estimate = matched(truth_times, times)
    if len(in_truth) < 3:
        return f"only {len(in_truth)} frames have a true pose and were found"
    return len(truth), len(in_truth), absolute_error(truth[in_truth], estimate[in_estimate])


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__), "..", "build", "bin"))
    parser.add_argument("--frames", default="::1", help="first:last:step")
    parser.add_argument("--keep", help="folder for maps, trajectories and atlases")
    parser.add_argument("--all", action="store_true")
    arguments = parser.parse_args()
    planar_map = os.path.join(arguments.bin, "planar_map")
    any_found = False
    for folder, bar in sequences_in(arguments.folder, arguments.all):
        if not any_found:
            print("| sequence | frames | found | ATE rmse, m | bar, m |\n|---|---|---|---|---|")
        any_found = True
        with tempfile.TemporaryDirectory() as temporary:
            name = os.path.basename(folder)
            out = os.path.join(arguments.keep, name) if arguments.keep else temporary
            os.makedirs(out, exist_ok=True)
            result = measured(planar_map, folder, arguments.frames, out)
        figures = result if isinstance(result, str) else f"{result[0]} | {result[1]} | {result[2]:.4f}"
        print(f"| {name} | {figures} | {bar if bar else ''} |", flush=True)
    if not any_found:
        sys.exit(f"{arguments.folder}: no sequence of the names above; --all takes every folder with poses")


if __name__ == "__main__":
    main()
