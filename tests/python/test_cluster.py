# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""python3 -m planar_mapping.cluster: the same bytes from any number of workers, whatever happens to them."""
import filecmp
import os
import pathlib
import re
import shutil
import stat
import subprocess
import sys
import time

import pytest

from conftest import PLANAR_MAP, planar_map

pytest.importorskip("planar_mapping._atlas", reason="built without Ceres or SQLite")
pytest.importorskip("distributed", reason="Dask is missing (apt-get install python3-distributed)")

CUT = ["--piece-frames", "4", "--submap-frames", "2"]


def cluster(*arguments, program=PLANAR_MAP, code=0):
    command = [sys.executable, "-m", "planar_mapping.cluster", *map(str, arguments), "--program", str(program)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == code, done.stderr
    if code != 0:  # a worker of Dask that is killed while the cluster is closed says much
        assert "Traceback" not in done.stderr, done.stderr
    return done


def program_that(folder, text):
    """planar_map with something done before, where $2 is the job."""
    path = folder / "planar_map"
    path.write_text(f'#!/bin/sh\n{text}\nexec {PLANAR_MAP} "$@"\n')
    path.chmod(path.stat().st_mode | stat.S_IXUSR)
    return path


@pytest.fixture(scope="module")
def walks(tmp_path_factory):
    """Two walks in one room: three pieces and one."""
    folder = tmp_path_factory.mktemp("walks")
    size = ["--write", "images", "--width", "160", "--height", "120", "-q"]
    planar_map("simulate", "room", "--path", "return", "--frames", "13", *size, "-o", folder / "a")
    planar_map("simulate", "room", "--frames", "5", "--seed", "2", *size, "-o", folder / "b")
    return [folder / "a", folder / "b"]


@pytest.fixture(scope="module")
def one_process(walks, tmp_path_factory):
    """What planar_map run makes of the plan."""
    folder = tmp_path_factory.mktemp("one")
    planar_map("atlas", "plan", *walks, "-o", folder / "plan.json", "-q", *CUT)
    planar_map("run", "--plan", folder / "plan.json", "-o", folder / "out", "-q")
    return folder / "out"


def expect_same(one, other):
    def files_of(folder):
        return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())

    names = files_of(one)
    assert names == files_of(other)
    assert filecmp.cmpfiles(one, other, names, shallow=False) == (names, [], [])


@pytest.mark.parametrize("workers", [1, 2, 4])
def test_any_number_of_workers_makes_the_bytes_of_one_process(workers, walks, one_process, tmp_path):
    done = cluster(*walks, *CUT, "-o", tmp_path / "out", "--workers", workers)
    assert done.stdout.strip() == str(tmp_path / "out/map.pmap")
    assert "submaps 4/4, took" in done.stderr
    expect_same(one_process, tmp_path / "out")


@pytest.fixture(scope="module")
def one_process_tiled(walks, tmp_path_factory):
    folder = tmp_path_factory.mktemp("tiled")
    planar_map("atlas", "plan", *walks, "-o", folder / "plan.json", "-q", *CUT, "--tile", "4")
    planar_map("run", "--plan", folder / "plan.json", "-o", folder / "out", "-q")
    return folder / "out"


def test_tiles_are_jobs_of_the_workers(walks, one_process_tiled, tmp_path):
    done = cluster(*walks, *CUT, "--tile", "4", "-o", tmp_path / "out", "--workers", 2)
    tiles = len(list((tmp_path / "out/tiles_0").glob("*.pmap")))
    assert tiles > 3 and f"tiles {tiles}/{tiles}, took" in done.stderr
    assert done.stdout.strip() == str(tmp_path / "out")
    expect_same(one_process_tiled, tmp_path / "out")


@pytest.mark.parametrize("whom", ["$PPID", "$PPID $$"], ids=["worker", "worker_and_job"])
@pytest.mark.parametrize("last", ["join", "tile"])
def test_a_worker_that_is_killed_in_each_phase_changes_nothing(whom, last, walks, one_process, one_process_tiled, tmp_path):
    kill = f'mkdir {tmp_path}/killed_$2 2>/dev/null && (sleep 0.0$(($$ % 10)); kill -9 {whom}) &'
    program = program_that(tmp_path, f'[ "$1" = atlas ] && [ "$2" != plan ] && {kill}')
    tile = ["--tile", "4"] if last == "tile" else []
    cluster(*walks, *CUT, *tile, "-o", tmp_path / "out", "--workers", 2, "-q", program=program)
    killed = {path.name for path in tmp_path.glob("killed_*")}
    assert killed == {f"killed_{job}" for job in ("submap", "places", "links", "solve", last)}
    expect_same(one_process_tiled if tile else one_process, tmp_path / "out")


