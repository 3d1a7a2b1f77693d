# SPDX-FileCopyrightText: planar_mapping contributors
# SPDX-License-Identifier: BSD-3-Clause
"""Gives compiled classes and functions what __init__.pyi says of them: docstrings and signatures for help(), editors and
Jupyter, and an error that names the nearest keyword where one is misspelled."""
import ast
import difflib
import functools
import inspect
import pathlib


class _Default:
    """A default of the stubs that is no literal."""

    def __repr__(self):
        return "..."


def _value(node):
    try:
        return ast.literal_eval(node)
    except ValueError:
        return _Default()


def _signature(node):
    arguments, kinds = node.args, inspect.Parameter
    required = len(arguments.args) - len(arguments.defaults)
    parameters = []
    for i, argument in enumerate(arguments.args):
        default = kinds.empty if i < required else _value(arguments.defaults[i - required])
        parameters.append(kinds(argument.arg, kinds.POSITIONAL_OR_KEYWORD, default=default))
    for argument, default in zip(arguments.kwonlyargs, arguments.kw_defaults):
        parameters.append(kinds(argument.arg, kinds.KEYWORD_ONLY, default=kinds.empty if default is None else _value(default)))
    return inspect.Signature(parameters)


def checked(function, node, owner=""):
    """The function with docstring and signature of its stub; keywords that it has not raise TypeError."""
    keywords = [a.arg for a in node.args.args + node.args.kwonlyargs if a.arg != "self"]
    known = frozenset(keywords)
    name = owner if node.name == "__init__" else node.name

    @functools.wraps(function)
    def call(*args, **kwargs):
        if not known.issuperset(kwargs):
            word = next(k for k in kwargs if k not in known)
            # A keyword that was cut short or made longer counts as near.
            near = difflib.get_close_matches(word, keywords, 1) or [k for k in keywords if word in k or k in word]
            hint = f"did you mean '{near[0]}'?" if near else "it has " + (", ".join(keywords) or "none")
            raise TypeError(f"{name}() has no argument '{word}'; {hint}")
        return function(*args, **kwargs)

    call.__doc__ = ast.get_docstring(node)
    call.__signature__ = _signature(node)
    call.__module__ = "planar_mapping"
    call.__qualname__ = f"{owner}.{node.name}" if owner else node.name
    return call


def _document_class(owner, stub):
    owner.__doc__ = ast.get_docstring(stub)
    owner.__module__ = "planar_mapping"
    for node in stub.body:
        if not isinstance(node, ast.FunctionDef):
            continue
        member = inspect.getattr_static(owner, node.name)
        if isinstance(member, property):
            member.__doc__ = ast.get_docstring(node)
        elif node.name == "__init__" or not node.name.startswith("__"):
            is_static = any(getattr(d, "id", "") == "staticmethod" for d in node.decorator_list)
            call = checked(getattr(owner, node.name), node, owner.__name__)
            setattr(owner, node.name, staticmethod(call) if is_static else call)


def document(names):
    """Replaces what stands in the dictionary of a module by what is documented."""
    stubs = ast.parse((pathlib.Path(__file__).parent / "__init__.pyi").read_text(encoding="utf-8"))
    for node in stubs.body:
        if isinstance(node, ast.ClassDef) and not issubclass(names[node.name], Exception):
            _document_class(names[node.name], node)
        elif isinstance(node, ast.FunctionDef):
            names[node.name] = checked(names[node.name], node)
