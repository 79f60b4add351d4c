#!/usr/bin/env python3
"""Holds the sources to the house rules: which folder may include which, and a few habits a compiler does not check.

    architecture_test.py [ROOT]

First every rule is shown to catch a source that breaks it, in a tree made up for that; then ROOT (this checkout) must keep them all.
"""
import pathlib
import re
import sys
import tempfile

# The arrows: what each folder may include beside itself. A new folder gets a line here.
ARROWS = {
    "base": "",
    "numerics": "base",
    "alglib": "base numerics",
    "gltf": "base",
    "motion": "base gltf",
    "storage": "base",
    "kernels": "base",
    "entropy": "base",
    "fpca": "base numerics motion storage footskate kernels",
    "library": "base motion storage footskate kernels fpca",
    "footskate": "base motion storage",
    "synthesis": "base numerics motion storage footskate kernels fpca library",
    "repeats": "base motion",
    "mesh": "base gltf motion storage",
    "codecs": "base motion storage kernels fpca library repeats entropy",
    "mesh_codecs": "base motion storage mesh entropy",
    "include": "base motion storage kernels fpca library footskate synthesis repeats mesh codecs mesh_codecs",
    "examples": "base motion storage kernels fpca library footskate synthesis mesh codecs",
    "bench": "base numerics alglib motion storage kernels fpca library footskate synthesis repeats mesh entropy codecs mesh_codecs examples",
    "cli": "base motion storage kernels fpca library footskate synthesis repeats mesh codecs mesh_codecs bench",
    "python": "base motion kernels fpca library synthesis codecs",
    "tests": "base numerics alglib gltf motion storage kernels fpca library footskate synthesis repeats mesh entropy codecs mesh_codecs examples bench cli",
}
# Folders whose headers are included as kinespace/FOLDER/..., as those who install the library include them.
LIBRARIES = set(ARROWS) - {"include", "examples", "bench", "cli", "python", "tests"}
ARROWS = {folder: set(others.split()) | {folder} for folder, others in ARROWS.items()}

LONGEST_FILE = 900
# What reads numbers by the locale of the process, which is the user's business and not a file's, or answers what is no number with an exception of its own, with 0 or with undefined behaviour.
NUMBER_READERS = re.compile(r"\b(?:std::)?(?:sto(?:i|l|ll|ul|ull|f|d|ld)|ato(?:i|l|ll|f)|strto(?:l|ll|ul|ull|f|d|ld|imax|umax)|v?[fs]?w?scanf)\s*\(")
SETS_LOCALE = re.compile(r"\bsetlocale\s*\(")
# Streams, by the name they are declared with: what is read from them with >> obeys the locale and fails without a word.
STREAMS = re.compile(r"\bstd::w?(?:istream|iostream|i?fstream|i?stringstream)\s*&?\s*(\w+)")
# What tells a test how late it is. A test that looks at it passes or fails with the machine and its load.
CLOCK = re.compile(
    r"\b\w+_clock\b|\b[cC]lock::now\b|\btick_count\b|\belapsed_time\b|\b_*rdtscp?\b"
    r"|\b(?:clock_gettime|timespec_get|gettimeofday|getrusage|omp_get_wtime)\b|\b(?:std::)?(?:clock|times)\s*\(\s*[)&]"
    r"|(?<![\w.>:])(?:std::|::)?time\s*\(\s*(?:nullptr|NULL|0|&)"
)
# Tests whose subject is time itself, and that assert nothing about it: file -> reason.
CLOCKS_ALLOWED = {}
INCLUDE = re.compile(r'^\s*#\s*include\s+"([^"]+)"', re.MULTILINE)
CATCH_ALL = re.compile(r"catch\s*\(\s*\.\.\.\s*\)\s*\{")
LEFT_OPEN = re.compile(r"\b(?:TODO|FIXME|XXX|HACK)\b")
# A loop of oneTBB inside of another that has failed returns with steps left out: kinespace/base/parallel.h throws there.
RAW_LOOP = re.compile(r"\btbb::(?:parallel_\w+|task_group)\b")
# An object of a thread's own with a destructor is made known to glibc at its first use, and glibc ends the process where it finds no
# memory for that: no Error, no exit code. Plain numbers and pointers need none.
THREAD_LOCAL = re.compile(r"\bthread_local\s+(?:(?:static|const|constinit|inline|volatile)\s+)*([^;={(]*)")
PLAIN = re.compile(r"^(?:(?:unsigned|signed|std::u?int\d+_t|std::size_t|bool|char|short|int|long|float|double)\s+)+(?:\*+\s*)?\w+(?:\[\w*\])*\s*$|^[\w:]+\s*\*+\s*\w+\s*$")
REPORTS = re.compile(r"\bthrow\b|\bstd::current_exception\b|\bstd::rethrow_exception\b|\breport\w*\s*\(")


def without_comments(text):
    return re.sub(r"//[^\n]*|/\*.*?\*/", "", text, flags=re.DOTALL)