def test_a_job_that_fails_is_named_and_left_out_only_when_asked(walks, one_process, tmp_path):
    program = program_that(tmp_path, f'[ "$2 $4" = "submap 1" ] && echo x >> {tmp_path}/attempts && echo "disk is full" >&2 && exit 1')
    done = cluster(*walks, *CUT, "-o", tmp_path / "out", "--workers", 2, program=program, code=1)
    assert f"piece 1 ({walks[0]} frames 4:9:1) failed 3 times: disk is full" in done.stderr
    assert (tmp_path / "attempts").read_text().count("x") == 3
    assert not (tmp_path / "out/map.pmap").exists()
    done = cluster(*walks, *CUT, "-o", tmp_path / "out", "--workers", 2, "--allow-missing", program=program, code=5)
    assert "1 of 4 pieces are missing" in done.stderr
    cluster(*walks, *CUT, "-o", tmp_path / "out", "--workers", 2, "-q")  # the disk has room again
    expect_same(one_process, tmp_path / "out")


def test_results_that_were_cut_short_are_made_again(walks, one_process, tmp_path):
    out = tmp_path / "out"
    shutil.copytree(one_process, out)
    for name in ("piece_0.atlas", "places.json", "links_1.json", "survey.atlas"):
        (out / name).write_bytes((out / name).read_bytes()[:1000])
    cluster("--plan", out / "plan.json", "-o", out, "--workers", 2, "-q")
    expect_same(one_process, out)


def test_a_scheduler_that_is_not_there_is_a_sentence_within_ten_seconds(walks, tmp_path):
    start = time.monotonic()
    done = cluster(*walks, "-o", tmp_path / "out", "--scheduler", "tcp://127.0.0.1:9", code=4)
    assert time.monotonic() - start < 10.0
    assert "the scheduler tcp://127.0.0.1:9 does not answer" in done.stderr
    assert done.stderr.count("\n") == 1


def test_workers_that_do_not_come_back_are_a_sentence(monkeypatch):
    import distributed

    import planar_mapping.cluster as module

    monkeypatch.setattr(module, "WORKERLESS_S", 1)
    with distributed.LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0") as empty:
        with distributed.Client(empty) as client, pytest.raises(module.ClusterError, match="no worker has been there for 1 s"):
            list(module.completed(client, [client.submit(len, "abc")]))


def test_a_worker_of_another_version_is_refused_by_name(walks, tmp_path):
    other = f'[ "$1" = --version ] && mkdir {tmp_path}/first 2>/dev/null || [ "$1" != --version ] || {{ echo planar_map 0.0.9; exit; }}'
    done = cluster(*walks, "-o", tmp_path / "out", "--workers", 1, program=program_that(tmp_path, other), code=4)
    assert re.search(r"worker 0 \(tcp://127.0.0.1:\d+\) has planar_map 0.0.9, and this machine has planar_map \d", done.stderr)


def test_without_tls_nothing_listens_on_the_network(walks, tmp_path):
    for where in (["--host", "0.0.0.0"], ["--scheduler", "tcp://192.0.2.1:8786"]):
        done = cluster(*walks, "-o", tmp_path / "out", *where, code=2)
        assert "is reached over the network without TLS" in done.stderr
    done = cluster(*walks, "-o", tmp_path / "out", "--tls-ca", "ca.pem", code=2)
    assert "TLS needs --tls-ca, --tls-cert and --tls-key" in done.stderr


def sockets_of(root):
    """Inodes of the sockets of a process and of all that it started."""
    parents = {}
    for folder in pathlib.Path("/proc").glob("[0-9]*"):
        try:
            parents[folder.name] = (folder / "stat").read_text().rpartition(")")[2].split()[1]
        except OSError:
            continue
    family = {str(root)}
    while more := {child for child, parent in parents.items() if parent in family} - family:
        family |= more
    links = [os.readlink(file) for one in family for file in pathlib.Path(f"/proc/{one}/fd").glob("*") if file.is_symlink()]
    return {link[8:-1] for link in links if link.startswith("socket:[")}


@pytest.mark.skipif(not pathlib.Path("/proc/net/tcp").exists(), reason="there is no /proc/net/tcp")
def test_all_that_listens_is_on_the_loopback(walks, tmp_path):
    wait = f'[ "$2" = submap ] && touch {tmp_path}/begun && while [ ! -e {tmp_path}/go ]; do sleep 0.1; done'
    command = [sys.executable, "-m", "planar_mapping.cluster", *walks, *CUT, "-o", tmp_path / "out", "--workers", "2", "-q",
               "--program", program_that(tmp_path, wait)]
    with subprocess.Popen(command) as run:
        for _ in range(300):
            if (tmp_path / "begun").exists():
                break
            time.sleep(0.1)
        own = sockets_of(run.pid)
        rows = [line.split() for name in ("tcp", "tcp6") if os.path.exists(f"/proc/net/{name}")
                for line in pathlib.Path(f"/proc/net/{name}").read_text().splitlines()[1:]]
        addresses = [row[1].split(":")[0] for row in rows if row[3] == "0A" and row[9] in own]
        (tmp_path / "go").touch()
    assert run.returncode == 0
    assert len(addresses) >= 5 and set(addresses) == {"0100007F"}  # 127.0.0.1: scheduler, workers, nannies


