# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Pages for browsers, opened in Chromium from files."""
import base64
import html
import io
import json
import os
import re
import shutil
import subprocess

import numpy as np
import pytest

import planar_mapping
from conftest import T_WORLD_CAMERA, cloud_of, planar_map

CHROMIUM = shutil.which("chromium") or shutil.which("chromium-browser")
needs_chromium = pytest.mark.skipif(CHROMIUM is None, reason="there is no Chromium (install chromium)")


@pytest.fixture(scope="module")
def out(sequence, tmp_path_factory):
    """A run whose names and messages are markup."""
    folder = tmp_path_factory.mktemp("pages") / 'run <b>&"1"'
    planar_map("run", "pcd_sequence.yaml", "-i", sequence, "-o", folder, "-q")
    with open(folder / "run.log", "a", encoding="utf-8") as log:
        log.write("warning: </script><script>console.error('run')</script>\n")
    return folder


@pytest.fixture(scope="module")
def page(out, tmp_path_factory):
    path = tmp_path_factory.mktemp("page") / "report.html"
    try:
        planar_map("report", out, "-o", path)
    except subprocess.CalledProcessError as error:
        if "built without (libjs-three)" in error.stderr:
            pytest.skip("three.js was absent when this was built (install libjs-three)")
        raise
    return path


def chromium(page, *options, hash=""):
    return subprocess.run(
        [CHROMIUM, "--headless", "--no-sandbox", "--use-gl=angle", "--use-angle=swiftshader",
         "--enable-unsafe-swiftshader", "--hide-scrollbars", "--window-size=1280,800", *options, page.as_uri() + hash],
        check=True, capture_output=True, text=True, timeout=120,
        env={k: v for k, v in os.environ.items() if k != "LD_PRELOAD"})  # of sanitizers


def self_test(page):
    """What the page says after it clicked on itself, and its document."""
    document = chromium(page, "--dump-dom", hash="#selftest").stdout
    return json.loads(html.unescape(re.search('<pre id="selftest"[^>]*>(.*?)</pre>', document)[1])), document


@pytest.fixture(scope="module")
def said(page):
    return self_test(page)


def data_of(page):
    return json.loads(re.search('<script id="data" type="application/json">(.*?)</script>', page.read_text("utf-8"))[1])


def axes_of(cuboids):
    """Columns are the axes u, v, n in the map: (N, 3, 3)."""
    x, y, z, w = np.moveaxis(cuboids["orientation"], -1, 0)
    return np.stack([1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w),
                     2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w),
                     2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)], axis=-1).reshape(-1, 3, 3)


def silhouette(cuboids, matrix, camera, width, height):
    """Pixels that the cuboids cover, those that are not hidden because they are seen from behind."""
    from matplotlib.path import Path

    corners = np.array([[i, j, k] for i in (-0.5, 0.5) for j in (-0.5, 0.5) for k in (-0.5, 0.5)])
    pixels = np.stack(np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5), axis=-1).reshape(-1, 2)
    covered = np.zeros(width * height, bool)
    axes = axes_of(cuboids)
    for cuboid, R in zip(cuboids, axes):
        if cuboid["plane_id"] >= 0 and R[:, 2] @ (camera - cuboid["center"]) < 0:
            continue
        places = cuboid["center"] + (corners * cuboid["size"]) @ R.T
        clip = np.c_[places, np.ones(8)] @ matrix.T
        ends = (clip[:, :2] / clip[:, 3:] * [0.5, -0.5] + 0.5) * [width, height]
        for face in ([0, 1, 3, 2], [4, 5, 7, 6], [0, 1, 5, 4], [2, 3, 7, 6], [0, 2, 6, 4], [1, 3, 7, 5]):
            covered |= Path(ends[face]).contains_points(pixels)
    return covered.reshape(height, width)


def is_drawn(picture):
    """Pixels that are not of the background."""
    from matplotlib.image import imread

    return np.abs(imread(picture)[..., :3] * 255 - [0xE9, 0xED, 0xF2]).max(axis=-1) > 6


def test_page_holds_all_it_needs(page):
    text = page.read_text("utf-8")
    outside = re.sub('<script id="data".*?</script>', "", text, flags=re.DOTALL)
    assert len(outside) < 3_000_000
    assert "Permission is hereby granted" in outside
    assert not re.search(r'<(?:script|img|iframe)[^>]*\ssrc=|<link|@import|fetch\(["\']http', outside)
    assert not any(pattern in text for pattern in ("<b>&", "console.error('run')"))  # what a run says is no markup
    data = data_of(page)
    assert base64.b64decode(data["title"]).decode() == 'run run <b>&"1"'


