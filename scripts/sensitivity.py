#!/usr/bin/env python3
"""What each internal constant and mechanism does: the table docs/dev/constants.csv.

    scripts/sensitivity.py WORK DATA --write docs/dev/constants.csv     measures, writes
    scripts/sensitivity.py --list --write docs/dev/constants.csv        lists the constants of today; keeps what was measured before
    scripts/sensitivity.py WORK DATA --only planes/organized            constants whose name holds this

The libraries are built in WORK from a copy of the sources that reads every tuned constant from the environment; the programs planar_map and
sensitivity_figures of a finished build (--build) of the same sources run with them. Each constant is halved and doubled, each mechanism is switched off, on
inputs that chose none of them: random rooms and yards (seeds 941 to 948, 961, 962), the room `white` (seeds 951, 971), every 9th, 13th and 17th frame of
rgbd_icl_livingroom from the second on; mechanisms on labelled clouds too. Results are kept in WORK/results.json: it can be stopped and started again.

Columns: name (file:constant, or off:mechanism), value, kind, half, twice (off for mechanisms: the figures that moved, `nothing`, or empty where it was not
measured). Kinds: derived (by a formula), technical (limits of types, sentinels, sizes of blocks, what the compiler needs), sensitive (a figure moved),
bound of work, numerical, no effect (on these inputs), not measured.
"""
import argparse
import concurrent.futures
import csv
import io
import itertools
import json
import math
import os
import re
import resource
import shutil
import subprocess
import tempfile

MAX_CPU_SECONDS = 30  # of one run; a constant that makes it take longer has failed
ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), ".."))
TYPES = r"(?:double|float|int|unsigned|std::size_t|std::ptrdiff_t|std::u?int\d+_t)"
CONSTANT = re.compile(r"^( *)((?:static )?constexpr) (" + TYPES + r") (k\w+) = ([^;]+?);", re.MULTILINE)
MEMBER = re.compile(r"^( +)(double|int) (\w+) = (-?[\d.e-]+);", re.MULTILINE)
HIDDEN = {"planes/tiles/plane_fit.h": "struct SearchParams", "planes/organized/metric_fit.h": "struct OrganizedParams",
          "planes/disparity/disparity_fit.h": "struct DisparityParams"}
