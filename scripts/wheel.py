#!/usr/bin/env python3
"""Builds a Python wheel: wheel.py BUILD FOLDER

BUILD is a build tree with the target planar_mapping_python. The wheel holds our libraries and ready configurations; those of
others (PCL, OpenCV, yaml-cpp, libpng, ...) are the system's, as on the machine where it was built."""
import base64
import csv
import hashlib
import io
import pathlib
import re
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

TIME = (2020, 1, 1, 0, 0, 0)  # of all files, so that the same tree gives the same wheel


def installed(build, component, folder):
    subprocess.run(["cmake", "--install", build, "--component", component, "--prefix", folder], check=True, stdout=subprocess.DEVNULL)


def contents(root):
    """Name in the wheel and file of all that is installed below root."""
    package = next(root.rglob("planar_mapping/__init__.py")).parent
    for path in package.iterdir():
        if path.suffix in (".py", ".pyi", ".so", ".typed"):
            yield f"planar_mapping/{path.name}", path
    for path in root.rglob("libplanar_mapping_*.so.*"):
        if re.search(r"\.so\.\d+$", path.name):  # what the loader asks for; a wheel has no links
            yield f"planar_mapping/lib/{path.name}", path.resolve()
    for path in (pathlib.Path(__file__).resolve().parents[1] / "config").glob("*.yaml"):  # found upwards of the library
        yield f"planar_mapping/share/planar_mapping/config/{path.name}", path


def main(build, folder):
    version = re.search(r"CMAKE_PROJECT_VERSION:STATIC=(\S+)", (build / "CMakeCache.txt").read_text())[1]
    with tempfile.TemporaryDirectory() as root:
        root = pathlib.Path(root)
        for component in ("runtime", "python"):
            installed(build, component, root)
        files = {name: path.read_bytes() for name, path in sorted(contents(root))}
    module = next(name for name in files if "/_native." in name)
    python = "cp" + re.search(r"cpython-(\d+)", module)[1]
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    tag = f"{python}-{python}-{platform}"
    info = f"planar_mapping-{version}.dist-info/"
    files[info + "METADATA"] = (f"Metadata-Version: 2.1\nName: planar_mapping\nVersion: {version}\nSummary: Planar surface-based 3D maps\n"
                                "License: BSD-3-Clause\nRequires-Dist: numpy\n").encode()
    files[info + "WHEEL"] = f"Wheel-Version: 1.0\nGenerator: planar_mapping\nRoot-Is-Purelib: false\nTag: {tag}\n".encode()
    record = io.StringIO()
    rows = csv.writer(record, lineterminator="\n")
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        rows.writerow([name, f"sha256={digest}", len(content)])
    rows.writerow([info + "RECORD", "", ""])
    files[info + "RECORD"] = record.getvalue().encode()
    folder.mkdir(parents=True, exist_ok=True)
    wheel = folder / f"planar_mapping-{version}-{tag}.whl"
    with zipfile.ZipFile(wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, TIME)
            entry.external_attr = 0o644 << 16
            entry.compress_type = zipfile.ZIP_DEFLATED
            archive.writestr(entry, content)
    print(wheel)


if __name__ == "__main__":
    if len(sys.argv) != 3 or sys.argv[1].startswith("-"):
        sys.exit(__doc__)
    main(pathlib.Path(sys.argv[1]).resolve(), pathlib.Path(sys.argv[2]))
