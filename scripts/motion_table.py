#!/usr/bin/env python3
"""The motion found by planar_map and by the peer (benchmarks/motion/peer_motion.cpp) against the truth of sequence folders:

    scripts/motion_table.py DATA... [--bin build/bin] [--thin 1,2,3,5,8] [--starts] [--only ours|peer] [--verbose]

DATA are sequence folders with poses.txt, or folders of such. Every n-th frame is taken, with motion_estimation.poses=ignore.
A step leads from a frame to the next one of its component (trajectory_tum.N.txt). It is right if it is wrong by at most 5 degrees and 10 cm plus 5 % of its length.
"""
import argparse
import concurrent.futures
import math
import os
import subprocess
import tempfile

MAX_DEGREES, MAX_METRES, MAX_FRACTION = 5.0, 0.10, 0.05


def multiply(a, b):
    x1, y1, z1, w1 = a
    x2, y2, z2, w2 = b
    return (w1 * x2 + x1 * w2 + y1 * z2 - z1 * y2, w1 * y2 - x1 * z2 + y1 * w2 + z1 * x2,
            w1 * z2 + x1 * y2 - y1 * x2 + z1 * w2, w1 * w2 - x1 * x2 - y1 * y2 - z1 * z2)


def turned(q, v):
    conjugate = (-q[0], -q[1], -q[2], q[3])
    return multiply(multiply(q, (v[0], v[1], v[2], 0.0)), conjugate)[:3]


def after(a, b):
    """The pose a * b; a pose is (translation, quaternion xyzw)."""
    moved = turned(a[1], b[0])
    return tuple(a[0][i] + moved[i] for i in range(3)), multiply(a[1], b[1])


def inverse(pose):
    q = (-pose[1][0], -pose[1][1], -pose[1][2], pose[1][3])
    return tuple(-c for c in turned(q, pose[0])), q


def between(a, b):
    return after(inverse(a), b)


def size(pose):
    """Metres and degrees of a motion."""
    q = pose[1]
    return (math.sqrt(sum(c * c for c in pose[0])),
            math.degrees(2 * math.atan2(math.sqrt(q[0] ** 2 + q[1] ** 2 + q[2] ** 2), abs(q[3]))))


def pose_of(words):
    v = [float(word) for word in words]
    norm = math.sqrt(sum(c * c for c in v[3:7]))
    return tuple(v[:3]), tuple(c / norm for c in v[3:7])


def lines_of(path):
    with open(path, encoding="utf-8") as file:
        return [line.split() for line in file if line.strip() and line[0] != "#"]


def configuration_of(folder):
    if os.path.isdir(os.path.join(folder, "rgb")):
        return "rgbd_indoor.yaml"
    return "stereo_outdoor.yaml" if "street" in folder or "outdoor" in folder else "stereo_indoor.yaml"


def ours(binaries, folder, thin, start):
    """(index before, index, motion) of the steps between frames that were placed."""
    configuration = os.path.join(os.path.dirname(__file__), "..", "config", configuration_of(folder))
    with tempfile.TemporaryDirectory() as out:
        subprocess.run([os.path.join(binaries, "planar_map"), "run", configuration, "-i", folder, "-o", out, "--force", "-q", "-j", "1",
                        "--frames", f"{start}::{thin}", "--set", "motion_estimation.poses=ignore"],
                       stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, check=False)
        components = [lines_of(os.path.join(out, name)) for name in sorted(os.listdir(out)) if name.startswith("trajectory_tum.")]
    stamps = [float(words[0]) for words in lines_of(os.path.join(folder, "poses.txt"))[start::thin]]
    steps = []
    for found in components:
        placed = sorted((min(range(len(stamps)), key=lambda i: abs(stamps[i] - float(words[0]))), pose_of(words[1:8])) for words in found)
        steps += [(a[0], b[0], between(a[1], b[1])) for a, b in zip(placed, placed[1:])]
    return sorted(steps)


def peer(binaries, folder, thin, _):
    """The peer registers each frame to the one before: a step that it cannot place is missing."""
    output = subprocess.run([os.path.join(binaries, "peer_motion"), folder, str(thin)],
                            capture_output=True, text=True, check=False).stdout
    rows = [line.split() for line in output.splitlines()]
    return [(int(words[0]) - 1, int(words[0]), pose_of(words[1:8])) for words in rows]


