#!/usr/bin/env python3
"""The tables of docs/results.md from the output of scripts/reproduce.sh:

    scripts/results_tables.py OUT                            prints them
    scripts/results_tables.py OUT --write docs/results.md    replaces them there; parts that were not run stay as they are
"""
import json
import os
import re
import statistics
import sys

INPUTS = [("simulated", "corridor", "corridor"), ("simulated", "outdoor", "outdoor"),
          ("simulated_turned", "corridor", "corridor, turned 30°"), ("rgbd_tum_cabinet", "", "TUM cabinet"),
          ("rgbd_tartanair_corridor", "", "TartanAir corridor"), ("rgbd_icl_livingroom", "", "ICL living room"),
          ("rgbd_icl_five", "", "ICL, five views"), ("stereo_euroc_room", "", "EuRoC room"),
          ("stereo_kitti_street", "", "KITTI street")]
SHORT = (0.05, 0.1, 0.3)  # cell sizes of the tables; the summary counts all
LESS_IS_BETTER = [("cells", "cells"), ("error", "error_percent"), ("wrong of what is marked", "wrong_fraction"),
                  ("surface distance, median", "surface_median_m"), ("surface distance, 95th", "surface_p95_m"),
                  ("free marked occupied", "free_space_violation"), ("free not known", "free_not_known"),
                  ("memory", "memory_bytes"), ("file", "file_bytes"), ("time", "time_ms_per_frame")]
MORE_IS_BETTER = [("complete within s / 4", "completeness_quarter"), ("covered within s / 2", "coverage"),
                  ("covered within s / 4", "coverage_quarter"), ("covered, inside", "coverage_inside")]
HALF_A_POINT = 0.005  # completeness and coverage this close are equal
INFINITE = ("surface_median_m", "surface_p95_m")  # where they are absent


def rows_of(out, folder, scene):
    """(s, {method: figures}) of each cell size."""
    results = []
    for name in ("ablation.json", "evaluation.json"):  # what is in both is compared with SG, OG and RA in the last
        path = os.path.join(out, folder, name)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                results += [r for r in json.load(file)["results"] if r["scene"].startswith(scene)]
    for r in results:
        for figure in INFINITE:
            r[figure] = float("inf") if r.get(figure) is None else r[figure]
    sizes = sorted({r["cell_m"] for r in results})
    return [(s, {r["method"]: r for r in results if r["cell_m"] == s}) for s in sizes]


def short(value):
    """Three significant digits, of large numbers all before the point."""
    return f"{value:.{max(0, 3 - len(str(int(value))))}f}" if value >= 1 else f"{value:.2f}"


def joined(of, methods, figure, factor=1.0, digits=1):
    """"a / b / c"; empty where there is no truth."""
    values = [of[m][figure] for m in methods]
    if None in values:
        return ""
    return " / ".join(re.sub(r"^100\.0+$", "100", f"{factor * v:.{digits}f}").replace("inf", "∞") for v in values)


def head(*columns):
    return ["| " + " | ".join(columns) + " |", "|---" * len(columns) + "|"]


def line(*cells):
    return "| " + " | ".join(str(cell) for cell in cells) + " |"


