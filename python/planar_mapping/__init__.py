# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Planar surface-based 3D maps: clouds and depth images in, oriented cuboids out."""
from planar_mapping import _native
from planar_mapping._native import *  # noqa: F401,F403
from planar_mapping._native import __version__


def run(config, inputs, out, **options):
    """The pipeline, input to map, as `planar_map run`; options and result are in __init__.pyi."""
    from planar_mapping import _run  # loads OpenCV and PCL

    return _run.run(config, inputs, out, **options)


__all__ = [name for name in dir(_native) if not name.startswith("_")] + ["run"]