def block(text, open_brace):
    """The text from `open_brace` to the brace that closes it."""
    depth = 0
    for at in range(open_brace, len(text)):
        depth += {"{": 1, "}": -1}.get(text[at], 0)
        if depth == 0:
            return text[open_brace : at + 1]
    return text[open_brace:]


def arrows(root, file, text):
    folder = file.parts[0]
    if file.parts[:2] == ("tests", "install"):
        return  # a user's program, which has headers of its own
    if folder not in ARROWS:
        yield f"the folder {folder}/ has no arrows in tests/architecture_test.py"
        return
    for included in INCLUDE.findall(text):
        path = included.removeprefix("kinespace/")
        target = path.split("/")[0]
        if included.endswith((".inc", "kinespace/version.h", "kinespace/licence.h")):
            continue  # written by the build
        if file.suffix == ".cl" and (root / file.parent / included).is_file():
            continue  # kernels are put together from their own folder
        if "/" not in included or not (root / path).is_file() or (target in LIBRARIES) != (path != included):
            yield f'"{included}" is not the path of a file from the root of the checkout, with kinespace/ before those of a library'
        elif target not in ARROWS[folder]:
            yield f"{folder}/ must not include {target}/ ({included})"
        elif "/detail/" in path and folder not in (target, "tests"):
            yield f"{included} is private to {target}/"


def length(root, file, text):
    lines = text.count("\n")
    if lines > LONGEST_FILE:
        yield f"{lines} lines, more than {LONGEST_FILE}: there is more than one idea in it"


def catch_all(root, file, text):
    code = without_comments(text)
    for found in CATCH_ALL.finditer(code):
        if not REPORTS.search(block(code, found.end() - 1)):
            yield "a catch (...) that neither rethrows nor reports"


def locale(root, file, text):
    code = without_comments(text)
    if found := NUMBER_READERS.search(code):
        yield f"{found.group(0)}...) obeys the locale or throws what is no Error; parse with from_chars"
    for stream in sorted({"std::cin", *STREAMS.findall(code)}):
        if re.search(rf"\b{stream}\s*>>", code):
            yield f"{stream} >> ... reads numbers by the locale; take lines and parse with from_chars"
    # Tests set a comma locale on purpose.
    if file.parts[0] != "tests" and (found := SETS_LOCALE.search(code)):
        yield f"{found.group(0)}...) changes how numbers look; no code of ours depends on the locale"


def clocks(root, file, text):
    if file.parts[0] != "tests" or str(file) in CLOCKS_ALLOWED:
        return
    found = CLOCK.search(without_comments(text))
    if found:
        yield f"{found.group(0)} in a test: count bytes, allocations, steps or calls, which no machine changes"


def loops(root, file, text):
    if str(file) == "base/parallel.cpp":
        return
    code = without_comments(text)
    if found := RAW_LOOP.search(code):
        yield f"{found.group(0)}: call parallel_for of kinespace/base/parallel.h, which throws where steps were left out"


def thread_objects(root, file, text):
    for found in THREAD_LOCAL.finditer(without_comments(text)):
        if not PLAIN.match(found.group(1) or ""):
            yield f"{' '.join(found.group(0).split())}: what has a destructor ends the process when memory is short at its first use; let the caller hand the scratch down"


def left_open(root, file, text):
    found = LEFT_OPEN.search(text)
    if found:
        yield f"{found.group(0)} left in"


def guarded(root, file, text):
    if file.suffix == ".h" and "#pragma once" not in text:
        yield "a header without #pragma once"


RULES = [arrows, length, catch_all, locale, clocks, loops, thread_objects, left_open, guarded]


def findings(root, rules=RULES):
    """["file: what is wrong"] over all sources under the root's folders; without any source, that is what is wrong."""
    out, looked_at = [], 0
    for path in sorted(root.glob("*/**/*")):
        file = path.relative_to(root)
        if path.suffix not in (".h", ".cpp", ".cl") or file.parts[0] in ("build", "out"):
            continue
        looked_at += 1
        text = path.read_text(encoding="utf-8")
        out += [f"{file}: {finding}" for rule in rules for finding in rule(root, file, text)]
    return out if looked_at else [f"{root}: no sources here"]