def test_same_map_gives_same_bytes(out, page, tmp_path):
    planar_map("report", out, "-o", tmp_path / "again.html")
    assert (tmp_path / "again.html").read_bytes() == page.read_bytes()
    refused = subprocess.run([*map(str, (planar_map.__globals__["PLANAR_MAP"], "report", out, "-o", page))],
                             capture_output=True, text=True, check=False)
    assert refused.returncode == 2 and "--force" in refused.stderr


def test_page_holds_the_map(out, page):
    world = planar_mapping.PlanarMap.load(out / "map.pmap")
    cuboids = world.cuboids()
    records = np.frombuffer(base64.b64decode(data_of(page)["occupied"]), np.dtype(
        [("center", "<f4", 3), ("orientation", "<f4", 4), ("size", "<f4", 3), ("probability", "<f4"),
         ("plane_id", "<i4"), ("colour", "u1", 4)]))
    for field in ("center", "orientation", "size", "probability", "plane_id"):
        np.testing.assert_allclose(records[field], cuboids[field], rtol=1e-6, atol=1e-6)
    assert len(data_of(page)["planes"]) == len(world.planes()) and data_of(page)["frames"] == world.frames
    plan, expected = data_of(page)["plans"][0], world.plan()
    runs = np.frombuffer(base64.b64decode(plan["runs"]), np.dtype([("value", "u1"), ("count", "<u2")]))
    values = np.repeat(np.array([0, 100, -1], np.int8)[runs["value"]], runs["count"])
    np.testing.assert_array_equal(values.reshape(plan["height"], plan["width"]), expected.values)


@needs_chromium
def test_browser_draws_the_cuboids(out, said):
    said, document = said
    assert said["errors"] == []
    picture = io.BytesIO(base64.b64decode(said["picture"].split(",")[1]))
    drawn = is_drawn(picture)
    matrix = np.array(said["matrix"]).reshape(4, 4).T
    cuboids = planar_mapping.PlanarMap.load(out / "map.pmap").cuboids()
    expected = silhouette(cuboids, matrix, np.array(said["camera"]), drawn.shape[1], drawn.shape[0])
    assert expected.mean() > 0.05
    assert (drawn & expected).sum() / (drawn | expected).sum() > 0.97
    assert "</script><script>console.error('run')</script>" in html.unescape(document)  # shown as a warning


@needs_chromium
def test_click_shows_a_cuboid_and_two_clicks_measure(out, said):
    said, _ = said
    world = planar_mapping.PlanarMap.load(out / "map.pmap")
    cuboid = world.cuboids()[said["clicked"]]
    shown = dict(said["shown"])
    np.testing.assert_allclose([float(v) for v in shown["centre, m"].split(",")], cuboid["center"], atol=6e-4)
    np.testing.assert_allclose([float(v) for v in shown["size, m"].split(",")], cuboid["size"], atol=6e-4)
    assert shown["plane"] == (str(cuboid["plane_id"]) if cuboid["plane_id"] >= 0 else "none")
    ends = np.array([said["measured"]["from"], said["measured"]["to"]])
    assert f"{np.linalg.norm(ends[1] - ends[0]):.2f} m" in said["measured"]["text"]
    for end in ends:  # on the surface of a cuboid
        local = np.einsum("nji,nj->ni", axes_of(world.cuboids()), end - world.cuboids()["center"])
        beyond = (np.abs(local) - world.cuboids()["size"] / 2).max(axis=1)
        assert np.abs(beyond).min() < 1e-4


@needs_chromium
def test_screenshot_is_not_blank(page, tmp_path):
    chromium(page, f"--screenshot={tmp_path / 'page.png'}", "--virtual-time-budget=10000")
    drawn = is_drawn(tmp_path / "page.png")
    assert 0.1 < drawn[60:, :900].mean() < 0.9  # of the view, below its switches


@needs_chromium
def test_page_of_20000_cuboids_takes_few_draw_calls(page, tmp_path):
    # Isolated cells, 2 m ahead and apart from each other.
    rows, columns, layers = np.mgrid[0:30, 0:30, 0:24]
    centres = np.stack([columns * 0.5, rows * 0.5, layers * 0.5 + 2.0], axis=-1).reshape(-1, 3) + 0.05
    jitter = np.random.default_rng(1).uniform(-0.03, 0.03, (30, 1, 3))
    world = planar_mapping.PlanarMap(resolution=0.1, unknown_space=False)
    world.insert((centres[None] + jitter).reshape(-1, 3).astype(np.float32), T_WORLD_CAMERA, min_inliers=2_000_000)
    assert len(world) > 20_000
    world.export(tmp_path / "many.html")
    said, _ = self_test(tmp_path / "many.html")
    assert said["errors"] == [] and said["cuboids"] == len(world)
    assert said["calls"] < 10
    print(f"{len(world)} cuboids: {said['frame_ms']:.1f} ms a frame without a graphics card")
