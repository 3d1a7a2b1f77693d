# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What editors are told is what there is."""
import ast
import pathlib
import re

import planar_mapping as pm
from planar_mapping import _run

STUBS = ast.parse((pathlib.Path(pm.__file__).parent / "__init__.pyi").read_text())


def arguments_of(function):
    arguments = function.args
    positional = [a.arg for a in arguments.args if a.arg != "self"]
    required = len(positional) - len(arguments.defaults)
    names = [name + ("" if i < required else "=") for i, name in enumerate(positional)]
    if arguments.kwonlyargs:
        names += ["*"] + [a.arg + ("" if d is None else "=") for a, d in zip(arguments.kwonlyargs, arguments.kw_defaults)]
    return names


def arguments_of_compiled(function):
    """From the signature that pybind11 writes: name(self: X, a: int, *, b: float = 1.0) -> ..."""
    text = re.match(r"\w+\((.*)\) -> ", function.__doc__).group(1)
    while re.search(r"[\[({][^\[\](){}]*[\])}]", text):  # types and defaults with commas of their own
        text = re.sub(r"[\[({][^\[\](){}]*[\])}]", "", text)
    parts = [part.strip() for part in text.split(",") if part.strip()]
    return [part if part == "*" else part.split(":")[0] + ("=" if "=" in part else "") for part in parts if not part.startswith("self")]


def public(names):
    return {name for name in names if not name.startswith("_")}


def test_stubs_name_all_there_is():
    declared = {node.name for node in STUBS.body if isinstance(node, (ast.ClassDef, ast.FunctionDef))}
    declared |= {node.target.id for node in STUBS.body if isinstance(node, ast.AnnAssign)}
    assert public(declared) == set(pm.__all__)
    for node in STUBS.body:
        if isinstance(node, ast.ClassDef) and not issubclass(getattr(pm, node.name), Exception):
            members = public(item.name for item in node.body if isinstance(item, ast.FunctionDef))
            members |= public(item.target.id for item in node.body if isinstance(item, ast.AnnAssign))
            assert members == public(dir(getattr(pm, node.name))), node.name


def test_stubs_have_the_arguments_of_functions():
    checked = 0
    for node in STUBS.body:
        owner = getattr(pm, node.name) if isinstance(node, ast.ClassDef) else _run if getattr(node, "name", "") == "run" else pm
        for item in node.body if isinstance(node, ast.ClassDef) else [node]:
            if not isinstance(item, ast.FunctionDef) or isinstance(getattr(owner, item.name), property):
                continue
            if item.name.startswith("__") and item.name != "__init__":
                continue
            assert arguments_of(item) == arguments_of_compiled(getattr(owner, item.name)), item.name
            checked += 1
    assert checked > 20
