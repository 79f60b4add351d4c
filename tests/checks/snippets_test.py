#!/usr/bin/env python3
"""Compiles the C++ that the README, docs/ and headers show, so that what is shown can be typed off.

    snippets_test.py COMPILER INCLUDE_FOLDER...

Of a document the ```cpp blocks, in order, as one function (their #include lines before it; a block with a main of its own by itself); of a header
the example in its first comment: the lines that begin with "//   ". Only the syntax and the types are checked. First a wrong example is shown to fail.
"""
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DOCUMENTS = ["README.md", "examples/README.md", "docs/synthesis.md", "docs/compression.md", "docs/command.md"]
# Headers that begin with an example, and what it takes for given.
HEADERS = {
    "synthesis/motion_engine.h": '#include "kinespace/motion/read.h"\n',
    "codecs/stream/codec.h": '#include "kinespace/codecs/registry.h"\nusing namespace kinespace;\nextern const std::vector<Clip> clips;\n',
}
UNUSED = "#pragma GCC diagnostic ignored \"-Wunused\"\n"


def as_program(blocks):
    lines = [line for block in blocks for line in block.split("\n")]
    includes = [line for line in lines if line.startswith("#include")]
    body = [line for line in lines if not line.startswith("#include")]
    return "\n".join(["#include <cstdio>", *includes, "void example();", "void example() {", *body, "}", ""])


def programs_of_document(text):
    """[source]"""
    blocks = re.findall(r"^```cpp\n(.*?)^```", text, re.DOTALL | re.MULTILINE)
    own = [block for block in blocks if "int main(" in block]
    parts = [block for block in blocks if "int main(" not in block]
    return own + ([as_program(parts)] if parts else [])


def program_of_header(header, given):
    head = (ROOT / header).read_text(encoding="utf-8").partition("#pragma once")[0]
    lines = [line[5:] for line in head.split("\n") if line.startswith("//   ")]
    return f'#include "kinespace/{header}"\n{given}' + as_program(["\n".join(lines)]) if lines else None


def errors(source, compiler, includes):
    flags = ["-std=c++20", "-fsyntax-only", f"-I{ROOT}", *[f"-isystem{folder}" for folder in includes], "-x", "c++", "-"]
    done = subprocess.run([compiler, *flags], input=UNUSED + source, capture_output=True, text=True)
    return "" if done.returncode == 0 else "\n".join(l for l in done.stderr.split("\n") if "error" in l) or done.stderr


def main():
    compiler, includes = sys.argv[1], sys.argv[2:]
    wrong = []
    if errors(as_program(["int x = 1;"]), compiler, includes) or not errors(as_program(["int x = y;"]), compiler, includes):
        wrong.append("the check itself is broken")
    programs = {document: programs_of_document((ROOT / document).read_text(encoding="utf-8")) for document in DOCUMENTS}
    wrong += [] if programs["README.md"] else ["README.md: no C++"]
    for header, given in HEADERS.items():
        program = program_of_header(header, given)
        programs[header] = [program] if program else []
        wrong += [] if program else [f"{header}: no example"]
    for name, sources in programs.items():
        wrong += [f"{name}: {found}" for source in sources if (found := errors(source, compiler, includes))]
    print("\n".join(wrong) or "every example compiles")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
