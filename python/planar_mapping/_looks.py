# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Pictures of maps, and tables for other libraries."""
import os
import pathlib

import numpy as np

from planar_mapping import _native


def columns(table):
    rows = np.atleast_1d(table)
    if rows.dtype.names is None:
        raise TypeError(f"columns() takes a table with fields, such as map.cuboids(), not an array of {rows.dtype}")
    letters = {3: "xyz", 4: "xyzw"}
    result = {}
    for name in rows.dtype.names:
        values = rows[name]
        if values.ndim == 1:
            result[name] = values.copy()
        else:
            for i, letter in enumerate(letters[values.shape[1]]):
                result[f"{name}_{letter}"] = values[:, i].copy()
    return result


def _program(name):
    import shutil

    """Beside this package, as it was built or installed, else on the PATH."""
    package = pathlib.Path(__file__).resolve().parent
    for folder in (package.parents[1] / "bin", *(parent / "bin" for parent in package.parents[2:5])):
        if os.access(folder / name, os.X_OK):
            return str(folder / name)
    found = shutil.which(name)
    if found is None:
        raise _native.Error(f"snapshot() needs the program {name}, which is not on the PATH (package planar-mapping-viewer); "
                            "show() needs a browser only")
    return found


def snapshot(self, path, *, size=(1280, 720), camera="iso", color="plane", show=None, plan=False, overwrite=False):
    import subprocess  # here: the import of the package stays quick
    import tempfile

    path = pathlib.Path(path)
    if path.exists() and not overwrite:
        raise _native.OutputExistsError(f"{path} exists; overwrite=True overwrites it")
    with tempfile.TemporaryDirectory() as folder:
        file = pathlib.Path(folder) / "map.pmap"
        self.save(file)
        command = [_program("planar_map_viewer"), str(file), "--snapshot", str(path), "--size", "{}x{}".format(*size),
                   "--camera", camera, "--color", color, "--force"]
        command += ["--show", ",".join(show)] if show is not None else []
        command += ["--projection-2d"] if plan else []
        done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise _native.Error(done.stderr.strip().rpartition("\n")[2] or f"{command[0]} ended with {done.returncode}")


class Page:
    """What show() gives: a page for a browser, which notebooks show in place."""

    path = ""

    def __init__(self, path):
        self.path = path

    def _repr_html_(self):
        text = pathlib.Path(self.path).read_text(encoding="utf-8").replace("&", "&amp;").replace('"', "&quot;")
        return f'<iframe srcdoc="{text}" style="width: 100%; height: 600px; border: 0"></iframe>'

    def __repr__(self):
        return f"<Page {self.path}>"


def show(self, path=None, *, open_browser=None):
    import tempfile
    import webbrowser

    if path is None:
        path = pathlib.Path(tempfile.mkdtemp(prefix="planar_mapping_")) / "map.html"
    path = pathlib.Path(path)
    self.export(path, overwrite=True)
    if open_browser is None:  # a notebook shows what is returned
        open_browser = not hasattr(__import__("builtins"), "__IPYTHON__")
    if open_browser:
        webbrowser.open(path.resolve().as_uri())
    return Page(str(path))
