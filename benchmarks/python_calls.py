#!/usr/bin/python3
# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Python against C++: python_calls.py BUILD. state() of a million points beside state_of_points, in turn, and the import."""
import os
import pathlib
import resource
import statistics
import subprocess
import sys
import tempfile
import time

build = pathlib.Path(sys.argv[1]).resolve()
sys.path.insert(0, str(build / "python"))

import numpy as np  # noqa: E402

import planar_mapping  # noqa: E402

folder = pathlib.Path(tempfile.mkdtemp())
subprocess.run([build / "bin/planar_map", "simulate", "room", "-o", folder / "room", "--force", "-q"], check=True)
planar_mapping.run("pcd_sequence.yaml", folder / "room", folder / "out")
world = planar_mapping.PlanarMap.load(folder / "out/map.pmap")
points = np.random.default_rng(1).uniform(*world.bounds(), (1_000_000, 3))
points.tofile(folder / "points")
ratios = []
for _ in range(7):
    python = []
    for _ in range(5):
        start = time.perf_counter()
        world.state(points)
        python.append(1e3 * (time.perf_counter() - start))
    cpp = float(subprocess.run([build / "bin/state_of_points", folder / "out/map.pmap", folder / "points"], check=True,
                               capture_output=True, text=True).stdout)
    ratios.append(min(python) / cpp)
    print(f"state of 1,000,000 points: Python {min(python):.0f} ms, C++ {cpp:.0f} ms")
print(f"ratio, median of {len(ratios)}: {statistics.median(ratios):.2f}")


def processor_ms(code):
    def used():
        usage = resource.getrusage(resource.RUSAGE_CHILDREN)
        return usage.ru_utime + usage.ru_stime

    before = used()
    subprocess.run([sys.executable, "-c", code], check=True, env={**os.environ, "PYTHONPATH": str(build / "python")})
    return 1e3 * (used() - before)


for code in ["pass", "import numpy", "import planar_mapping"]:
    print(f"python3 -c '{code}': {statistics.median(processor_ms(code) for _ in range(11)):.0f} ms of processor time")
