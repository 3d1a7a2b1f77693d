#!/usr/bin/env python3
"""One survey of a simulated building as jobs: time, memory, bytes and errors against the number of frames.

    scripts/survey_scale.py FOLDER [--frames 500,2000,5000,20000] [--workers 1,2] [--bin build/bin]

Walks of 1,000 frames (a single one if fewer are wanted) through a building of 3 floors with 40 rooms each, with people; RGB-D frames of 160 x 120 are made by the job
that maps them. Poses are given as an odometer has them: off by 1.5 m and 5 degrees after a walk. Processor seconds are those of the jobs, one after the
other; memory is the largest of a job. ATE: root mean square of the distances of keyframes from the truth, each component aligned, walks without a link apart.
--workers: wall time of python3 -m planar_mapping.cluster for each number of workers instead.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import sqlite3
import subprocess
import sys
import time

import numpy

WALK = 1000  # frames
SIMULATE = ["--write", "description", "--floors", "3", "--rooms", "40", "--moving", "--width", "160", "--height", "120",
            "--baseline", "0.48", "--noise-px", "0.1", "--odometry-drift", "1.5,5"]


def walks_of(program, folder, frames):
    """Sequences of one length."""
    count, length = math.ceil(frames / WALK), min(frames, WALK)
    made = folder / f"walks_{count}_{length}"
    walks = [made / f"walk_{i}" for i in range(count)] if count > 1 else [made]
    if not made.exists():
        subprocess.run([program, "simulate", "building", *SIMULATE, "--walks", str(count), "--frames", str(length), "-q",
                        "-o", made], check=True)
    for walk in walks:
        if not (walk / "truth.txt").exists():
            (walk / "poses.txt").rename(walk / "truth.txt")
            (walk / "odometry.txt").rename(walk / "poses.txt")
    return walks


class Jobs:
    def __init__(self, program, log):
        self.program, self.log = program, log
        self.log.touch()
        self.done = {json.loads(line)["job"]: json.loads(line) for line in log.read_text().splitlines()}

    def run(self, phase, *arguments):
        name = " ".join([phase, *(word for word in arguments if word.isdigit())])
        if name not in self.done:
            with subprocess.Popen([self.program, "atlas", phase, *arguments], stdout=subprocess.DEVNULL) as process:
                _, status, usage = os.wait4(process.pid, 0)
                process.returncode = os.waitstatus_to_exitcode(status)
            if process.returncode != 0:
                sys.exit(f"{name} ended with {process.returncode}")
            self.done[name] = {"job": name, "seconds": usage.ru_utime + usage.ru_stime, "mb": usage.ru_maxrss / 1024}
            with self.log.open("a") as file:
                file.write(json.dumps(self.done[name]) + "\n")

    def of(self, phase):
        return [job for name, job in self.done.items() if name.split()[0] == phase]


def poses_of(path):
    """Frame -> position; of TUM lines."""
    return numpy.array([[float(word) for word in line.split()[1:4]] for line in path.read_text().splitlines() if line[:1] != "#"])


def aligned_error(found, truth):
    """Root mean square distance after the best rigid motion."""
    a, b = found - found.mean(0), truth - truth.mean(0)
    u, _, v = numpy.linalg.svd(a.T @ b)
    turn = numpy.diag([1, 1, numpy.sign(numpy.linalg.det(u @ v))])
    return math.sqrt(((a @ (u @ turn @ v) - b) ** 2).sum(1).mean())


def errors_of(atlas):
    """Of the largest component: keyframes in it, of all, ATE as given and as solved."""
    rows = sqlite3.connect(atlas).execute(
        "SELECT source, frame, component, T_world_submap, T_submap_keyframe FROM keyframes JOIN submaps ON submap = submaps.id")
    solved, given, true, component = [], [], [], []
    known = {}
    for source, frame, part, submap, key in rows:
        walk = pathlib.Path(source).parent
        if walk not in known:
            known[walk] = poses_of(walk / "poses.txt"), poses_of(walk / "truth.txt")
        world, local = (numpy.frombuffer(blob).reshape(3, 4) for blob in (submap, key))
        solved.append(world[:, :3] @ local[:, 3] + world[:, 3])
        given.append(known[walk][0][frame])
        true.append(known[walk][1][frame])
        component.append(part)
    largest = numpy.array(component) == max(set(component), key=component.count)
    solved, given, true = (numpy.array(one)[largest] for one in (solved, given, true))
    return int(largest.sum()), len(component), aligned_error(given, true), aligned_error(solved, true)


def measure(program, folder, frames):
    out = folder / f"out_{frames}"
    out.mkdir(parents=True, exist_ok=True)
    plan = out / "plan.json"
    if not plan.exists():
        subprocess.run([program, "atlas", "plan", *walks_of(program, folder, frames), "-o", plan, "-q"], check=True)
    pieces = len(json.loads(plan.read_text())["pieces"])
    jobs = Jobs(program, out / "jobs.log")
    for i in range(pieces):
        jobs.run("submap", str(plan), str(i), "-o", str(out))
    jobs.run("places", str(out))
    for i in range(1, pieces):
        jobs.run("links", str(plan), str(i), "-o", str(out))
    jobs.run("solve", str(out))
    jobs.run("join", str(out), "-o", str(out / "map.pmap"))
    said = json.loads((out / "survey.json").read_text())
    loops = sqlite3.connect(out / "survey.atlas").execute(
        "SELECT count(*), sum(state = 'used') FROM links WHERE kind = 'loop'").fetchone()
    within, keyframes, given, solved = errors_of(out / "survey.atlas")
    row = {"frames": frames, "submaps": said["submaps"], "loops": loops[0], "loops_used": loops[1] or 0,
           "components": len(said["components"])}
    for phase in ("submap", "places", "links", "solve", "join"):
        row[f"{phase}_s"] = round(sum(job["seconds"] for job in jobs.of(phase)), 2)
    row["job_mb"] = round(max(job["mb"] for job in jobs.of("submap") + jobs.of("links")))
    for phase in ("places", "solve", "join"):
        row[f"{phase}_mb"] = round(max(job["mb"] for job in jobs.of(phase)))
    row["atlas_mb"] = round((out / "survey.atlas").stat().st_size / 1e6, 1)
    row["map_kb"] = round((out / "map.pmap").stat().st_size / 1e3)
    row["plan_kb"] = round(plan.stat().st_size / 1e3)
    return {**row, "in_largest": round(within / keyframes, 3), "ate_given_m": round(given, 3), "ate_solved_m": round(solved, 3)}


def print_table(rows):
    print("| " + " | ".join(rows[0]) + " |")
    print("|---" * len(rows[0]) + "|")
    for row in rows:
        print("| " + " | ".join(f"{value:,}" for value in row.values()) + " |")
    if len(rows) < 2:
        return
    print("\nfit: value = c * frames ^ p")
    for name in rows[0]:
        values = [row[name] for row in rows]
        if name != "frames" and min(values) > 0 and name[-2:] in ("_s", "mb", "kb"):
            p, c = numpy.polyfit(numpy.log([row["frames"] for row in rows]), numpy.log(values), 1)
            print(f"{name}: p = {p:.2f}, c = {math.exp(c):.3g}")


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--frames", default="500,2000,5000,20000")
    parser.add_argument("--workers")
    parser.add_argument("--bin", default="build/bin")
    options = parser.parse_args()
    program = os.path.abspath(os.path.join(options.bin, "planar_map"))
    folder = options.folder.absolute()
    folder.mkdir(parents=True, exist_ok=True)
    counts = [int(word) for word in options.frames.split(",")]
    if options.workers is None:
        rows = []
        for frames in counts:
            rows.append(measure(program, folder, frames))
            print(json.dumps(rows[-1]), flush=True)
        print_table(rows)
        return
    environment = {**os.environ, "PYTHONPATH": os.path.abspath(os.path.join(options.bin, "../python"))}
    for frames in counts:
        walks = walks_of(program, folder, frames)
        for workers in options.workers.split(","):
            out = folder / f"by_{workers}_{frames}"
            shutil.rmtree(out, ignore_errors=True)
            start = time.monotonic()
            subprocess.run([sys.executable, "-m", "planar_mapping.cluster", *walks, "-o", out, "--workers", workers, "--program",
                            program], check=True, env=environment)
            print(f"{frames} frames, {workers} workers: {time.monotonic() - start:.1f} s", flush=True)


if __name__ == "__main__":
    main()