@pytest.mark.skipif(shutil.which("openssl") is None, reason="openssl is missing")
def test_with_certificates_all_connections_are_encrypted(walks, one_process, tmp_path):
    pem, key = tmp_path / "cert.pem", tmp_path / "key.pem"
    subprocess.run(["openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-subj", "/CN=test", "-days", "1",
                    "-keyout", key, "-out", pem], check=True, capture_output=True)
    tls = ["--tls-ca", pem, "--tls-cert", pem, "--tls-key", key]
    cluster(*walks, *CUT, "-o", tmp_path / "out", "--workers", 1, "-q", *tls)
    expect_same(one_process, tmp_path / "out")


def test_inputs_that_cannot_be_read_are_named(tmp_path):
    done = cluster(tmp_path / "none", "-o", tmp_path / "out", "--workers", 1, code=4)
    assert f"{tmp_path / 'none'}: no such file" in done.stderr


def test_a_stale_plan_is_refused(walks, one_process, tmp_path):
    done = cluster(*walks, "--piece-frames", "5", "-o", one_process, "--workers", 1, code=4)
    assert "has results of another plan" in done.stderr
    assert pathlib.Path(one_process / "map.pmap").exists()


def test_a_plan_of_files_that_changed_is_refused_by_the_job_that_reads_them(walks, tmp_path):
    shutil.copytree(walks[1], tmp_path / "walk")
    planar_map("atlas", "plan", tmp_path / "walk", "-o", tmp_path / "plan.json", "-q", *CUT)
    (tmp_path / "walk/left/000002.png").write_bytes((walks[1] / "left/000003.png").read_bytes())
    done = cluster("--plan", tmp_path / "plan.json", "-o", tmp_path / "out", "--workers", 1, code=1)
    assert "its files have changed since the plan was made" in done.stderr


def test_walks_without_a_common_place_are_said_to_be_components(tmp_path):
    for seed in (3, 4):
        planar_map("simulate", "building", "--write", "description", "--width", "160", "--height", "120", "--baseline", "0.48",
                   "--frames", "8", "--seed", str(seed), "-q", "-o", tmp_path / f"walk_{seed}")
    done = cluster(tmp_path / "walk_3", tmp_path / "walk_4", *CUT, "-o", tmp_path / "out", "--workers", 1)
    assert "1 more components have no link with the first" in done.stderr


@pytest.mark.skipif(shutil.which("parallel") is None, reason="GNU parallel is missing")
@pytest.mark.parametrize("tile", [False, True])
def test_gnu_parallel_does_the_same(tile, one_process, one_process_tiled, tmp_path):
    (tmp_path / "planar_map").symlink_to(PLANAR_MAP)
    expected = one_process_tiled if tile else one_process
    out = tmp_path / "out"
    out.mkdir()
    script = pathlib.Path(__file__).parents[2] / "examples/cluster/with_parallel.sh"
    subprocess.run([script, expected / "plan.json", out, "-j", "2"], check=True, timeout=120, capture_output=True,
                   env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"})
    expect_same(expected, out)


def test_arrays_of_slurm_do_the_same(walks, one_process, tmp_path):
    """sbatch is played by a script that does each task of an array."""
    sbatch = tmp_path / "sbatch"
    sbatch.write_text("""#!/usr/bin/env python3
import os, subprocess, sys
given = sys.argv[1:]
first, last = given[given.index("-a") + 1].split("-") if "-a" in given else (0, 0)
for task in range(int(first), int(last) + 1):
    subprocess.run(["bash", "-c", given[given.index("--wrap") + 1]], check=True, stdout=subprocess.DEVNULL,
                   env={**os.environ, "SLURM_ARRAY_TASK_ID": str(task)})
print(7)
""")
    sbatch.chmod(0o755)
    (tmp_path / "planar_map").symlink_to(PLANAR_MAP)
    script = pathlib.Path(__file__).parents[2] / "examples/cluster/with_slurm.sh"
    out = tmp_path / "out"
    out.mkdir()
    subprocess.run([script, one_process / "plan.json", out, "--time=10"], check=True, timeout=120,
                   env={**os.environ, "PATH": f"{tmp_path}:{os.environ['PATH']}"})
    expect_same(one_process, out)