def method_tables(out):
    cells = head("input", "s m", "SG", "OG", "RA", "paper", "no planes", "**PG**", "PG/RA", "PG/no planes", "eta")
    error = head("input", "s m", "error % SG / OG / no planes / PG", "wrong of marked % SG / OG / no planes / PG",
                 "complete at s % OG / no planes / PG", "at s / 4")
    cover = head("input", "s m", "covered at s / 2 % SG / OG / no planes / PG", "at s / 4", "inside")
    space = head("input", "s m", "surface mm: median SG / OG / no planes / PG", "95th", "free marked % SG / OG / no planes / PG",
                 "free not known % OG / PG")
    sizes = head("input", "s m", "memory kB SG / OG / RA / PG", "file kB RA / `.bt` / `.bt` zstd / `.ot` / finished / full",
                 "ms a frame SG / OG / RA / no planes / PG")
    all_rows = []
    four = ("SG", "OG", "no_planes", "PG")
    for folder, scene, name in INPUTS:
        for s, of in rows_of(out, folder, scene):
            all_rows.append(of)
            if s not in SHORT:
                continue
            count = [f"{of[m]['cells']:.0f}" for m in ("SG", "OG", "RA", "PG_paper", "no_planes", "PG")]
            count[-1] = f"**{count[-1]}**"
            pg = of["PG"]["cells"]
            cells.append(line(name, s, *count, f"{pg / of['RA']['cells']:.2f}", f"{pg / of['no_planes']['cells']:.2f}",
                              f"{of['PG']['combination_efficiency']:.3f}"))
            files = [of["RA"]["file_bytes"], of["OG"]["file_bytes"], of["OG"]["compressed_bytes"], of["OG"]["ot_bytes"],
                     of["PG"]["finished_bytes"], of["PG"]["file_bytes"]]
            sizes.append(line(name, s, " / ".join(short(of[m]["memory_bytes"] / 1e3) for m in ("SG", "OG", "RA", "PG")),
                              " / ".join(short(size / 1e3) for size in files),
                              joined(of, ("SG", "OG", "RA", "no_planes", "PG"), "time_ms_per_frame")))
            if of["PG"]["error_percent"] is not None:
                error.append(line(name, s, joined(of, four, "error_percent"), joined(of, four, "wrong_fraction", 100),
                                  joined(of, four[1:], "completeness", 100), joined(of, four[1:], "completeness_quarter", 100)))
            cover.append(line(name, s, *(joined(of, four, figure, 100, 2)
                                         for figure in ("coverage", "coverage_quarter", "coverage_inside"))))
            space.append(line(name, s, joined(of, four, "surface_median_m", 1e3, 0), joined(of, four, "surface_p95_m", 1e3, 0),
                              joined(of, four, "free_space_violation", 100), joined(of, ("OG", "PG"), "free_not_known", 100)))
    if not all_rows:
        return {}
    against = ("SG", "OG", "RA", "no_planes")
    summary = head(f"PG in {len(all_rows)} rows: better, equal, worse than", "SG", "OG", "RA", "no planes")
    for sign, equal, figures in ((1, 0.0, LESS_IS_BETTER), (-1, HALF_A_POINT, MORE_IS_BETTER)):
        for name, figure in figures:
            counts = []
            for method in against:
                pairs = [(of["PG"][figure], of[method][figure]) for of in all_rows]
                signs = [(a > b + equal) - (a < b - equal) for a, b in pairs if a is not None and b is not None]
                counts.append(", ".join(str(signs.count(x * sign)) for x in (-1, 0, 1)) if signs else "")
            summary.append(line(name, *counts))
    return {"summary": summary, "cells": cells, "error": error, "cover": cover, "space": space, "sizes": sizes}


def regimes(out):
    """Exact and tolerant covers of all methods, with the filters of PG for all and for none."""
    table = head("input", "filters", "exact: SG", "OG", "RA", "boxes", "planes", "tolerant: RA", "boxes", "planes",
                 "free marked %: RA / boxes / planes; RA / boxes / planes")
    for folder, scene, name in INPUTS:
        for _, of in rows_of(out, "regimes_" + folder, scene):
            on = ("SG_filtered", "OG_filtered", "RA_filtered", "boxes_exact", "planes_exact", "RA_density_filtered", "boxes", "PG")
            off = ("SG", "OG", "RA", "boxes_exact_raw", "planes_exact_raw", "RA_density", "boxes_raw", "planes_raw")
            for label, methods in (("all", on), ("none", off)):
                table.append(line(name, label, *(f"{of[m]['cells']:.0f}" for m in methods),
                                  joined(of, methods[2:], "free_space_violation", 100)))
    return {"regimes": table} if len(table) > 2 else {}


