#!/usr/bin/env python3
"""Holds examples/read_library.py, and with it docs/files.md, to what libraries are.

    read_library_test.py BUILD_FOLDER

Builds small libraries of sample motions and compares what the script prints with `kinespace info --json`; then holds the numbers that it reads to what
defines them: eigenfunctions are orthonormal, the mean square of all scores in a function is its eigenvalue, and neighbours share their ends. First the comparison is shown to
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
    numbers_of = lambda key: [float(value) for value in re.findall(rf"^ *{key} (\S+)$", text, re.MULTILINE)]
    sets = [{"cycles": c, "functions": f, "variance": v} for c, f, v in zip(*map(numbers_of, ("cycles", "functions", "variance")))]
    return {"clips": numbers_of("clips")[0], "sets": sets, "clip_list": clips}


def differences(shown, info):
    out = [f"clips: printed {shown['clips']}, it is {info['clips']}"] if shown["clips"] != info["clips"] else []
    # Of groups of curves the script prints the most functions; info counts them all.
    sets = [dict(s, functions=s["functions_of_a_curve"]) for s in info["spaces"][0]["sets"]]
    if len(shown["sets"]) != len(sets):
        out.append(f"{len(shown['sets'])} function sets printed, there are {len(sets)}")
    for a, b in zip(shown["sets"], sets):
        out += [f"{key}: printed {a[key]}, it is {b[key]}" for key in a if abs(a[key] - b[key]) > 1.1e-9]
    if shown["clip_list"] != [{"name": c["name"], "frames": c["frames"]} for c in info["clip_list"]]:
        out.append("the list of clips differs")
    return out


def self_test(shown, info):
    """[a change that the comparison does not see]"""
    unseen = []
    wrong = copy.deepcopy(info)
    wrong["clips"] += 1
    unseen += [] if differences(shown, wrong) else ["clips"]
    for key, value in (("cycles", 1), ("functions", 1), ("variance", 1e-8)):
        wrong = copy.deepcopy(info)
        wrong["spaces"][0]["sets"][-1]["functions_of_a_curve" if key == "functions" else key] += value
        unseen += [] if differences(shown, wrong) else [key]
    wrong = copy.deepcopy(info)
    wrong["clip_list"][0]["frames"] += 1
    return unseen + ([] if differences(shown, wrong) else ["clip_list"])


def group_of(curve, groups):
    component = curve if curve < 3 else 3 + (curve - 3) % 4
    return 0 if groups == 1 else component if groups == 7 else curve


def orthonormal(of):
    for _, _, mean, _, functions in of.groups:
        points = len(mean)
        weights = [(0.5 if i in (0, points - 1) else 1) / (points - 1) for i in range(points)]
        for i, a in enumerate(functions):
            for j, b in enumerate(functions[: i + 1]):
                product = sum(x * y * w for x, y, w in zip(a, b, weights))
                if abs(product - (i == j)) > 1e-10:
                    yield f"functions {i} and {j} are not orthonormal: {product}"


def numbers(path):
    """What is wrong with the eigenfunctions and the motion vectors as the script reads them."""
    library = read_library.sqlite3.connect(path)
    sets = read_library.space(library.execute("SELECT blob FROM spaces WHERE name LIKE 'sequences %'").fetchone()[0])
    for of in sets.values():
        yield from orthonormal(of)
    squares = {cycles: [[0.0] * len(group[3]) for group in of.groups] for cycles, of in sets.items()}
    counts = {cycles: [0] * len(of.groups) for cycles, of in sets.items()}
    rows = "SELECT frames, w.blob, v.blob FROM clips c JOIN clip_warps w ON w.clip_id = c.id JOIN clip_vectors v ON v.clip_id = c.id"
    for frames, warps, vectors in library.execute(rows):
        runs = read_library.sequences(warps)
        if runs[0][0][0] != 0 or runs[-1][-1][1] != frames - 1:
            yield f"sequences from {runs[0][0][0]} to {runs[-1][-1][1]} in {frames} frames"
        parts = [part for run in runs for part in run]
        for (_, _, cycles, _, _), vector in zip(parts, read_library.scores(vectors, runs, sets)):
            of = sets[cycles]
            for c in range(of.curves):
                g = group_of(c, len(of.groups))
                counts[cycles][g] += 1
                for k in range(len(squares[cycles][g])):
                    squares[cycles][g][k] += vector[2 * of.pinned + k][c] ** 2
        for run in runs:
            yield from (f"a sequence ends at {a[1]}, the next begins at {b[0]}" for a, b in zip(run, run[1:]) if a[1] != b[0])
    for cycles, of in sets.items():
        for (variance, _, _, eigenvalues, _), sums, count in zip(of.groups, squares[cycles], counts[cycles]):
            # Scores are kept in steps of 1e-4, and all functions together leave out half of a millionth of the variance.
            may_miss = 0.5e-6 * variance
            for k, (value, total) in enumerate(zip(eigenvalues, sums)):
                missing = value - total / max(1, count - 1)
                may_miss -= max(0, missing - 0.03 * value - 1e-7)
                if count and (-missing > 0.03 * value + 1e-7 or may_miss < 0):
                    yield f"{cycles} cycles, function {k}: eigenvalue {value}, mean square of the scores {total / (count - 1)}"


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
