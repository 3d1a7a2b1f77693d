#!/usr/bin/env python3
"""Runs the ```sh and ```python blocks of a page of the docs from top to bottom, as they stand, in a new folder.

    run_tutorial.py PAGE BIN_DIR    programs of BIN_DIR are found first; python3 and PYTHONPATH are those of this script

The files beside a page of examples/ are copied into the folder.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile

ROOT = os.path.normpath(os.path.join(os.path.dirname(os.path.abspath(__file__)), ".."))


def main():
    page, programs = sys.argv[1], os.path.abspath(sys.argv[2])
    with open(os.path.join(ROOT, page), encoding="utf-8") as file:
        blocks = re.findall(r"^```(sh|python)\n(.*?)^```", file.read(), flags=re.MULTILINE | re.DOTALL)
    if not blocks:
        sys.exit(f"{page} has nothing to run")
    os.environ["PATH"] = os.pathsep.join([programs, os.path.dirname(sys.executable), os.environ["PATH"]])
    names = {}
    with tempfile.TemporaryDirectory() as folder:
        if page.startswith("examples/"):
            shutil.copytree(os.path.join(ROOT, os.path.dirname(page)), folder, dirs_exist_ok=True)
        os.chdir(folder)
        for language, code in blocks:
            if language == "sh":
                subprocess.run(["bash", "-euxo", "pipefail", "-c", code], check=True)
            else:
                print(code, flush=True)
                exec(compile(code, page, "exec"), names)
        os.chdir(ROOT)


main()
