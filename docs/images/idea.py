#!/usr/bin/env python3
"""Draws docs/images/idea.png: a wall seen from above as points, as voxels and as one cuboid."""
import os

import matplotlib
matplotlib.use("Agg")
import matplotlib.pyplot as plt
import numpy as np
from matplotlib.patches import Polygon, Rectangle

CELL = 0.1
rng = np.random.default_rng(1)
angle = np.deg2rad(20)
along, across = np.array([np.cos(angle), np.sin(angle)]), np.array([-np.sin(angle), np.cos(angle)])
start, length = np.array([0.5, 1.4]), 3.0
points = start + rng.uniform(0, length, 260)[:, None] * along + rng.normal(0, 0.012, 260)[:, None] * across
sensor = np.array([2.0, 0.3])
ends = [start, start + length * along]

figure, axes = plt.subplots(1, 3, figsize=(12, 3.4))
cells = {tuple(c) for c in np.floor(points / CELL).astype(int)}
titles = ("measured: points on a plane", f"voxels: {len(cells)} cells", "ours: 1 cuboid, belief 0.97")
for axis, title in zip(axes, titles):
    axis.set_facecolor("0.82")  # unknown
    if axis is not axes[0]:
        axis.add_patch(Polygon([sensor, *ends], color="#d8efd3"))  # free
    axis.plot(*sensor, "k^", ms=8)
    axis.set(xlim=(0, 4), ylim=(0, 2.8), aspect="equal", title=title, xticks=[], yticks=[])
axes[0].plot(*points.T, ".", ms=3, color="tab:blue")
axes[0].annotate("", xy=sensor, xytext=ends[1], arrowprops={"arrowstyle": "-", "color": "0.5"})
axes[0].annotate("", xy=sensor, xytext=ends[0], arrowprops={"arrowstyle": "-", "color": "0.5"})
for cell in cells:
    axes[1].add_patch(Rectangle(np.array(cell) * CELL, CELL, CELL, ec="k", fc="tab:red", lw=0.4))
half = 0.5 * CELL * across
axes[2].add_patch(Polygon([ends[0] - half, ends[1] - half, ends[1] + half, ends[0] + half], ec="k", fc="tab:red", lw=0.8))
axes[2].text(2.0, 1.1, "free", ha="center", color="#3a7d2c")
axes[2].text(1.2, 2.4, "unknown", ha="center", color="0.35")
figure.tight_layout()
figure.savefig(os.path.join(os.path.dirname(os.path.abspath(__file__)), "idea.png"), dpi=90)
