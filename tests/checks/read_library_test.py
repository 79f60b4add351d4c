#!/usr/bin/env python3
"""Holds examples/read_library.py, and with it docs/files.md, to what libraries are.

    read_library_test.py BUILD_FOLDER

Builds small libraries of sample motions and compares what the script prints with `kinespace info --json`; then holds the numbers that it reads to what
defines them: eigenfunctions are orthonormal, and the mean square of all scores in a function is its eigenvalue. First the comparison is shown to
fail on what differs.
"""
import copy
import json
import os
import pathlib
import re
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
SCRIPT = ROOT / "examples" / "read_library.py"
sys.dont_write_bytecode = True
sys.path.insert(0, str(SCRIPT.parent))
import read_library  # noqa: E402


def printed(text):
    """What the script printed, under the keys of `kinespace info --json`."""
    clips = [{"name": name, "frames": int(frames)} for name, frames in re.findall(r"^  (\S+) (\d+) frames ", text, re.MULTILINE)]
    number = lambda key: float(re.search(rf"^ *{key} (\S+)$", text, re.MULTILINE)[1])
    return {"clips": number("clips"), "functions": number("functions"), "variance": number("variance"), "clip_list": clips}


def differences(shown, info):
    out = [f"{key}: printed {shown[key]}, it is {info[key]}" for key in ("clips", "functions") if shown[key] != info[key]]
    if abs(shown["variance"] - info["variance"]) > 1.1e-9:
        out.append(f"variance: printed {shown['variance']}, it is {info['variance']}")
    if shown["clip_list"] != [{"name": c["name"], "frames": c["frames"]} for c in info["clip_list"]]:
        out.append("the list of clips differs")
    return out


def self_test(shown, info):
    """[a change that the comparison does not see]"""
    unseen = []
    for key, value in (("clips", 1), ("functions", 1), ("variance", 1e-8)):
        wrong = copy.deepcopy(info)
        wrong[key] += value
        unseen += [] if differences(shown, wrong) else [key]
    wrong = copy.deepcopy(info)
    wrong["clip_list"][0]["frames"] += 1
    return unseen + ([] if differences(shown, wrong) else ["clip_list"])


def group_of(curve, groups):
    component = curve if curve < 3 else 3 + (curve - 3) % 4
    return 0 if groups == 1 else component if groups == 7 else curve


def numbers(path):
    """What is wrong with the eigenfunctions and the motion vectors as the script reads them."""
    library = read_library.sqlite3.connect(path)
    curves, groups = read_library.space(library.execute("SELECT blob FROM spaces WHERE name LIKE 'sequences %'").fetchone()[0])
    points = len(groups[0][1])
    weights = [(0.5 if i in (0, points - 1) else 1) / (points - 1) for i in range(points)]
    for _, _, _, functions in groups:
        for i, a in enumerate(functions):
            for j, b in enumerate(functions):
                product = sum(x * y * w for x, y, w in zip(a, b, weights))
                if abs(product - (i == j)) > 1e-10:
                    yield f"functions {i} and {j} are not orthonormal: {product}"
    squares = [[0.0] * len(group[2]) for group in groups]
    counts = [0] * len(groups)
    rows = "SELECT frames, w.blob, v.blob FROM clips c JOIN clip_warps w ON w.clip_id = c.id JOIN clip_vectors v ON v.clip_id = c.id"
    for frames, warps, vectors in library.execute(rows):
        parts = read_library.sequences(warps)
        if parts[0][0] != 0 or parts[-1][1] != frames - 1:
            yield f"sequences from {parts[0][0]} to {parts[-1][1]} in {frames} frames"
        for k, function in enumerate(read_library.scores(vectors, len(parts), curves)):
            for c in range(curves):
                g = group_of(c, len(groups))
                if k < len(squares[g]):
                    squares[g][k] += sum(vector[c] ** 2 for vector in function)
        for c in range(curves):
            counts[group_of(c, len(groups))] += len(parts)
    for (_, _, eigenvalues, _), sums, count in zip(groups, squares, counts):
        for k, (value, total) in enumerate(zip(eigenvalues, sums)):
            if abs(total / (count - 1) - value) > 0.03 * value + 1e-8:  # scores are kept in steps of 1e-4
                yield f"function {k}: eigenvalue {value}, mean square of the scores {total / (count - 1)}"


def findings(folder, environment):
    run = lambda line: subprocess.run(line, shell=True, cwd=folder, env=environment, check=True, capture_output=True, text=True).stdout
    run("kinespace-samples clips --takes 1")
    for options in ("", "--grouping component"):
        run(f"kinespace build clips -o sample.kspace --quiet {options}")
        info = json.loads(run("kinespace info sample.kspace --json"))
        shown = printed(run(f"{sys.executable} '{SCRIPT}' sample.kspace {info['clip_list'][-1]['name']}"))
        yield from differences(shown, info)
        yield from (f"the comparison itself does not see {key}" for key in self_test(shown, info))
        yield from numbers(folder / "sample.kspace")


def main():
    build = pathlib.Path(sys.argv[1]).resolve()
    environment = {**os.environ, "PATH": f"{build}:{os.environ['PATH']}"}
    with tempfile.TemporaryDirectory() as name:
        wrong = list(findings(pathlib.Path(name), environment))
    print("\n".join(wrong) or "examples/read_library.py reads what is there")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
