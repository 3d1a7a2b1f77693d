#!/usr/bin/env python3
"""Checks README.md, CHANGELOG.md, CONTRIBUTING.md and docs/; exit 1 with a line per problem.

- Relative links and their anchors resolve.
- Lines have at most 160 columns, but for the generated docs/parameters.md.
- Rows of a table begin and end with |, one a line, each with as many cells as its heading.
- A block of code after `<!-- examples/FILE -->` stands in that file, but for indentation; `// ...` leaves lines out.
- `stage.key=value` names a key of docs/parameters.md, `test_name` a test, a path of the sources exists, and
  so do the classes and functions that docs/method.md and docs/architecture.md name.
"""
import os
import re
import subprocess
import sys

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))
MAX_COLUMNS = 160
GENERATED = ("docs/parameters.md",)
SNIPPET = re.compile(r"^<!-- (examples/\S+) -->\n+```\w*\n(.*?)^```", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"\[[^\]]*\]\(([^)\s]+)\)")
FOLDERS = "src|filters|segmentation|surface|pcl_adapter|tools|config|scripts|examples|tests|benchmarks|docs|cmake"


def read(path):
    with open(os.path.join(ROOT, path), encoding="utf-8") as file:
        return file.read()


def prose(text):
    return re.sub(r"^```.*?^```", "", text, flags=re.MULTILINE | re.DOTALL)


def anchors(text):
    """As GitHub makes them of headings."""
    titles = re.findall(r"^#+ (.*)$", prose(text), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", title.lower()).replace(" ", "-") for title in titles}


def link_problems(page, text):
    for target in LINK.findall(prose(text)):
        if re.match(r"\w+:", target):
            continue
        path, _, anchor = target.partition("#")
        file = os.path.normpath(os.path.join(os.path.dirname(page), path)) if path else page
        if not os.path.exists(os.path.join(ROOT, file)):
            yield f"link to {target}, which does not exist"
        elif anchor and anchor not in anchors(read(file)):
            yield f"link to {target}, which has no such heading"


def table_problems(text):
    columns = 0  # of the table in which the line is
    lines = prose(text).split("\n")
    for above, line in zip([""] + lines, lines):
        bars = len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", line)))
        if re.search(r"\|\s*:?---", line):
            columns = len(re.findall(r"(?<!\\)\|", re.sub(r"`[^`]*`", "", above)))
        elif not line.strip() or line.startswith("<!--"):
            columns = 0
        if columns and (bars != columns or not re.fullmatch(r"\|.*\|", line)):
            yield f"no row of the table: {line[:60]} ..."


def lines_of(code):
    return [line.strip() for line in code.splitlines() if line.strip()]


def snippet_problems(text):
    for path, block in SNIPPET.findall(text):
        if not os.path.exists(os.path.join(ROOT, path)):
            yield f"code of {path}, which does not exist"
            continue
        example = "\n".join(lines_of(read(path)))
        for part in re.split(r"^\s*// \.\.\.$", block, flags=re.MULTILINE):
            if "\n".join(lines_of(part)) not in example:
                yield f"code differs from {path}: {lines_of(part)[0]} ..."


def symbol_problems(text, symbols):
    for quoted in re.findall(r"`([A-Za-z:]+)(?:\(\))?`", prose(text)):
        for name in quoted.split("::"):
            if re.search(r"[a-z][A-Z]", name) and name not in symbols:
                yield f"the sources have no {name}"


def name_problems(text, keys, tests):
    for stage, key in re.findall(r"\b([a-z_]{3,})\.([a-z_]+)=", text):
        if stage in {entry[0] for entry in keys} and (stage, key) not in keys | {(stage, "enabled")}:
            yield f"no parameter {stage}.{key}"
    for name in re.findall(r"`(test_\w+)`", text):
        if name not in tests:
            yield f"no test {name}"
    for path in re.findall(rf"`((?:{FOLDERS})/[\w./-]+)`", text):
        if not os.path.exists(os.path.join(ROOT, path)):
            yield f"no file {path}"


def main():
    names = subprocess.run(["git", "ls-files", "--cached", "--others", "--exclude-standard"], cwd=ROOT,
                           capture_output=True, text=True, check=True).stdout.split("\n")
    names = [name for name in names if os.path.exists(os.path.join(ROOT, name))]
    tests = {os.path.basename(name)[:-4] for name in names if re.match(r"tests/.*/test_\w+\.cpp$", name)}
    sources = " ".join(read(name) for name in names if re.search(r"\.(h|hpp)$", name))
    symbols = set(re.findall(r"\w+", sources))
    keys = set()
    for line in read("docs/parameters.md").splitlines():
        if line.startswith("### "):
            stage = line[4:]
        elif line.startswith("| `") and "stage" in locals():
            keys.add((stage, line.split("`")[1]))
    problems = []
    for page in names:
        if not re.match(r"(README|CHANGELOG|CONTRIBUTING|docs/.*)\.md$", page):
            continue
        text = read(page)
        problems += [f"{page}:{i}: {len(line)} columns" for i, line in enumerate(text.split("\n"), 1)
                     if len(line) > MAX_COLUMNS and page not in GENERATED]
        for check in (link_problems(page, text), snippet_problems(text), table_problems(text), name_problems(text, keys, tests)):
            problems += [f"{page}: {problem}" for problem in check]
        if page in ("docs/method.md", "docs/architecture.md"):
            problems += [f"{page}: {problem}" for problem in symbol_problems(text, symbols)]
    print("\n".join(problems) or "docs: nothing to say")
    sys.exit(1 if problems else 0)


if __name__ == "__main__":
    main()
