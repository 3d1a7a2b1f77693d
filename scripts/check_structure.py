#!/usr/bin/env python3
"""Checks the structure of the sources; exit 1 with a line per problem.

- No folder under src/*/src, src/*/include, tests or tools holds more than 25 files.
- Folders of one module do not include each other in a circle (docs/architecture.md, "Rooms").
- Modules include only modules that they link, and the diagram of docs/architecture.md shows these links.
- The sources hold what scripts/sensitivity.py switches off.
"""
import collections
import os
import re
import subprocess
import sys

import sensitivity

MAX_FILES = 25
ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..")
SOURCES = (".h", ".hpp", ".cpp")
INCLUDE = re.compile(r'^\s*#include\s+["<]([^">]+)[">]', re.MULTILINE)
PCL_MODULES = {"filters", "segmentation", "surface", "pcl_adapter"}


def tracked_files():
    git = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                         capture_output=True, text=True, check=False)
    if git.returncode == 0:
        names = git.stdout.split("\n")
    else:  # no repository, for example an unpacked archive
        names = [os.path.relpath(os.path.join(folder, name), ROOT)
                 for folder, _, inner in os.walk(ROOT) for name in inner]
    return [name for name in names if name and os.path.exists(os.path.join(ROOT, name))]


def module_of(path):
    parts = path.split("/")
    if parts[0] == "src" and len(parts) > 2:
        return parts[1]
    return parts[0] if parts[0] in PCL_MODULES else None


def room_of(path):
    """Folder below src/ or include/planar_mapping/MODULE/; detail/ and impl/ are left out."""
    match = re.match(r"(?:src/)?\w+/(?:src|include/planar_mapping/\w+)/(.*)", path)
    parts = match.group(1).split("/")[:-1] if match else []
    return "/".join(part for part in parts if part not in ("detail", "impl"))


def find_circle(graph):
    done, path = set(), []

    def visit(node):
        if node in path:
            return path[path.index(node):] + [node]
        if node in done:
            return None
        path.append(node)
        for target in sorted(graph[node]):
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


def linked_modules(files):
    """Module -> modules that its CMakeLists.txt links, public and private."""
    links = {}
    for path in files:
        module = module_of(path)
        if module and os.path.basename(path) == "CMakeLists.txt":
            text = open(os.path.join(ROOT, path)).read()
            links.setdefault(module, set()).update(re.findall(r"planar_mapping::(\w+)", text))
    return {module: targets - {module} for module, targets in links.items()}


def drawn_arrows():
    """Module -> modules with an arrow to it in the diagram."""
    text = open(os.path.join(ROOT, "docs/architecture.md")).read()
    arrows = collections.defaultdict(set)
    for line in re.search(r"```mermaid\n(.*?)```", text, re.DOTALL).group(1).split("\n"):
        groups = [[name.strip() for name in group.split("&")] for group in line.split("-->")]
        for sources, targets in zip(groups, groups[1:]):
            for source in sources:
                for target in targets:
                    arrows[target].add(source)
    return arrows


def main():
    files = tracked_files()
    problems = []

    folders = collections.Counter(os.path.dirname(path) for path in files
                                  if path.startswith(("src/", "tests/", "tools/", "benchmarks/"))
                                  and not path.startswith("tests/fuzz/corpus/"))  # one file an input
    problems += [f"{folder} holds {count} files, at most {MAX_FILES} are wanted"
                 for folder, count in sorted(folders.items()) if count > MAX_FILES]

    links = linked_modules(files)
    rooms = collections.defaultdict(lambda: collections.defaultdict(set))
    public = {}
    for path in files:
        match = re.match(r"(?:.*/)?include/(planar_mapping/.*)", path)
        if match and module_of(path):
            public[match.group(1)] = path
    for path in files:
        module = module_of(path)
        if not module or not path.endswith(SOURCES):
            continue
        for name in INCLUDE.findall(open(os.path.join(ROOT, path)).read()):
            target = public.get(name)
            if target is None:
                base = f"src/{module}/src/" if path.startswith("src/") else f"{module}/src/"
                here = os.path.normpath(os.path.join(os.path.dirname(path), name))
                target = next((p for p in (base + name, here) if os.path.exists(os.path.join(ROOT, p))), None)
            if target is None:
                continue
            other = module_of(target)
            if other == module:
                if room_of(target) != room_of(path):
                    rooms[module][room_of(path)].add(room_of(target))
            else:
                reached, open_ends = set(), [module]
                while open_ends:
                    for link in links.get(open_ends.pop(), ()):
                        if link not in reached:
                            reached.add(link)
                            open_ends.append(link)
                if other not in reached:
                    problems.append(f"{path} includes {name}, but {module} does not link {other}")
    for module, graph in sorted(rooms.items()):
        circle = find_circle(collections.defaultdict(set, graph))
        if circle:
            problems.append(f"{module}: folders include each other: {' -> '.join(room or '.' for room in circle)}")

    arrows = drawn_arrows()
    for module, targets in sorted(links.items()):
        for target in sorted(targets - arrows[module]):
            problems.append(f"docs/architecture.md: no arrow {target} --> {module}, which is linked")
        for target in sorted(arrows[module] - targets):
            problems.append(f"docs/architecture.md: an arrow {target} --> {module}, which is not linked")

    for mechanism, end, text, _ in sensitivity.MECHANISMS:
        path = os.path.join(ROOT, "src/core/src", end)
        if not os.path.exists(path) or text not in sensitivity.read(path):
            problems.append(f"scripts/sensitivity.py, {mechanism}: not in {end}")

    print("\n".join(problems) if problems else "structure: no problem found")
    return 1 if problems else 0


if __name__ == "__main__":
    sys.exit(main())
