# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""The Debian packages of a build tree, as a user meets them: installed into a root of their own beside what dpkg knows to be
on this machine, started with an empty environment, and built against. BUILD names the build tree."""
import os
import pathlib
import re
import shutil
import subprocess
import sys

import pytest

BUILD = pathlib.Path(os.environ["BUILD"])
SOURCE = pathlib.Path(__file__).resolve().parents[2]
EMPTY = {"PATH": "/usr/bin:/bin"}
PACKAGES = ["libplanar-mapping0", "libplanar-mapping-dev", "planar-mapping-doc", "planar-mapping-tools", "planar-mapping-viewer",
            "python3-planar-mapping"]


def run(*arguments, **options):
    options.setdefault("env", EMPTY)
    done = subprocess.run([str(a) for a in arguments], capture_output=True, text=True, check=False, **options)
    assert done.returncode == 0, f"{arguments}\n{done.stdout}{done.stderr}"
    return done.stdout


@pytest.fixture(scope="session")
def packages(tmp_path_factory):
    folder = tmp_path_factory.mktemp("packages")
    run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", folder)
    found = {path.name.split("_")[0]: path for path in folder.glob("*.deb")}
    assert sorted(found) == sorted(PACKAGES)
    yield found
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def root(packages, tmp_path_factory):
    """dpkg refuses packages that share a file, and dependencies that are not installed here."""
    folder = tmp_path_factory.mktemp("root")
    database = folder / "var/lib/dpkg"
    (database / "info").mkdir(parents=True)
    (database / "updates").mkdir()
    (database / "info/format").write_text("1\n")
    # Other versions of ours on this machine do not count.
    known = pathlib.Path("/var/lib/dpkg/status").read_text().split("\n\n")
    ours = re.compile(r"^Package: (%s)$" % "|".join(PACKAGES), re.MULTILINE)
    (database / "status").write_text("\n\n".join(entry for entry in known if not ours.search(entry)))
    run("dpkg", f"--root={folder}", "--force-not-root", "--force-script-chrootless", "--no-triggers", "-i", *packages.values(),
        env={**EMPTY, "PATH": "/usr/sbin:/usr/bin:/sbin:/bin"})
    yield folder
    shutil.rmtree(folder)


@pytest.fixture(scope="session")
def cloud(tmp_path_factory):
    """A floor and a wall."""
    path = tmp_path_factory.mktemp("cloud") / "cloud.pcd"
    points = [f"{1 + 0.02 * i:.2f} {0.02 * j - 1:.2f} -0.5\n3 {0.02 * j - 1:.2f} {0.02 * i - 0.45:.2f}\n"
              for i in range(100) for j in range(100)]
    path.write_text("VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH 20000\nHEIGHT 1\n"
                    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS 20000\nDATA ascii\n" + "".join(points))
    return path


def fields(package):
    text = run("dpkg-deb", "--field", package)
    return dict(line.split(": ", 1) for line in text.splitlines() if ": " in line and not line.startswith(" "))


def test_dependencies_are_those_of_the_files(packages):
    depends = {name: fields(path).get("Depends", "") for name, path in packages.items()}
    version = fields(packages["libplanar-mapping0"])["Version"]
    for library in ["libpcl-common1.13", "libopencv-core406", "libyaml-cpp0.7", "libzstd1", "libpng16-16"]:
        assert library in depends["libplanar-mapping0"]
    for name in PACKAGES:
        assert ("libvtk9" in depends[name]) == (name == "planar-mapping-viewer"), name
        if name not in ("libplanar-mapping0", "planar-mapping-doc"):
            assert f"libplanar-mapping0 (= {version})" in depends[name], name
    for needed in ["libeigen3-dev", "libpcl-dev", f"planar-mapping-viewer (= {version})"]:
        assert needed in depends["libplanar-mapping-dev"]
    assert re.search(r"python3 \(>= 3\.\d+\), python3 \(<< 3\.\d+\), python3-numpy", depends["python3-planar-mapping"])
    assert fields(packages["planar-mapping-doc"])["Architecture"] == "all"


def test_programs_run_with_an_empty_environment(root, cloud, tmp_path):
    program = root / "usr/bin/planar_map"
    # A ready configuration by its name, then what needs the viewer's library.
    run(program, "run", "single_pcd.yaml", "-i", cloud, "-o", tmp_path / "out", "-q", env={}, cwd=tmp_path)
    assert "cuboids" in run(program, "info", tmp_path / "out/map.pmap", env={}, cwd=tmp_path)
    run(program, "snapshot", tmp_path / "out/map.pmap", "-o", tmp_path / "map.png", "--size", "160x120", env={})
    assert (tmp_path / "map.png").read_bytes().startswith(b"\x89PNG")


def test_nothing_names_the_build_tree(root):
    for path in [*root.glob("usr/bin/*"), *root.glob("usr/lib/**/*.so*")]:
        if not path.read_bytes().startswith(b"\x7fELF"):
            assert str(BUILD) not in path.read_text() and str(SOURCE) not in path.read_text(), path
            continue
        dynamic = run("readelf", "-d", path)
        assert str(BUILD) not in dynamic and re.search(r"RUNPATH.*\[\$ORIGIN/", dynamic), path
    for path in root.glob("usr/lib/**/*.cmake"):
        assert str(BUILD) not in path.read_text() and str(SOURCE) not in path.read_text(), path


def test_python_imports_and_maps(root, cloud, tmp_path):
    code = ("import planar_mapping as pm; m = pm.PlanarMap(); m.insert(pm.read_cloud('%s')[0]);"
            "print(len(m), pm.run('single_pcd.yaml', '%s', '%s')['frames'])" % (cloud, cloud, tmp_path / "out"))
    packages = root / "usr/lib/python3/dist-packages"
    cuboids, frames = run(sys.executable, "-c", code, env={"PYTHONPATH": str(packages)}).split()
    assert int(cuboids) >= 2 and frames == "1"
    assert (packages / "planar_mapping/__init__.pyi").exists() and (packages / "planar_mapping/py.typed").exists()


def test_the_python_example_runs_from_the_documentation(root, tmp_path):
    pytest.importorskip("matplotlib", reason="matplotlib is missing: install python3-matplotlib")
    script = root / "usr/share/doc/planar-mapping-doc/examples/python/map_rgbd.py"
    environment = {"PYTHONPATH": str(root / "usr/lib/python3/dist-packages"), "MPLCONFIGDIR": str(tmp_path)}
    assert run(sys.executable, script, cwd=tmp_path, env=environment).startswith("5 frames")
    assert (tmp_path / "map.png").exists()


def test_each_package_has_its_licence_and_tools_their_manual_pages(root):
    for name in PACKAGES:
        assert "BSD 3-Clause" in (root / "usr/share/doc" / name / "copyright").read_text()
    pages = {path.name for path in root.glob("usr/share/man/man1/*")}
    assert {"planar_map.1.gz", "planar_map-run.1.gz", "planar_map-convert.1.gz", "planar_map-atlas.1.gz", "planar_map-localize.1.gz", "planar_map_viewer.1.gz", "planar_map-view.1.gz", "planar_map-snapshot.1.gz"} <= pages
    page = run("man", "-l", root / "usr/share/man/man1/planar_map-run.1.gz") if shutil.which("man") else "--resume planar_map run"
    assert "planar_map run" in page and "--resume" in page
    assert (root / "usr/share/doc/planar-mapping-doc/docs/install.md").exists()


def test_bash_completes_commands_options_keys_and_ready_configurations(root):
    script = (f"PATH={root}/usr/bin:$PATH; source {root}/usr/share/bash-completion/completions/planar_map;"
              "complete_line() { COMP_WORDS=(\"$@\"); COMP_CWORD=$(($# - 1)); _planar_map; echo \"${COMPREPLY[*]}\"; };"
              "complete_line planar_map con; complete_line planar_map run --res; complete_line planar_map run single;"
              "complete_line planar_map_viewer --snap; complete_line planar_map run --set multi_plane_segmentation.me;"
              "complete_line planar_map run --set multi_plane_segmentation.method = org;"
              "complete_line planar_map atlas s; complete_line planar_map atlas solve --with; complete_line planar_map lo; complete_line planar_map localize --fr")
    lines = run("bash", "-c", script, cwd=root).splitlines()
    assert lines == ["config convert", "--resume", "single_pcd.yaml", "--snapshot", "multi_plane_segmentation.method=", "organized",
                     "solve split submap", "--without-loop --with-loop", "localize", "--frames"]


def configure(source, folder, root):
    run("cmake", "-S", source, "-B", folder, "-G", "Ninja", f"-DCMAKE_PREFIX_PATH={root}/usr")
    run("cmake", "--build", folder)


def test_examples_build_where_they_are_copied_to(root, tmp_path):
    # From the documentation package, as a user has them.
    shutil.copytree(root / "usr/share/doc/planar-mapping-doc/examples", tmp_path / "examples")
    configure(tmp_path / "examples", tmp_path / "build", root)
    assert "100% tests passed" in run("ctest", "--test-dir", tmp_path / "build")
    run("cmake", "-S", tmp_path / "examples/own_stage", "-B", tmp_path / "alone", f"-DCMAKE_PREFIX_PATH={root}/usr")


def test_the_readme_builds_as_it_stands(root, cloud, tmp_path):
    for page, language, file in [("docs/install.md", "cmake", "CMakeLists.txt"), ("docs/install.md", "cpp", "my_node.cpp")]:
        blocks = re.findall(rf"```{language}\n(.*?)```", (SOURCE / page).read_text(), re.DOTALL)
        (tmp_path / file).write_text(next(block for block in blocks if "my_node" in block or "loadPCDFile" in block))
    configure(tmp_path, tmp_path / "build", root)
    assert re.search(r"2 planes, \d+ cuboids", run(tmp_path / "build/my_node", cloud, env={}))