# Sentinels, limits of types and of what is representable, codes, expressions of other constants; sizes of blocks by name.
# What the compiler must know is found by compiling.
TECHNICAL = re.compile(r"numeric_limits|\d(\.\d+)?e([89]|\d\d)f?\b|0x|~|3e38|^-1$")
TECHNICAL_NAMES = re.compile(r"k(\w*Block|Chunk|Together|AtOnce|\w*Lanes|DefaultSeed)$")
DERIVED = {
    "planes/organized/metric_fit:kFreedom": "nine means less the three coefficients of a plane",
    "cuboids/cover_search:kApartBits": "boxes reach one half cell beyond what they hold",
    "planes/disparity/disparity_fit:kFewest": "points that make a plane",
    "geometry/cloud_origin:kEarth": "coordinates of a country are below the radius of the earth",
    "planes/surface_leaves:kMinThickness": "RMS thickness of two faces, one with a sixth of the points",
}
# Bounds of time or memory (where a search, a sample or a table ends) and tolerances of arithmetic, of which no figure depends: so the table says of those only
# of which neither half nor twice moved one.
BOUNDS = {
    "bound of work": re.compile(
        r"base/spelling:kLongestWord|box_search:kMaxPairs|lattice_cover:kMax(BoxesSearched|MoreBoxes|Moved)|set_cover:kStepsPerSet|cover_search:kMaxVolume|"
        r"cloud_origin:kMaxSample|cloud_scale:kSample$|frame_cells:k(MinSlots|Stretch)|ground_labels:kMaxCounted|ground_plane:k(Finalists|MaxScored)|"
        r"kl_occupancy:kMaxPointsKept|motion_estimation:k(FinalIterations|LocalIterations|Rounds)|feature_planes:kSample|multi_plane:kStep|"
        r"multi_ransac:kMax(Iterations|Models)|point_cells:kSampleDivisor|plane_fit:kMaxCandidates|leaf_planes:kMaxVoters|surface_map:kMaxViews|"
        r"surface_search:kMax(Bins|Directions|Shifts)"),
    "numerical": re.compile(
        r"base/types:kTolerance|plane_cover:kLargestLength|plane_raster:kHorizontalSine|geometry/camera:kNearest|motion_refinement:k(Converged|NearestDepth)|"
        r"disparity_fit:kThinnest|disparity_growing:kMinNoise|sparse_points:kFarthestCell|surface_leaves:kThinnest|surface_map:kSamePlace|"
        r"surface_registration:kSettled"),
}
# Measured by hand on other inputs.
ELSEWHERE = {
    "cuboids/compact_cover:kMaxSlant": "the tolerance of a cover; 0.75, 0.9: ICL living room occupied % 1.17 > 1.35, 1.70, "
                                       "cuboids 47 > 45, 41 (kMaxSlantedCells 0)",
    "cuboids/compact_cover:kMaxSlantedCells": "0: ICL living room occupied % 1.24 > 1.17, cuboids 44 > 47 / twice: 1.24 > 1.34, 44 > 43; "
                                              "TartanAir 0.25 > 0.34, 163 > 163",
    "cuboids/cover/lattice_cover:kMaxMoreBoxes": "no limit: no cuboid fewer, covers of the KITTI street 1.6 > 2.7 s",
    "geometry/cloud_origin:kNear": "half: two scans of nuScenes are merged / twice: nothing",
    "localization/odometry/odometry:kDrift": "0.04 / 0.25, `poses=prior`, position mm rms: TartanAir exact 7.8 > 16.8 / 3.7, with 31 mm of noise 12.5 > 21.2 / 13.7; "
                                "cabinet 22.2 > 26.0 / 17.0, 30.3 > 31.5 / 27.1; ICL 8.7 > 10.2 / 6.7, 14.7 > 18.0 / 15.0; these three chose it",
    "planes/unorganized/far_rings:kMinPoints": "2: on planes 78.9 > 79.3 %, of another object 244 > 261 points / 6: 77.9 %, 218",
    "planes/unorganized/leaf_planes:kAgreeAlongSides": "half, twice and a quarter: nothing in 42 rooms of walls along cells (`test_sequential_planes`); "
                                                       "0: 10 of them lose a wall",
    "localization/registration/surface_map:kBetter": "1, kAsGood 1: of 1,071 steps by clouds alone 995 > 979 right",
    "localization/registration/surface_registration:kTimesNoise": "1: of 1,071 steps by clouds alone 995 > 997 right, 1 > 5 wrong",
}
# Those that hold constants.
LIBRARIES = ["planar_mapping_" + name for name in ("core", "map", "io", "stereo", "pipeline")]
# Inputs of the constants below a folder (the first that fits); see groups().
IMAGES = ["metric", "metric_white", "disparity", "disparity_white"]
ROOMS = [("planes/organized", IMAGES), ("planes/tiles", IMAGES), ("planes/disparity", ["disparity", "disparity_white"]),
         ("planes/unorganized", ["unorganized"]), ("planes/surface_leaves", ["unorganized"]), ("planes/point_cells", ["unorganized", "ransac"]),
         ("planes/plane_patches", ["unorganized", "ransac", "metric"]), ("planes/multi_ransac", ["ransac", "features"]),
         ("planes/from_features", ["features"]), ("planes/assumed", ["white"]), ("planes", ["metric", "disparity", "unorganized", "ransac"]),
         ("ground/up.", ["upright"]), ("ground", ["ground"]), ("geometry/cloud_", ["scale", "unorganized"]),
         ("geometry", ["motion_features"]), ("localization/odometry", ["motion_features", "motion_rgbd"]),
         ("localization/registration", ["motion_clouds", "motion_rgbd", "motion_far"]), ("", ["map_rgbd", "map_simulated", "map_walk"])]
