# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""What editors are told is what there is."""
import ast
import inspect
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
    """From the signature that pybind11 writes: name(self: X, a: int, *, b: float = 1.0) -> ..., or of Python."""
    if inspect.isfunction(function):
        function = getattr(function, "__wrapped__", function)
    if inspect.isfunction(function):
        parameters = [p for p in inspect.signature(function).parameters.values() if p.name != "self"]
        names = [p.name + ("" if p.default is p.empty else "=") for p in parameters]
        keyword_only = [p.kind is p.KEYWORD_ONLY for p in parameters]
        if True in keyword_only:
            names.insert(keyword_only.index(True), "*")
        return names
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
            declared = arguments_of(item)
            if item.name == "run":  # the first argument may be left out, and is then the inputs
                declared[declared.index("out=")] = "out"
            assert declared == arguments_of_compiled(getattr(owner, item.name)), item.name
            checked += 1
    assert checked > 20


def test_help_says_what_stubs_say():
    for function, words in [
        (pm.PlanarMap.insert_depth, ["depth_scale=None", "floats are metres"]),
        (pm.PlanarMap.__init__, ["resolution=None", "side of the smallest cell"]),
        (pm.PlanarMap.load, ["path", "Reads a .pmap file"]),
        (pm.segment, ["distance_threshold=None", "Finds the planes"]),
        (pm.run, ["progress=None", "Returns the content of metrics.json"]),
    ]:
        shown = f"{inspect.signature(function)} {inspect.getdoc(function)}"
        assert all(word in shown for word in words), shown
    assert "what is occupied, free and unknown" in pm.PlanarMap.__doc__
    assert "lower left corner" in pm.Plan.origin.__doc__