def measure(method, binaries, folder, thin, start):
    truth = [pose_of(words[1:8]) for words in lines_of(os.path.join(folder, "poses.txt"))[start::thin]]
    steps = (ours if method == "ours" else peer)(binaries, folder, thin, start)
    right, wrong, errors = 0, [], []
    end, path, last = ((0.0, 0.0, 0.0), (0.0, 0.0, 0.0, 1.0)), 0.0, 0
    for before, now, motion in steps:
        true = between(truth[before], truth[now])
        metres, degrees = size(between(true, motion))
        errors.append((metres, degrees))
        if degrees > MAX_DEGREES or metres > MAX_METRES + MAX_FRACTION * size(true)[0]:
            wrong.append((before, now, metres, degrees))
        else:
            right += 1
        # Steps that were not found come from the truth, as drift is of those that were.
        end = after(after(end, between(truth[last], truth[before])), motion)
        path += size(true)[0]
        last = now
    def rms(k):
        return math.sqrt(sum(e[k] ** 2 for e in errors) / len(errors)) if errors else float("nan")
    drift = 100 * size(between(between(truth[0], truth[last]), end))[0] / path if path > 0 else float("nan")
    turns = [size(between(a, b))[1] for a, b in zip(truth, truth[1:])]
    return {"method": method, "folder": folder, "thin": f"{start}::{thin}" if start else thin, "steps": len(truth) - 1, "right": right, "wrong": wrong,
            "rms_m": rms(0), "rms_deg": rms(1), "drift": drift, "turn": sum(turns) / max(1, len(turns))}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("data", nargs="+")
    parser.add_argument("--bin", default=os.path.join(os.path.dirname(__file__), "..", "build", "bin"))
    parser.add_argument("--thin", default="1,2,3,5,8")
    parser.add_argument("--starts", action="store_true", help="thinned sequences from each of their first frames; not of the peer")
    parser.add_argument("--only", choices=["ours", "peer"])
    parser.add_argument("--verbose", action="store_true", help="also the steps that are wrong")
    parser.add_argument("-j", type=int, default=1, help="runs at once")
    arguments = parser.parse_args()
    folders = []
    for entry in arguments.data:
        inside = sorted(os.path.join(entry, name) for name in os.listdir(entry)) if os.path.isdir(entry) else []
        folders += [f for f in [entry] + inside if os.path.exists(os.path.join(f, "poses.txt")) and
                    os.path.isdir(os.path.join(f, "rgb" if os.path.isdir(os.path.join(f, "rgb")) else "left"))]
    methods = [arguments.only] if arguments.only else ["ours", "peer"]
    methods = ["ours"] if arguments.starts else methods
    tasks = [(m, arguments.bin, f, thin, start) for f in folders for thin in map(int, arguments.thin.split(",")) for m in methods
             for start in range(thin if arguments.starts else 1)]
    print("| sequence | every | mean turn | method | steps | right | wrong | rms m | rms deg | drift % |")
    print("|---" * 10 + "|")
    total = {m: [0, 0, 0] for m in methods}
    with concurrent.futures.ThreadPoolExecutor(arguments.j) as pool:
        for row in pool.map(lambda task: measure(*task), tasks):
            print(f"| {os.path.basename(row['folder'].rstrip('/'))} | {row['thin']} | {row['turn']:.0f} | {row['method']} "
                  f"| {row['steps']} | {row['right']} | {len(row['wrong'])} | {row['rms_m']:.4f} | {row['rms_deg']:.3f} "
                  f"| {row['drift']:.2f} |", flush=True)
            if arguments.verbose and row["wrong"]:
                print("    wrong: " + ", ".join(f"{a}->{b} {m:.2f} m {d:.1f} deg" for a, b, m, d in row["wrong"]))
            for k, value in enumerate([row["steps"], row["right"], len(row["wrong"])]):
                total[row["method"]][k] += value
    for m in methods:
        print(f"| all | | | {m} | {total[m][0]} | {total[m][1]} | {total[m][2]} | | | |")


if __name__ == "__main__":
    main()