# Mechanisms that can be switched off: name, file below src/planar_mapping, text, text without it.
OFF = '::planar_mapping::tunable<int>("off:%s", 0)'
MECHANISMS = [
    ("settling of edges", "planes/organized/organized_planes.cpp", "  if (!pixels.isNoisy()) return;", "  if (OFF || !pixels.isNoisy()) return;"),
    ("agreement of surroundings", "planes/organized/organized_planes.cpp", "  freeDisagreeing(cloud,", "  if (!OFF) freeDisagreeing(cloud,"),
    ("bent surfaces", "planes/tiles/organized_coherence.cpp", "} else if (!test.may_bend &&", "} else if (!OFF && !test.may_bend &&"),
    ("coherence of tiles", "planes/tiles/organized_coherence.cpp", "if (test.min_agreement > 0.0 &&", "if (!OFF && test.min_agreement > 0.0 &&"),
    ("fit along rays", "planes/organized/metric_fit.cpp",
     "if (!plane.valid || list.size() < 3) return;", "if (OFF || !plane.valid || list.size() < 3) return;"),
    ("correlation of noise", "planes/organized/metric_fit.cpp", "  if (samples.size() < kMinSamples) return RangeNoise().correlated_pixels;",
     "  if (OFF || samples.size() < kMinSamples) return RangeNoise().correlated_pixels;"),
    ("wide windows", "planes/organized/metric_growing.cpp", "  if (wide) wide_fits_", "  if (wide && !OFF) wide_fits_"),
    ("noise of a doubtful plane", "planes/disparity/disparity_planes.cpp",
     "  return list.size() >= static_cast<std::size_t>(params.least_noisy_tiles) &&",
     "  return !OFF && list.size() >= static_cast<std::size_t>(params.least_noisy_tiles) &&"),
    ("uncertain directions", "planes/disparity/disparity_planes.cpp", "  dropUncertain(planes, pixels,", "  if (!OFF) dropUncertain(planes, pixels,"),
    ("white noise of tiles", "planes/disparity/disparity_fit.cpp",
     "bool DisparityFit::isNoiseWhite(const PlaneCandidate& plane, const std::vector<TilePart>& parts,\n"
     "                                const PartList& list) const {\n", None),
    ("rim of another", "planes/unorganized/leaf_planes.cpp", "|| isRimOfAnother(voters)", "|| (!OFF && isRimOfAnother(voters))"),
    ("rejected once", "planes/unorganized/leaf_planes.cpp", "if (wasRejected(best)) continue;", "if (!OFF && wasRejected(best)) continue;"),
    ("coherence of leaves", "planes/unorganized/leaf_planes.cpp",
     "if (!keepCoherent(proposal.plane, voters) ||", "if ((!OFF && !keepCoherent(proposal.plane, voters)) ||"),
    ("agreement of cells", "planes/unorganized/sequential_planes.cpp",
     "isSurface(agreement[k], evidence[k]))", "(OFF || isSurface(agreement[k], evidence[k])))"),
    ("significance", "planes/unorganized/sequential_planes.cpp",
     "const bool significant = isSignificant(", "const bool significant = OFF || isSignificant("),
    ("company of leaves", "planes/unorganized/leaf_voters.h",
     "return agree >= kMinCompany * (agree + oppose);", "return OFF || agree >= kMinCompany * (agree + oppose);"),
    ("clutter in groups", "planes/multi_ransac/multi_ransac.cpp", "if (company >= kCompany)", "if (OFF || company >= kCompany)"),
    ("pieces of ground", "ground/ground_labels.cpp", "  if (k.pieces) {", "  if (k.pieces && !OFF) {"),
    ("occluding edges", "localization/registration/surface_shape.cpp", "if (!cloud.isOrganized())", "if (OFF || !cloud.isOrganized())"),
    ("doubled cells for noise", "geometry/cloud_scale.cpp", "i <= kMaxDoublings;", "i <= (OFF ? 0 : kMaxDoublings);"),
]
HEADER = """#pragma once
#include <cstdlib>
#include <cstring>
#include <type_traits>
namespace planar_mapping {
template <typename T> T tunable(const char* name, T value) {
  const char* set = std::getenv("PLANAR_TUNE");
  const std::size_t length = std::strlen(name);
  if (set == nullptr || std::strncmp(set, name, length) != 0 || set[length] != '=') return value;
  return static_cast<T>(std::strtod(set + length + 1, nullptr));
}
}
"""


