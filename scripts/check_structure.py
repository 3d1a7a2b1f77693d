#!/usr/bin/env python3
"""Checks the structure of the sources; exit 1 with a line per problem. --table prints what each room weighs.

- No folder of sources or tests holds more than 25 files; a header and its source count once.
- Rooms and folders include only what docs/architecture.md draws, and no circle exists.
- Installed headers include installed headers only.
- Each room stays below its budget of lines and of named constants (scripts/budgets.csv).
- The sources hold what scripts/sensitivity.py switches off.
"""
import collections
import csv
import os
import re
import subprocess
import sys

import sensitivity

MAX_FILES = 25
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
ROOMS = "src/planar_mapping/"
SOURCES = (".h", ".hpp", ".cpp")
PCL_MODULES = ("filters", "segmentation", "surface")
PRODUCT = ("evaluation", "tools", "python") + PCL_MODULES
INCLUDE = re.compile(r'^\s*#\s*include\s+["<]([^">]+)[">]', re.MULTILINE)
CONSTANT = re.compile(r"^\s*(?:inline |static )*constexpr\s+[\w:<>, ]+?\s+k[A-Z]\w*(?:\[\w*\])?\s*(?:=|\{)", re.MULTILINE)


def tracked_files():
    git = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                         capture_output=True, text=True, check=False)
    if git.returncode == 0:
        names = git.stdout.split("\n")
    else:  # no repository, for example an unpacked archive
        names = [os.path.relpath(os.path.join(folder, name), ROOT)
                 for folder, _, inner in os.walk(ROOT) for name in inner]
    return [name for name in names if name and os.path.exists(os.path.join(ROOT, name))]


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def room_of(path):
    """First folder below src/planar_mapping, or the folder of the project."""
    if path.startswith(ROOMS):
        return path[len(ROOMS):].split("/")[0]
    first = path.split("/")[0]
    return first if first in PRODUCT or first in ("tests", "benchmarks") else None


def target_of(path, name, files):
    """The file of the project that an include names."""
    candidates = ["src/" + name, name, os.path.normpath(os.path.join(os.path.dirname(path), name)), "tools/" + name]
    candidates += [f"{module}/include/{name}" for module in PCL_MODULES]
    return next((c for c in candidates if c in files), None)


def find_circle(graph):
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return None
        path.append(node)
        for target in sorted(graph.get(node, ())):
            circle = visit(target)
            if circle:
                return circle
        path.pop()
        done.add(node)
        return None

    for start in sorted(graph):
        circle = visit(start)
        if circle:
            return circle
    return None


def drawn_arrows():
    """Room -> rooms with an arrow to it in the diagram."""
    arrows = collections.defaultdict(set)
    for line in re.search(r"```mermaid\n(.*?)```", read("docs/architecture.md"), re.DOTALL).group(1).split("\n"):
        groups = [[name.strip() for name in group.split("&")] for group in line.split("-->")]
        for sources, targets in zip(groups, groups[1:]):
            for source in sources:
                for target in targets:
                    arrows[target].add(source)
    return arrows


def reached(room, arrows):
    found, open_ends = set(), [room]
    while open_ends:
        for source in arrows.get(open_ends.pop(), ()):
            if source not in found:
                found.add(source)
                open_ends.append(source)
    return found


def installed_headers(files):
    found = set()
    for path in files:
        if path.startswith(ROOMS) and path.endswith("CMakeLists.txt"):
            for block in re.findall(r"HEADERS\s([^)A-Z]*)", read(path)):
                found.update(os.path.join(os.path.dirname(path), name) for name in block.split())
    return found


def weights(files):
    """Room -> [lines, named constants]."""
    weight = collections.defaultdict(lambda: [0, 0])
    for path in files:
        room = room_of(path)
        if room and (path.endswith(SOURCES) or (path.endswith(".py") and room in ("python", "evaluation"))):
            text = read(path)
            weight[room][0] += text.count("\n")
            weight[room][1] += len(CONSTANT.findall(text))
    return weight


def main():
    files = set(tracked_files())
    weight = weights(files)
    if "--table" in sys.argv:
        for room, (lines, constants) in sorted(weight.items()):
            print(f"{room},{lines},{constants}")
        return 0
    problems = []

    folders = collections.defaultdict(set)
    for path in files:
        if (room_of(path) or path.startswith("scripts/")) and not path.startswith("tests/fuzz/corpus/"):  # one file an input
            folders[os.path.dirname(path)].add(os.path.splitext(path)[0])
    problems += [f"{folder} holds {len(stems)} files, at most {MAX_FILES} are wanted"
                 for folder, stems in sorted(folders.items()) if len(stems) > MAX_FILES]

    arrows = drawn_arrows()
    circle = find_circle(arrows)
    if circle:
        problems.append(f"docs/architecture.md: arrows form a circle: {' <- '.join(circle)}")
    inner = collections.defaultdict(lambda: collections.defaultdict(set))
    installed = installed_headers(files)
    used = collections.defaultdict(set)
    for path in sorted(files):
        room = room_of(path)
        if not room or room in ("tests", "benchmarks") or not path.endswith(SOURCES):
            continue
        for name in INCLUDE.findall(read(path)):
            target = target_of(path, name, files)
            other = target and room_of(target)
            if not other:
                continue
            if other == room:
                folders_of = [re.sub(r"/(impl|detail)$", "", os.path.dirname(p)) for p in (path, target)]
                if folders_of[0] != folders_of[1]:
                    inner[room][folders_of[0]].add(folders_of[1])
            else:
                used[room].add(other)
                if other not in reached(room, arrows):
                    problems.append(f"{path} includes {name}, but no arrow leads from {other} to {room}")
            if (path in installed or "/include/" in path) and target.startswith(ROOMS) and target not in installed:
                problems.append(f"{path} is installed and includes {name}, which is not")
    for room, sources in sorted(arrows.items()):
        for source in sorted(sources - used[room]):
            problems.append(f"docs/architecture.md: an arrow {source} --> {room} that no include needs")
    for room, graph in sorted(inner.items()):
        circle = find_circle(graph)
        if circle:
            problems.append(f"{room}: folders include each other: {' -> '.join(circle)}")

    budgets = {row["room"]: row for row in csv.DictReader(read("scripts/budgets.csv").splitlines())}
    for room, (lines, constants) in sorted(weight.items()):
        if room not in budgets:
            problems.append(f"scripts/budgets.csv has no row '{room}'")
            continue
        for kind, value in (("lines", lines), ("constants", constants)):
            if value > int(budgets[room][kind]):
                problems.append(f"{room} has {value} {kind}, its budget is {budgets[room][kind]} (scripts/budgets.csv)")

    for mechanism, end, text, _ in sensitivity.MECHANISMS:
        if ROOMS + end not in files or text not in read(ROOMS + end):
            problems.append(f"scripts/sensitivity.py, {mechanism}: not in {end}")

    print("\n".join(problems) if problems else "structure: no problem found")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