def seeds(out):
    """Median and, in brackets, least and most of five seeds."""
    def spread(rows, method, figure, factor=1.0, digits=1):
        values = [factor * of[method][figure] for of in rows]
        low, mid, high = (f"{v:.{digits}f}" for v in (min(values), statistics.median(values), max(values)))
        return f"{mid} [{low}, {high}]"

    table = head("scene", "s m", "cells RA", "no planes", "PG", "error % no planes", "PG", "covered % PG", "free marked % no planes", "PG")
    for scene in ("corridor", "outdoor", "white"):
        runs = [rows_of(out, f"seed_{seed}", scene) for seed in range(1, 6)]
        for same in zip(*runs):
            rows = [of for _, of in same]
            table.append(line(scene, same[0][0], *(spread(rows, m, "cells", 1, 0) for m in ("RA", "no_planes", "PG")),
                              *(spread(rows, m, "error_percent") for m in ("no_planes", "PG")),
                              spread(rows, "PG", "coverage", 100, 2),
                              *(spread(rows, m, "free_space_violation", 100) for m in ("no_planes", "PG"))))
    return {"seeds": table} if len(table) > 2 else {}


def poses(out):
    """Whole sequences: poses as given, and found from the images but judged by the given ones."""
    table = head("input", "s m", "poses", "frames", "rms m", "cells OG / RA / boxes / PG", "covered % OG / boxes / PG",
                 "surface mm OG / boxes / PG", "free marked % OG / boxes / PG")
    names = [("simulated_images", "simulated corridor")] + [(folder, name) for folder, scene, name in INPUTS if not scene]
    for folder, name in names:
        for s in (0.1, 0.2):
            for kind, label in (("use", "given"), ("ignore", "found")):
                of = dict(rows_of(out, f"poses_{kind}_{folder}", "")).get(s)
                if of is None:
                    continue
                rms = of["PG"]["position_rms_m"]
                table.append(line(name, s, label, of["PG"]["frames"], "" if rms is None else f"{rms:.3f}",
                                  joined(of, ("OG", "RA", "no_planes", "PG"), "cells", 1, 0),
                                  joined(of, ("OG", "no_planes", "PG"), "coverage", 100),
                                  joined(of, ("OG", "no_planes", "PG"), "surface_median_m", 1e3, 0),
                                  joined(of, ("OG", "no_planes", "PG"), "free_space_violation", 100)))
    return {"poses": table} if len(table) > 2 else {}


def ablation(out):
    """The compact profile without one idea each."""
    table = head("the profile `compact` with", "corridor: cells", "error %", "covered %", "outdoor: cells", "error %", "covered %")
    scenes = [dict(rows_of(out, "ablation", scene)).get(0.1) for scene in ("corridor", "outdoor")]
    if None in scenes:
        return {}
    for method in (m for m in scenes[0] if m not in ("SG", "OG", "RA", "PG_paper")):
        figures = [f for of in scenes for f in (f"{of[method]['cells']:.0f}", joined(of, [method], "error_percent", 1, 2),
                                                joined(of, [method], "coverage", 100))]
        table.append(line("**all**" if method == "PG" else method, *figures))
    return {"ablation": table}


def main():
    if len(sys.argv) == 1 or sys.argv[2:3] not in ([], ["--write"]) or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    made = {}
    for make in (method_tables, regimes, seeds, poses, ablation):
        made.update(make(sys.argv[1]))
    if len(sys.argv) == 2:
        print("\n\n".join("\n".join(table) for table in made.values()))
        return
    for path in sys.argv[3:]:
        with open(path, encoding="utf-8") as file:
            page = file.read()
        for name, table in made.items():
            text = "\n".join([f"<!-- {name} -->", *table, f"<!-- end of {name} -->"])
            page = re.sub(f"<!-- {name} -->.*?<!-- end of {name} -->", lambda _: text, page, flags=re.DOTALL)
        with open(path, "w", encoding="utf-8") as file:
            file.write(page)


if __name__ == "__main__":
    main()