def sources():
    names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT, capture_output=True, text=True,
                           check=True).stdout.split()
    return [n for n in names if os.path.exists(os.path.join(ROOT, n))]


def read(path):
    with open(path, encoding="utf-8") as file:
        return file.read()


def name_of(path, constant):
    return os.path.splitext(path[len("src/planar_mapping/"):])[0] + ":" + constant


def constants(source):
    """{name: {path, type, value, technical}} of all constants of core."""
    found = {}
    for path in sources():
        if not path.startswith("src/planar_mapping/") or not path.endswith((".h", ".cpp")):
            continue
        if not os.path.exists(os.path.join(source, path)):
            continue
        text = read(os.path.join(source, path))
        for number, (_, _, kind, name, value) in enumerate(CONSTANT.findall(text)):
            technical = bool(TECHNICAL.search(value) or TECHNICAL_NAMES.match(name) or re.search(r"k[A-Z]|sizeof", value))
            key = name_of(path, name)
            while key in found:  # functions of one file have constants of the same name
                key += "'"
            found[key] = {"path": path, "type": kind, "name": name, "number": number, "text": value, "technical": technical}
        for end, struct in HIDDEN.items():
            if path.endswith(end):
                for _, kind, name, value in MEMBER.findall(text[text.index(struct):text.index("\n};", text.index(struct))]):
                    if name not in ("distance_threshold", "max_normal_deviation", "noise_factor", "min_inliers", "noise"):
                        found[name_of(path, name)] = {"path": path, "type": kind, "name": name, "text": value, "technical": False}
    return found


def instrument(source, tree, table):
    """Turns the constants of a copy into values from the environment."""
    by_path = {}
    for key, entry in table.items():
        if not entry["technical"]:
            by_path.setdefault(entry["path"], {})[entry.get("number", entry["name"])] = key
    for path in {entry["path"] for entry in table.values()} | {"src/planar_mapping/" + m[1] for m in MECHANISMS}:
        text = read(os.path.join(source, path))
        keys = by_path.get(path, {})

        numbers_of = itertools.count()

        def constant(match):
            indent, how, kind, name, value = match.groups()
            number = next(numbers_of)
            if number not in keys:
                return match.group(0)
            inline = "inline static" if how.startswith("static") else "static"
            return f'{indent}{inline} const {kind} {name} = ::planar_mapping::tunable<{kind}>("{keys[number]}", {value});'

        def member(match):
            indent, kind, name, value = match.groups()
            if name not in keys:
                return match.group(0)
            return f'{indent}{kind} {name} = ::planar_mapping::tunable<{kind}>("{keys[name]}", {value});'

        text = CONSTANT.sub(constant, text)
        if any(path.endswith(end) for end in HIDDEN):
            text = MEMBER.sub(member, text)
        for mechanism, end, old, new in MECHANISMS:
            if path == "src/planar_mapping/" + end:
                if old not in text:
                    raise SystemExit(f"{mechanism}: {end} does not hold its text")
                text = text.replace(old, old + "  if (OFF) return false;\n" if new is None else new, 1).replace("OFF", OFF % mechanism)
        if "tunable" in text:
            text = re.sub(r"^#include", '#include "tunable.h"\n#include', text, count=1, flags=re.MULTILINE)
        if read(os.path.join(tree, path)) == text:
            continue  # is not compiled again
        with open(os.path.join(tree, path), "w", encoding="utf-8") as file:
            file.write(text)


