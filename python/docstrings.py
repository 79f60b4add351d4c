#!/usr/bin/env python3
"""docstrings.py STUB OUT: the docstrings of a .pyi as a list of {"Clip.positions", "..."} for C++, so that help() says what the stub says."""
import ast
import json
import pathlib
import sys


def docstrings(node, prefix=""):
    for child in node.body:
        if isinstance(child, (ast.ClassDef, ast.FunctionDef)):
            if text := ast.get_docstring(child):
                yield prefix + child.name, text
            if isinstance(child, ast.ClassDef):
                yield from docstrings(child, child.name + ".")


if __name__ == "__main__":
    found = docstrings(ast.parse(pathlib.Path(sys.argv[1]).read_text(encoding="utf-8")))
    # JSON's strings are C++'s, of characters below 128 and line breaks.
    pathlib.Path(sys.argv[2]).write_text("".join(f"{{{json.dumps(name)}, {json.dumps(text)}}},\n" for name, text in found), encoding="utf-8")