GOOD = {
    "base/error.h": "#pragma once\n",
    "motion/clip.h": '#pragma once\n#include "kinespace/base/error.h"\n',
    "motion/detail/frame.h": "#pragma once\n",
    "motion/clip.cpp": '#include "kinespace/motion/clip.h"\n#include "kinespace/motion/detail/frame.h"\nvoid f() try { g(); } catch (...) { undo(); throw; }\n',
    "motion/depth.cpp": "thread_local int depth = 0;\nstatic thread_local const Clip* current = nullptr;\nthread_local std::uint64_t state[4];\n",
    "kernels/tile.cl": "\n",
    "kernels/product.cl": '#include "tile.cl"\n',
    "tests/motion/clip_test.cpp": '#include "kinespace/motion/detail/frame.h"\n#include "tests/support/data.h"\n',
    "tests/support/data.h": "#pragma once\n",
    "tests/motion/wait_test.cpp": "std::this_thread::sleep_for(std::chrono::seconds(1)); double time(int at); clip.time(0);\n",
}
# One breach a rule, and what its finding must say.
BREACHES = [
    (arrows, "base/clock.cpp", '#include "kinespace/motion/clip.h"\n', "base/ must not include motion/"),
    (arrows, "motion/bad.cpp", '#include "clip.h"\n', "is not the path of a file"),
    (arrows, "motion/gone.cpp", '#include "kinespace/motion/gone.h"\n', "is not the path of a file"),
    (arrows, "motion/bare.cpp", '#include "base/error.h"\n', "is not the path of a file"),
    (arrows, "fpca/inside.cpp", '#include "kinespace/motion/detail/frame.h"\n', "is private to motion/"),
    (arrows, "codex/new.cpp", "\n", "has no arrows"),
    (length, "base/long.cpp", "\n" * (LONGEST_FILE + 1), "more than one idea"),
    (catch_all, "base/mute.cpp", "void f() { try { g(); } catch (...) { /* throw; */ } }\n", "neither rethrows nor reports"),
    (locale, "motion/parse.cpp", "double x = std::stod(word);\n", "obeys the locale"),
    (locale, "fpca/rows.cpp", "sequences += std::stoll(*before);\n", "obeys the locale"),
    (locale, "cli/count.cpp", "int n = atoi(word);\n", "obeys the locale"),
    (locale, "mesh/count.cpp", "long n = strtol(word, nullptr, 10);\n", "obeys the locale"),
    (locale, "tests/base/scan_test.cpp", 'std::sscanf(line, "%d", &n);\n', "obeys the locale"),
    (locale, "bench/words.cpp", "std::istringstream words(line); words >> number;\n", "by the locale"),
    (locale, "codecs/read.h", "#pragma once\nvoid read(std::istream& in, int& n) { in >> n; }\n", "by the locale"),
    (locale, "motion/comma.cpp", 'setlocale(LC_ALL, "");\n', "changes how numbers look"),
    (clocks, "tests/motion/soon_test.cpp", "const auto start = std::chrono::steady_clock::now();\n", "in a test: count"),
    (clocks, "tests/motion/cpu_test.cpp", "clock_gettime(CLOCK_THREAD_CPUTIME_ID, &now);\n", "in a test: count"),
    (clocks, "tests/motion/ticks_test.cpp", "const std::clock_t start = std::clock();\n", "in a test: count"),
    (clocks, "tests/motion/now_test.cpp", "using Clock = A;\nauto start = Clock::now();\n", "in a test: count"),
    (clocks, "tests/motion/used_test.cpp", "getrusage(RUSAGE_SELF, &used);\n", "in a test: count"),
    (clocks, "tests/motion/seed_test.cpp", "EXPECT_LT(std::time(nullptr) - start, 5);\n", "in a test: count"),
    (loops, "fpca/rows.cpp", "void f() { tbb::parallel_for(0, n, body); }\n", "throws where steps were left out"),
    (loops, "bench/each.cpp", "void f() { oneapi::tbb::parallel_for_each(list, body); }\n", "throws where steps were left out"),
    (thread_objects, "codecs/window.cpp", "void f() { thread_local std::vector<double> values; }\n", "let the caller hand"),
    (thread_objects, "synthesis/fill.cpp", "static thread_local std::vector<Eigen::Quaterniond> world;\n", "let the caller hand"),
    (thread_objects, "base/words.h", "#pragma once\nthread_local static Scratch scratch{};\n", "let the caller hand"),
    (thread_objects, "fpca/turn.cpp", "thread_local Eigen::MatrixXd turn(3, 3);\n", "let the caller hand"),
    (left_open, "base/later.cpp", "// TO" + "DO: finish\n", "left in"),
    (guarded, "base/twice.h", "int x();\n", "without #pragma once"),
]


def write(root, files):
    for name, text in files.items():
        path = root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")


def self_test():
    """[rule that does not work]"""
    broken = []
    with tempfile.TemporaryDirectory() as folder:
        root = pathlib.Path(folder)
        write(root, GOOD)
        broken += [f"a good tree is blamed: {finding}" for finding in findings(root)]
    for rule, name, text, expected in BREACHES:
        with tempfile.TemporaryDirectory() as folder:
            root = pathlib.Path(folder)
            write(root, GOOD | {name: text})
            found = findings(root, [rule])
            if len(found) != 1 or expected not in found[0] or not found[0].startswith(name):
                broken.append(f"{rule.__name__} on {name}: found {found}, expected '{expected}'")
    return broken


def main():
    root = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else pathlib.Path(__file__).parent.parent).resolve()
    wrong = [f"the rule itself is broken: {b}" for b in self_test()] or findings(root)
    print("\n".join(wrong) or f"{len(RULES)} rules, each shown to fail on {len(BREACHES)} breaches; the sources keep them all")
    return 1 if wrong else 0


if __name__ == "__main__":
    sys.exit(main())