def copies(work):
    """One as it is, since the sources may change meanwhile, and one to change."""
    source, tree = os.path.join(work, "source"), os.path.join(work, "tree")
    for folder in (source, tree):
        if os.path.exists(folder):
            continue
        for path in sources():
            os.makedirs(os.path.dirname(os.path.join(folder, path)), exist_ok=True)
            shutil.copy(os.path.join(ROOT, path), os.path.join(folder, path))
    return source, tree


def build(work, table):
    """Compiles the copy; constants that must be known to the compiler become technical."""
    source, tree = copies(work)
    header = os.path.join(tree, "src", "tunable.h")
    if not os.path.exists(header) or read(header) != HEADER:
        with open(header, "w", encoding="utf-8") as file:
            file.write(HEADER)
    known = os.path.join(work, "technical.json")
    if os.path.exists(known):
        with open(known, encoding="utf-8") as file:
            for key in json.load(file):
                if key in table:
                    table[key]["technical"] = True
    instrument(source, tree, table)
    subprocess.run(["cmake", "--preset", "release", "-DPLANAR_MAPPING_BUILD_VIEWER=OFF", "-DPLANAR_MAPPING_BUILD_PYTHON=OFF",
                    "-DPLANAR_MAPPING_BUILD_TESTS=OFF", "-DPLANAR_MAPPING_BUILD_EXAMPLES=OFF"],
                   cwd=tree, check=True, stdout=subprocess.DEVNULL)
    for _ in range(8):
        run = subprocess.run(["ninja", "-C", "build", "-j2", "-k", "0", *LIBRARIES], cwd=tree,
                             capture_output=True, text=True, check=False)
        if run.returncode == 0:
            return
        # A constant of a file with an error, in the lines that the compiler names.
        marked = 0
        for path, line in set(re.findall(r"^(?:\S*/)?(src/planar_mapping/\S+?):(\d+):\d+: error", run.stdout, re.MULTILINE)):
            with open(os.path.join(tree, path), encoding="utf-8") as file:
                words = set(re.findall(r"\w+", "".join(file.readlines()[int(line) - 1:int(line) + 2])))
            for entry in table.values():
                if entry["name"] in words and not entry["technical"]:
                    entry["technical"] = True
                    marked += 1
        for word in set(re.findall(r"[‘'](?:\w+::)*(k[A-Z]\w*)[’']", run.stdout)):
            for entry in table.values():
                if entry["name"] == word and not entry["technical"]:
                    entry["technical"] = True
                    marked += 1
        if marked == 0:
            raise SystemExit(run.stdout[-4000:])
        instrument(source, tree, table)
        with open(known, "w", encoding="utf-8") as file:
            json.dump([key for key, entry in table.items() if entry["technical"]], file)
    raise SystemExit("the copy does not compile")


def numbers(text):
    return {line.split()[0]: float(line.split()[1]) for line in text.splitlines() if len(line.split()) == 2}


