# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""planar_mapping.Atlas: its compiled part loads OpenCV and Ceres, so it is loaded when one is opened."""
from planar_mapping import _native


class Atlas:
    def __init__(self, path):
        try:
            from planar_mapping import _atlas
        except ImportError as error:
            raise _native.Error(f"this planar_mapping was built without atlases (libceres-dev, libsqlite3-dev): {error}") from error
        self._file = _atlas.Atlas(path)

    def sessions(self):
        return self._file.sessions()

    def submaps(self):
        return self._file.submaps()

    def keyframes(self):
        return self._file.keyframes()

    def links(self):
        return self._file.links()

    def map(self, component=None):
        return self._file.map(component)

    def trajectory(self, component=None):
        return self._file.trajectory(component)

    def solve(self, *, without_loops=(), with_loops=()):
        return self._file.solve(list(without_loops), list(with_loops))

    def localize(self, image, xyz, K):
        return self._file.localize(image, xyz, K)

    def localize_scan(self, xyz):
        return self._file.localize_scan(xyz)

    def __repr__(self):
        return repr(self._file)
