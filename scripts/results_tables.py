#!/usr/bin/env python3
"""The tables of docs/results.md from the output of scripts/reproduce.sh:

    scripts/results_tables.py OUT                            prints them
    scripts/results_tables.py OUT --write docs/results.md    replaces them there
"""
import json
import os
import re
import sys

INPUTS = [("simulated", "corridor", "corridor"), ("simulated", "outdoor", "outdoor"),
          ("simulated_turned", "corridor", "corridor, turned 30°"), ("rgbd_tum_cabinet", "", "TUM cabinet"),
          ("rgbd_tartanair_corridor", "", "TartanAir corridor"), ("rgbd_icl_livingroom", "", "ICL living room"),
          ("rgbd_icl_five", "", "ICL, five views"), ("stereo_euroc_room", "", "EuRoC room"),
          ("stereo_kitti_street", "", "KITTI street")]


def short(value):
    """Three significant digits, of large numbers all before the point."""
    return f"{value:.{max(0, 3 - len(str(int(value))))}f}" if value >= 1 else f"{value:.2f}"


def percent(values):
    return "" if None in values else " / ".join(f"{value:.1f}".replace("100.0", "100") for value in values)


def rows_of(out, folder, scene):
    results = []
    for name in ("ablation.json", "evaluation.json"):  # what is in both is compared with SG, OG and RA in the last
        path = os.path.join(out, folder, name)
        if os.path.exists(path):
            with open(path, encoding="utf-8") as file:
                results += [r for r in json.load(file)["results"] if r["scene"].startswith(scene)]
    sizes = sorted({r["cell_m"] for r in results})
    return [(s, {r["method"]: r for r in results if r["cell_m"] == s}) for s in sizes]


def tables(out):
    cells = ["| input | s m | SG | OG | RA | paper | no planes | **PG** | PG/RA | eta |", "|---" * 10 + "|"]
    quality = ["| input | s m | error % SG / OG / RA / no planes / PG | complete % OG / RA / PG | covered % OG / RA / PG "
               "| free marked % SG / OG / RA / no planes / PG |", "|---" * 6 + "|"]
    sizes = ["| input | s m | memory kB OG / PG | PG/OG | kB `.bt` / `.ot` / full / finished | full/`.ot` | finished/`.bt` "
             "| PG is behind in |", "|---" * 8 + "|"]
    for folder, scene, name in INPUTS:
        for s, of in rows_of(out, folder, scene):
            sg, og, ra, paper, boxes, pg = (of[m] for m in ("SG", "OG", "RA", "PG_paper", "no_planes", "PG"))
            count = " | ".join(f"{r['cells']:.0f}" for r in (sg, og, ra, paper, boxes))
            cells.append(f"| {name} | {s} | {count} | **{pg['cells']:.0f}** | {pg['cells'] / ra['cells']:.2f} "
                         f"| {pg['combination_efficiency']:.3f} |")
            quality.append(f"| {name} | {s} | {percent([r['error_percent'] for r in (sg, og, ra, boxes, pg)])} "
                           f"| {percent([r['completeness'] and 100 * r['completeness'] for r in (og, ra, pg)])} "
                           f"| {percent([100 * r['coverage'] for r in (og, ra, pg)])} "
                           f"| {percent([100 * r['free_space_violation'] for r in (sg, og, ra, boxes, pg)])} |")
            files = [og["file_bytes"], og["ot_bytes"], pg["file_bytes"], pg["finished_bytes"]]
            sizes.append(f"| {name} | {s} | {short(og['memory_bytes'] / 1e3)} / {short(pg['memory_bytes'] / 1e3)} "
                         f"| {pg['memory_bytes'] / og['memory_bytes']:.3f} "
                         f"| {' / '.join(short(size / 1e3) for size in files)} "
                         f"| {files[2] / files[1]:.2f} | {files[3] / files[0]:.2f} "
                         f"| {behind(pg['loses_to'])} |")
    return {"cells": cells, "quality": quality, "sizes": sizes}


def behind(loses_to):
    """"SG:time", "RA:time", "RA:file" -> "time: SG RA; file: RA"."""
    figures = {}
    for entry in loses_to:
        method, figure = entry.split(":")
        figures.setdefault(figure, []).append(method)
    return "; ".join(f"{figure}: {' '.join(methods)}" for figure, methods in figures.items())


def main():
    if len(sys.argv) not in (2, 4) or sys.argv[1].startswith("-"):
        sys.exit(__doc__.strip())
    made = tables(sys.argv[1])
    if len(sys.argv) == 2:
        print("\n\n".join("\n".join(table) for table in made.values()))
        return
    with open(sys.argv[3], encoding="utf-8") as file:
        page = file.read()
    for name, table in made.items():
        text = "\n".join([f"<!-- {name} -->", *table, f"<!-- end of {name} -->"])
        page = re.sub(f"<!-- {name} -->.*?<!-- end of {name} -->", lambda _: text, page, flags=re.DOTALL)
    with open(sys.argv[3], "w", encoding="utf-8") as file:
        file.write(page)


if __name__ == "__main__":
    main()