class Inputs:
    """Scenes of seeds, directions and thinnings that no test and no choice of a constant used."""

    def __init__(self, work, data, build):
        self.data, self.work = data, work
        self.bin = build
        self.scenes = os.path.join(work, "scenes")
        os.makedirs(self.scenes, exist_ok=True)
        self.library = os.path.join(work, "tree", "build", "lib")
        for seed in (961, 962):
            if not os.path.exists(os.path.join(work, str(seed), "poses.txt")):
                subprocess.run([self.tool("sensitivity_figures"), "walk", os.path.join(work, str(seed)), str(seed)], check=True)
        if not os.path.exists(os.path.join(work, "white")):
            subprocess.run([self.tool("planar_map"), "simulate", "white", "-o", os.path.join(work, "white"), "-q", "--write", "images", "--width", "320",
                            "--height", "240", "--frames", "3", "--seed", "951"], check=True)

    def tool(self, name):
        return os.path.join(self.bin, name)

    def call(self, environment, *command):
        return subprocess.run(command, env={**os.environ, "LD_LIBRARY_PATH": self.library, "SENSITIVITY_SCENES": self.scenes, **environment},
                              capture_output=True, text=True, check=False,
                              preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_CPU, (MAX_CPU_SECONDS, MAX_CPU_SECONDS)))

    def run(self, environment, configuration, folder, *options):
        out = environment.get("OUT")
        self.call(environment, self.tool("planar_map"), "run", os.path.join(ROOT, "config", configuration), "-i", folder, "-o", out, "-q",
                  "-j", "1", "--force", *options)
        m = json.loads(read(os.path.join(out, "metrics.json")))
        return {"planes": m["planes"], "cuboids": m["cuboids"]["total"], "coverage": round(m["coverage"], 4),
                "cells": m["standard_cells"], "unknown": m["unknown_cells"]}

    def motion(self, environment, configuration, folder, *options):
        """Frames that were placed, and the error of their positions and directions relative to the first."""
        result = self.run(environment, configuration, folder, "--set", "motion_estimation.poses=ignore", *options)
        def read_poses(path):
            return [[float(w) for w in line.split()] for line in read(path).splitlines() if line.strip() and line[0] != "#"]
        truth, found = read_poses(os.path.join(folder, "poses.txt")), read_poses(os.path.join(environment["OUT"], "trajectory_tum.txt"))
        metres, degrees, first = 0.0, 0.0, None
        for pose in found:
            true = min(truth, key=lambda row: abs(row[0] - pose[0]))
            if first is None:
                first = (pose, true)
            a, b = relative(first[0], pose), relative(first[1], true)
            metres += math.dist(a[0], b[0])
            degrees += 2 * math.degrees(math.acos(min(1.0, abs(sum(x * y for x, y in zip(a[1], b[1]))))))
        return {"placed": len(found), "error_m": round(metres / max(1, len(found)), 4), "error_deg": round(degrees / max(1, len(found)), 3),
                "cuboids": result["cuboids"]}

    def figures(self, group, environment):
        living = os.path.join(self.data, "rgbd_icl_livingroom")
        if group == "white":
            return self.run(environment, "stereo_indoor.yaml", os.path.join(self.work, "white"))
        if group == "map_rgbd":
            return self.run(environment, "rgbd_indoor.yaml", living, "--frames", "1::17")
        if group == "map_walk":
            return self.run(environment, "pcd_sequence.yaml", os.path.join(self.work, "962", "measured"))
        if group == "map_simulated":
            out = environment["OUT"]
            self.call(environment, self.tool("planar_map"), "evaluate", os.path.join(ROOT, "config", "evaluate.yaml"), "--scenes", "white",
                      "--places", "2", "--frames-per-place", "3", "--cells", "0.2", "--seed", "971", "-o", out, "--no-figures", "-q", "--force")
            with open(os.path.join(out, "evaluation.json"), encoding="utf-8") as file:
                rows = [r for r in json.load(file)["results"] if r["method"] == "PG"]
            return {name: round(row[key], 4) for row in rows for name, key in
                    (("cells", "cells"), ("error", "error_percent"), ("complete", "completeness"), ("coverage", "coverage"),
                     ("violation", "free_space_violation"))}
        if group == "motion_features":
            return self.motion(environment, "stereo_indoor.yaml", os.path.join(self.work, "961"))
        if group == "motion_rgbd":
            return self.motion(environment, "rgbd_indoor.yaml", living, "--frames", "1::9")
        if group == "motion_clouds":
            return self.motion(environment, "pcd_sequence.yaml", os.path.join(self.work, "961", "measured"), "--set", "motion_estimation.enabled=true")
        if group == "motion_far":  # no features: clouds far apart
            return self.motion(environment, "rgbd_indoor.yaml", living, "--frames", "1::13", "--set", "key_features.enabled=false")
        figures = numbers(self.call(environment, self.tool("sensitivity_figures"), group).stdout)
        return figures or {"failed": "no figures"}


