# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Planar surface-based 3D maps: clouds and depth images in, oriented cuboids out.

PlanarMap is the map, run() the pipeline; help(planar_mapping.PlanarMap) lists what a map can be asked.
"""
try:
    import numpy as _numpy  # noqa: F401
except ImportError as error:
    raise ImportError("planar_mapping needs NumPy (apt-get install python3-numpy, or pip install numpy)") from error

from planar_mapping import _documented, _looks, _native
from planar_mapping._native import *  # noqa: F401,F403
from planar_mapping._native import __version__
from planar_mapping._atlas_file import Atlas
from planar_mapping._looks import Page, columns

PlanarMap.snapshot = _looks.snapshot  # noqa: F405
PlanarMap.show = _looks.show  # noqa: F405


def run(config, inputs, out=None, **options):
    from planar_mapping import _run  # loads OpenCV and PCL

    if out is None:  # run(inputs, out): the inputs choose the configuration
        config, inputs, out = None, config, inputs
    return _run.run(config, inputs, out, **options)


__all__ = [name for name in dir(_native) if not name.startswith("_")] + ["Atlas", "Page", "columns", "run"]
_documented.document(globals())
