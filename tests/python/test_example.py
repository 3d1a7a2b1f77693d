# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
import os
import pathlib
import re
import subprocess
import sys

import pytest


def test_the_tutorial_maps_and_draws(tmp_path):
    pytest.importorskip("matplotlib", reason="matplotlib is missing: install python3-matplotlib")
    script = pathlib.Path(__file__).resolve().parents[2] / "examples/python/map_rgbd.py"
    out = subprocess.run([sys.executable, script], cwd=tmp_path, env={**os.environ, "MPLCONFIGDIR": str(tmp_path)},
                         check=True, capture_output=True, text=True).stdout
    frames, planes, cuboids = map(int, re.match(r"(\d+) frames, (\d+) planes, (\d+) cuboids\nmap.png\n", out).groups())
    assert frames == 5 and 15 < planes < cuboids < 1000
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")