def relative(a, b):
    """Pose b in the frame of a: (translation, quaternion xyzw); rows are time, translation, quaternion."""
    def multiply(p, q):
        return [p[3] * q[0] + p[0] * q[3] + p[1] * q[2] - p[2] * q[1], p[3] * q[1] - p[0] * q[2] + p[1] * q[3] + p[2] * q[0],
                p[3] * q[2] + p[0] * q[1] - p[1] * q[0] + p[2] * q[3], p[3] * q[3] - p[0] * q[0] - p[1] * q[1] - p[2] * q[2]]
    back = [-a[4], -a[5], -a[6], a[7]]
    moved = multiply(multiply(back, [b[i] - a[i] for i in (1, 2, 3)] + [0.0]), a[4:8])
    return moved[:3], multiply(back, b[4:8])


def measured(inputs, group, environment):
    with tempfile.TemporaryDirectory() as out:
        try:
            return inputs.figures(group, {**environment, "OUT": out})
        except (FileNotFoundError, KeyError, ValueError) as error:
            return {"failed": type(error).__name__}


def variants(entry):
    value = evaluated(entry["text"])
    if value is None:
        return []
    if entry["type"] in ("double", "float"):
        return [0.5 * value, 2.0 * value]
    return [v for v in (max(0, min(int(value) - 1, int(value) // 2)), int(value) * 2 if value else 1)]


def evaluated(text):
    text = re.sub(r"\bM_PI\b", str(math.pi), re.sub(r"(?<=[\d.])[uUfFlL]+\b", "", text))
    text = re.sub(r"std::\w+\{(\d+)\}", r"\1", text)
    try:
        return eval(text, {"__builtins__": {}})  # numbers and operators of our own sources
    except (SyntaxError, NameError, TypeError):
        return None


def groups_of(key):
    return next(groups for prefix, groups in ROOMS if key.startswith(prefix))


def changes(base, figures):
    """{figure: relative change} of what is not time; failed counts as one figure."""
    result = {}
    for name in set(base) | set(figures):
        if name == "ms":
            continue
        before, after = base.get(name), figures.get(name)
        if before != after:
            result[name] = (before, after)
    return result


def short(value):
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def row_of(key, entry, results, base):
    value = entry["text"]
    if key in DERIVED:
        return [key, value, "derived: " + DERIVED[key], "", ""]
    if entry["technical"]:
        return [key, value, "technical", "", ""]
    if key not in results:
        return [key, value, "not measured", ELSEWHERE.get(key, ""), ""]
    cells = []
    for groups in results[key]:
        parts = []
        for group, figures in groups.items():
            parts += [f"{group} {name} {short(b)} > {short(a)}" for name, (b, a) in sorted(changes(base[group], figures).items())]
        cells.append("; ".join(parts) if parts else "nothing")
    moved = any(cell != "nothing" for cell in cells)
    unmoved = next((kind for kind, names in BOUNDS.items() if names.search(key)), "no effect")
    return [key, value, "sensitive" if moved else unmoved, *(cells + [""])[:2]]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("work", nargs="?")
    parser.add_argument("data", nargs="?")
    parser.add_argument("--build", default=os.path.join(ROOT, "build"), help="with bin/planar_map and bin/sensitivity_figures")
    parser.add_argument("--only", default="")
    parser.add_argument("-j", type=int, default=1, help="programs at once")
    parser.add_argument("--write")
    parser.add_argument("--table", action="store_true", help="print what was measured")
    parser.add_argument("--list", action="store_true", help="measure nothing")
    arguments = parser.parse_args()
    if arguments.list:
        write(arguments.write, rows_of_table(constants(ROOT), {"base": {}, "results": {}}, measured_before(arguments.write)))
        return
    if not arguments.data:
        parser.error("WORK and DATA, or --list")
    work = os.path.abspath(arguments.work)
    os.makedirs(work, exist_ok=True)
    table = constants(copies(work)[0])
    kept = os.path.join(work, "results.json")
    state = {"base": {}, "results": {}}
    if os.path.exists(kept):
        with open(kept, encoding="utf-8") as file:
            state = json.load(file)
    build(work, table) if not arguments.table else load_technical(work, table)
    if not arguments.table:
        inputs = Inputs(work, arguments.data, os.path.join(arguments.build, "bin"))
        tasks = [("off:" + mechanism, [f"off:{mechanism}=1"], {"text": end, "technical": False},
                  groups_of(os.path.splitext(end)[0]) + (["labelled"] if end.startswith("planes") else [])) for mechanism, end, _, _ in MECHANISMS]
        tasks += [(key, [f"{key}={value}" for value in variants(entry)], entry, groups_of(key)) for key, entry in table.items()
                  if not entry["technical"] and key not in DERIVED]
        tasks.sort(key=lambda task: ("off:" not in task[0], "planes/" not in task[0]))
        tasks = [task for task in tasks if task[0] not in state["results"] and any(part in task[0] for part in arguments.only.split(","))]
        for group in sorted({group for task in tasks for group in task[3]}):
            if group not in state["base"]:
                state["base"][group] = measured(inputs, group, {})
                if "failed" in state["base"][group]:
                    raise SystemExit(f"{group}: {state['base'][group]['failed']} without any change")
                print(group, state["base"][group], flush=True)
            with open(kept, "w", encoding="utf-8") as file:
                json.dump(state, file)

        def run(task):
            return task, [{group: measured(inputs, group, {"PLANAR_TUNE": setting}) for group in task[3]} for setting in task[1]]
        with concurrent.futures.ThreadPoolExecutor(arguments.j) as pool:
            for (key, _, entry, _), result in pool.map(run, tasks):
                state["results"][key] = result
                print(" | ".join(row_of(key, entry, state["results"], state["base"])), flush=True)
                with open(kept, "w", encoding="utf-8") as file:
                    json.dump(state, file)
    there = constants(ROOT)  # what has gone since the copy was made is left out
    table = {key: entry for key, entry in table.items() if key in there}
    write(arguments.write, rows_of_table(table, state, measured_before(arguments.write)))


def write(path, rows):
    text = table_text(rows)
    if path:
        with open(path, "w", encoding="utf-8") as file:
            file.write(text)
    else:
        print(text)


def load_technical(work, table):
    with open(os.path.join(work, "technical.json"), encoding="utf-8") as file:
        for key in json.load(file):
            if key in table:
                table[key]["technical"] = True


def table_text(rows):
    out = io.StringIO()
    writer = csv.writer(out, lineterminator="\n")
    writer.writerow(["name", "value", "kind", "half", "twice"])
    writer.writerows(rows)
    return out.getvalue()


def rows_of_table(table, state, before):
    """A row per mechanism and constant; where this run measured nothing, what the table said of the same value before."""
    entries = [("off:" + m, {"text": end, "technical": False}) for m, end, _, _ in MECHANISMS] + sorted(table.items())
    rows = []
    for key, entry in entries:
        row = row_of(key, entry, state["results"], state["base"])
        old = before.get(key)
        if row[2] == "not measured" and old and old[1] == row[1]:
            row = old
        rows.append(row)
    return rows


def measured_before(path):
    if not path or not os.path.exists(path):
        return {}
    with open(path, encoding="utf-8") as file:
        return {row[0]: row for row in csv.reader(file)}


if __name__ == "__main__":
    main()
