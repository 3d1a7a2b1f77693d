# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The wheel in an environment of its own, without the build tree and the system's packages."""
import os
import pathlib
import subprocess
import sys
import venv
import zipfile

import numpy as np
import pytest

from conftest import PLANAR_MAP

BUILD = pathlib.Path(PLANAR_MAP).resolve().parents[1]
SOURCE = pathlib.Path(__file__).resolve().parents[2]


@pytest.fixture(scope="module")
def python(tmp_path_factory):
    """The interpreter of an environment that has the wheel, and NumPy as it is here."""
    folder = tmp_path_factory.mktemp("wheel")
    built = subprocess.run([sys.executable, SOURCE / "scripts/wheel.py", BUILD, folder], capture_output=True, text=True, check=False)
    if "is not a" in built.stderr or "cannot find" in built.stderr:
        pytest.skip("not all libraries are built: " + built.stderr.strip().split("\n")[-1])
    assert built.returncode == 0, built.stderr
    wheel = pathlib.Path(built.stdout.strip())
    venv.create(folder / "venv", system_site_packages=False, with_pip=False)
    packages = next((folder / "venv/lib").glob("python*/site-packages"))
    pip = subprocess.run([sys.executable, "-m", "pip", "--python", folder / "venv/bin/python", "install", "--no-index", "--no-deps", wheel],
                         capture_output=True, text=True, check=False)
    if "No module named pip" in pip.stderr:
        with zipfile.ZipFile(wheel) as archive:
            archive.extractall(packages)
    else:
        assert pip.returncode == 0, pip.stderr
    (packages / "numpy").symlink_to(pathlib.Path(np.__file__).parent)
    return folder / "venv/bin/python"


def test_wheel_runs_without_the_build_tree(python, sequence, tmp_path):
    program = f"""
import planar_mapping as pm
assert "site-packages" in pm.__file__, pm.__file__
metrics = pm.run({str(sequence)!r}, {str(tmp_path / "out")!r}, frames="0:1")
world = pm.PlanarMap.load({str(tmp_path / "out/map.pmap")!r})
loaded = {{line.split()[-1] for line in open("/proc/self/maps") if "libplanar_mapping" in line}}
assert loaded and all("site-packages/planar_mapping/lib/" in path for path in loaded), loaded
print(metrics["frames"], len(world) > 0)
"""
    environment = {k: v for k, v in os.environ.items() if k not in ("PYTHONPATH", "LD_LIBRARY_PATH")}
    done = subprocess.run([python, "-c", program], env=environment, capture_output=True, text=True, check=False, cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert done.stdout.split() == ["1", "True"]
