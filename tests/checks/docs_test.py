#!/usr/bin/env python3
"""Runs the examples of the README and of docs/ as they are printed, and holds what is printed below them to what comes out.

    docs_test.py BUILD_FOLDER [DOCUMENT...]

An example is an indented block with lines "$ kinespace ..."; the lines below one are its output. "..." stands for any lines. Words must be equal,
numbers to the digits that are shown (one unit of the last digit may differ: another processor rounds otherwise). Every command must end with 0,
unless what is shown is an error. A comment behind a command may tell a file's size ("# 1238 bytes"). First the comparison is shown to fail on what
differs; then the documents are run, each in an empty folder of its own with the sample clips.

Of all documents, run or not, the files that they link to and the sources that they name (`fpca/warp.h`) must be there.
"""
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
DOCUMENTS = ["README.md", "docs/synthesis.md", "docs/compression.md", "docs/architecture.md", "docs/files.md", "SECURITY.md"]
# What a reader brings, and the bench of it, which takes minutes: its options are looked at all the same, by tests/cli.
NOT_RUN = re.compile(r"kinespace bench ")
# What depends on the machine and the moment.
UNEQUAL = re.compile(r"^(?:seconds|.*frames per s|encode s|open s)\b")
NUMBER = re.compile(r"[-+]?\d+(?:\.\d+)?(?:e[-+]?\d+)?$")


def blocks(text):
    """The indented blocks of a document that have commands: lists of lines without the indent."""
    lines, out = [], []
    for line in text.split("\n") + [""]:
        if line.startswith("    "):
            lines.append(line[4:])
            continue
        if any(l.startswith("$ ") for l in lines):
            out.append(lines)
        lines = []
    return out


def examples(text):
    """[(command, [lines shown below it])]"""
    out = []
    for block in blocks(text):
        for line in block:
            if line.startswith("$ "):
                out.append((line[2:], []))
            elif out:
                out[-1][1].append(line)
    return out


def same_word(shown, printed):
    if shown == printed:
        return True
    if not (NUMBER.match(shown) and NUMBER.match(printed)) or "." not in shown:
        return False
    unit = 10.0 ** -len(shown.partition(".")[2].partition("e")[0])
    return "e" not in shown and abs(float(shown) - float(printed)) <= 1.0001 * unit


def same_line(shown, printed):
    if UNEQUAL.match(shown) and UNEQUAL.match(printed):
        return True
    a, b = shown.split(), printed.split()
    return len(a) == len(b) and all(same_word(x, y) for x, y in zip(a, b))


def difference(shown, printed):
    """None when the lines shown are those printed, else what is wrong."""
    at, anywhere = 0, False
    for line in shown:
        if line.strip() == "...":
            anywhere = True
            continue
        found = next((i for i in range(at, len(printed)) if same_line(line, printed[i])), None)
        if found is None or (found != at and not anywhere):
            return f"shown: {line!r}\n  printed: {printed[at] if at < len(printed) else 'nothing more'!r}"
        at, anywhere = found + 1, False
    if shown and not anywhere and at < len(printed):
        return f"printed and not shown: {printed[at]!r}"
    return None


def self_test():
    printed = ["clips  72", "error  0.017325", "seconds  3.2"]
    good = [[], ["..."], ["clips 72", "..."], ["clips 72", "error 0.01732", "..."], printed, ["...", "seconds 9.9"]]
    bad = [["clips 73", "..."], ["error 0.017325", "..."], ["clips 72"], ["clips 72", "mistake 0.017325", "..."],
           ["clips 72", "error 0.01729", "..."], ["clips 72 x", "..."], ["...", "clips 72", "gone 1"]]
    return [f"{x} passes" for x in bad if difference(x, printed) is None] + [f"{x} fails" for x in good if difference(x, printed)]


def dead_names(text, folder, root=ROOT):
    """The files that a document in `folder` links to or names, and that are not there."""
    links = re.findall(r"\]\((?!https?:|#)([^)#\s]+)", text)
    names = re.findall(r"`((?:[a-z_]+/)+[a-z0-9_]+\.(?:h|cpp|cl|py))`", text)
    places = {link: [folder / link] for link in links}
    for name in names:  # as from the root of the checkout, or as headers are included
        included = name.removeprefix("kinespace/")
        places[name] = [root / name, root / included, root / "include" / included, root / "include" / (included + ".in")]
    return [name for name, found in places.items() if not any(place.exists() for place in found)]


def all_dead_names():
    good = "[a](README.md#why) [b](https://x.y/z.h) `fpca/warp.h` `kinespace/fpca/warp.h` `kinespace/version.h` `a.h`"
    wrong = [f"the check of names is broken: {name}" for name in dead_names(good, ROOT)]
    wrong += [] if len(dead_names("[a](GONE.md) `fpca/gone.h`", ROOT)) == 2 else ["the check of names sees nothing"]
    for document in [*ROOT.glob("*.md"), *ROOT.glob("docs/*.md"), *ROOT.glob("examples/*.md"), *ROOT.glob("tests/**/*.md")]:
        dead = dead_names(document.read_text(encoding="utf-8"), document.parent)
        wrong += [f"{document.relative_to(ROOT)}: no such file: {name}" for name in dead]
    return wrong


def prepare(folder, environment):
    """The sample clips, a library of them, the files that the documents take for a reader's own, and the folders of the checkout that they name."""
    for name in ("examples", "tests"):
        (folder / name).symlink_to(ROOT / name)
    run = lambda line: subprocess.run(line, shell=True, cwd=folder, env=environment, check=True, capture_output=True)
    run("kinespace-samples clips")
    run("kinespace build clips -o sample.kspace --quiet")
    (folder / "take.bvh").write_bytes((folder / "clips/walk_normal_001.bvh").read_bytes())
    lines = (folder / "clips/walk_normal_001.bvh").read_text().split("\n")
    at = 143
    lines[at] = "1,5 " + lines[at].partition(" ")[2]
    (folder / "broken.bvh").write_text("\n".join(lines))


def wrong_size(command, folder):
    told = re.search(r"-o (\S+) .*#\s*(\d+) bytes", command)
    if told is None:
        return None
    size = (folder / told[1]).stat().st_size
    # A target is met by search: other last bits may end it a step away.
    return None if abs(size - int(told[2])) <= 0.02 * size else f"shown: {told[2]} bytes\n  written: {size}"


def findings(document, build):
    environment = {**os.environ, "PATH": f"{build}:{os.environ['PATH']}"}
    found = []
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        prepare(folder, environment)
        for command, shown in examples((ROOT / document).read_text(encoding="utf-8")):
            if NOT_RUN.search(command):
                continue
            done = subprocess.run(command, shell=True, cwd=folder, env=environment, capture_output=True, text=True)
            fails = any(line.startswith("kinespace: ") for line in shown)
            output = done.stderr if fails else done.stdout
            wrong = difference(shown, output.rstrip("\n").split("\n")) or wrong_size(command, folder)
            if (done.returncode != 0) != fails:
                wrong = f"exit code {done.returncode}: {done.stderr.strip()}"
            if wrong:
                found.append(f"{document}: $ {command}\n  {wrong}")
    return found


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    wrong = [f"the comparison itself is broken: {b}" for b in self_test()] + all_dead_names()
    for document in sys.argv[2:] or DOCUMENTS:
        wrong += [] if examples((ROOT / document).read_text(encoding="utf-8")) else [f"{document}: no examples"]
        wrong += findings(document, build)
    print("\n".join(wrong) or "every example prints what is shown below it")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
