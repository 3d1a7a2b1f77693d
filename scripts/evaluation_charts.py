#!/usr/bin/python3
"""Figures of evaluation.json (and ablation.json) in the folders that `planar_map evaluate` wrote."""
# The system's Python, for which Debian's python3-matplotlib is installed.
import argparse
import json
import os
import sys

EXISTS, UNREADABLE, UNWRITABLE, NO_RENDERER = 2, 4, 1, 7  # exit codes of planar_map

# Colours that also differ for colour-blind readers (Okabe and Ito).
METHODS = {
    "SG": ("SG (standard grid)", "#5a5a5a", "s-"),
    "OG": ("OG (octree)", "#0072b2", "D-"),
    "RA": ("RA (rectangular cuboids)", "#e69f00", "x-"),
    "PG_paper": ("PG (paper)", "#009e73", "+--"),
    "no_planes": ("PG without planes (boxes)", "#cc79a7", "v-"),
    "PG": ("PG (compact)", "#d55e00", "o-"),
}
PAPER = ("SG", "OG", "RA", "PG_paper", "PG")
SIZE = ("cell_m", "cell size s [m]", 1.0)
# File: rows of (x, y, logarithmic axes, methods); an axis is column, title, factor.
FIGURES = {
    "fig12_combination_efficiency.png": [(SIZE, ("combination_efficiency", "combination efficiency", 1.0), "", PAPER[1:])],
    "fig13_mapping_error.png": [(SIZE, ("error_percent", "mapping error [%]", 1.0), "", PAPER)],
    "fig14_memory_file_time.png": [
        (SIZE, ("memory_bytes", "memory [kB]", 1e-3), "y", PAPER),
        (SIZE, ("file_bytes", "file [kB]", 1e-3), "y", PAPER),
        (SIZE, ("time_ms_per_frame", "time a frame [ms]", 1.0), "y", PAPER)],
    "cells_at_equal_error.png": [
        (("surface_median_m", "distance of the surface, median [mm]", 1e3), ("cells", "cells", 1.0), "xy",
         ("SG", "OG", "RA", "no_planes", "PG")),
        (("free_space_violation", "free space marked occupied [%]", 1e2), ("cells", "cells", 1.0), "xy",
         ("SG", "OG", "RA", "no_planes", "PG"))],
}


def fail(code, sentence):
    print(f"planar_map: {sentence}", file=sys.stderr)
    sys.exit(code)


def rows_of(folder):
    """The rows of both tables: a method that is in both counts once."""
    rows = {}
    for name in ("ablation.json", "evaluation.json"):
        path = os.path.join(folder, name)
        if name == "ablation.json" and not os.path.exists(path):
            continue
        try:
            with open(path, encoding="utf-8") as file:
                rows.update({(r["scene"], r["cell_m"], r["method"]): r for r in json.load(file)["results"]})
        except OSError as error:
            fail(UNREADABLE, f"{path}: {error.strerror}")
        except (ValueError, KeyError, TypeError) as error:
            fail(UNREADABLE, f"{path}: not what planar_map evaluate writes: {error!r}")
    return list(rows.values())


def draw_line(axes, rows, x, y, method):
    """\\return whether there was a point to draw; quartiles of places stand on charts over cell sizes"""
    columns = (x[0], y[0])
    points = [row for row in rows if row["method"] == method and None not in [row.get(c) for c in columns]]
    if not points:
        return False
    points.sort(key=lambda row: row["cell_m"])
    label, color, style = METHODS[method]
    xs = [x[2] * row[x[0]] for row in points]
    axes.plot(xs, [y[2] * row[y[0]] for row in points], style, color=color, label=label, markersize=6)
    if x == SIZE:
        quartiles = [[y[2] * q for q in row["spread"][y[0]]] for row in points]
        axes.vlines(xs, *zip(*quartiles), color=color, alpha=0.5, linewidth=1)
    return True


def draw(rows, charts, path, force):
    """A row of the page for each of the charts, a column for each scene that has its figures. \\return whether any has"""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure
    from matplotlib.ticker import LogLocator, NullFormatter
    scenes = list(dict.fromkeys(row["scene"] for row in rows))
    scenes = [s for s in scenes if any(row["scene"] == s and row.get(c[i][0]) is not None and row["method"] in c[3]
                                       for row in rows for c in charts for i in (0, 1) if c[i] != SIZE)]
    if not scenes:
        return False
    if os.path.exists(path) and not force:
        fail(EXISTS, f"'{path}' exists; --force overwrites it")
    figure = Figure(figsize=(5.2 * len(scenes), 3.9 * len(charts)), dpi=100, layout="constrained")
    FigureCanvasAgg(figure)
    legend = {}
    page = figure.subplots(len(charts), len(scenes), squeeze=False)
    for row_of_axes, (x, y, logarithmic, methods) in zip(page, charts):
        for axes, scene in zip(row_of_axes, scenes):
            of_scene = [row for row in rows if row["scene"] == scene]
            drawn = [draw_line(axes, of_scene, x, y, method) for method in methods]
            if not any(drawn):
                axes.set_visible(False)
                continue
            axes.set(title=scene, xlabel=x[1], ylabel=y[1], **{f"{axis}scale": "log" for axis in logarithmic})
            for axis in (getattr(axes, f"{name}axis") for name in logarithmic):
                axis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0)))
                axis.set_major_formatter("{x:g}")
                axis.set_minor_formatter(NullFormatter())
            axes.grid(color="#dee0e4")
            legend.update({text: handle for handle, text in zip(*axes.get_legend_handles_labels())})
    figure.legend(legend.values(), legend.keys(), loc="upper center", bbox_to_anchor=(0.5, 0.0), ncol=3, frameon=False)
    try:
        figure.savefig(path + ".tmp", format="png", bbox_inches="tight", metadata={"Software": None})
        os.replace(path + ".tmp", path)
    except OSError as error:
        fail(UNWRITABLE, f"{path}: {error.strerror}")
    return True


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("folders", nargs="+", metavar="DIR", help="folder with evaluation.json")
    parser.add_argument("--equal-error", metavar="PICTURE.png",
                        help="only cells at equal error, of all folders on one page; else all figures, into each folder")
    parser.add_argument("-f", "--force", action="store_true", help="overwrite existing pictures")
    parser.add_argument("-q", "--quiet", action="store_true", help="do not name the pictures on stdout")
    options = parser.parse_args()
    tables = [rows_of(folder) for folder in options.folders]
    try:
        import matplotlib  # noqa: F401
    except ImportError:
        fail(NO_RENDERER, "tables without pictures: matplotlib is missing; install python3-matplotlib")
    pages = [(rows, FIGURES[name], os.path.join(folder, name)) for rows, folder in zip(tables, options.folders) for name in FIGURES]
    if options.equal_error:
        pages = [(sum(tables, []), FIGURES["cells_at_equal_error.png"], options.equal_error)]
    for page in pages:
        if draw(*page, options.force) and not options.quiet:
            print(page[2])


if __name__ == "__main__":
    main()
