#!/usr/bin/env python3
"""Reads a motion-space library without kinespace, as docs/files.md says: Python's standard library, and the zstd command for the scores.

    read_library.py LIB.kspace [CLIP]

prints the clips, the functions of each motion space, for each kind of sequence, with their shares of the variance, and of CLIP (the first when none is named) each sequence:
its frames, its whole cycles, its time warp and the length of its motion vector in each row (ends first, then functions). Checksums are not checked: Python has no XXH3.
"""
import itertools
import math
import shutil
import sqlite3
import struct
import subprocess
import sys


class Bytes:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        self.at += count
        return self.data[self.at - count : self.at]

    def numbers(self, code, count):
        return struct.unpack(f"<{count}{code}", self.take(count * struct.calcsize("<" + code)))

    def varint(self):
        value = 0
        for shift in itertools.count(0, 7):
            byte = self.take(1)[0]
            value |= (byte & 127) << shift
            if byte < 128:
                return value

    def text(self):
        return self.take(self.varint()).decode()


def stream(blob):
    """The options and the sections of a bitstream."""
    file = Bytes(blob)
    assert file.take(4) == b"\x8bKSB" and file.varint() == 1, "no kinespace stream of version 1"
    header = Bytes(file.take(file.varint()))
    file.take(8)  # checksum
    header.text()  # kind
    header.take(4 * header.take(1)[0].bit_count())  # measured errors
    options = {header.text(): header.text() for _ in range(header.varint())}
    table = [(header.text(), header.take(1), header.varint(), header.take(8)) for _ in range(header.varint())]
    return options, {name: file.take(size) for name, _, size, _ in table}


class FunctionSet:
    """Functions for sequences of one kind: cut at rests, or of so many whole cycles."""

    def __init__(self, blob):
        options, sections = stream(blob)
        points, self.pinned = int(options["points"]), int(options.get("pinned", 0))
        self.pace, self.groups = float(options.get("pace", 1)), []
        while section := sections.get(f"group {len(self.groups)}"):
            group = Bytes(section)
            count, _ = group.varint(), group.varint()
            variance, *left = group.numbers("d", 1 + self.pinned)
            mean, eigenvalues = group.numbers("d", points), group.numbers("d", count)
            functions = [group.numbers("d", points) for _ in range(count)]
            self.groups.append((variance, left[0] if left else variance - sum(eigenvalues), mean, eigenvalues, functions))
        self.curves = 3 + 4 * (len(sections["references"]) // 32)
        self.rows = 2 * self.pinned + max(len(group[3]) for group in self.groups)

    def rows_at(self, level):
        """How many rows of scores a level of detail has; in a pinned space the first two are the ends of the sequence."""
        numbers = math.ceil(level * self.pace - 1e-9)
        return min(self.rows, max(2, numbers + 1) if self.pinned else numbers)


def space(blob):
    """The function sets of a motion space, by the cycles that a sequence holds; 0: it was cut at rests."""
    sections = stream(blob)[1]
    if "references" in sections:  # libraries of before sequences had kinds
        return {0: FunctionSet(blob)}
    return {int(name.removeprefix("cycles ")): FunctionSet(section) for name, section in sections.items()}


def sequences(blob):
    """Of each run of a clip the sequences: first and last frame, whole cycles, extra detail, the warp's five coefficients."""
    options, sections = stream(blob)
    part, runs = Bytes(sections["sequences"]), []
    for _ in range(part.varint()):
        count, first, run = part.varint(), part.varint(), []
        for _ in range(count):
            last = first + part.varint()
            cycles = part.take(1)[0] if "kinds" in options else 0
            extra = part.take(1)[0] if "extra_detail" in options else 0
            run.append((first, last, cycles, extra, [a / 64 for a in part.numbers("b", 5)]))
            first = last
        runs.append(run)
    return runs


def own_level(level, extra):
    """The level of detail that a sequence has at one of the clip."""
    return level + math.ceil(level * extra / 16)


def unpacked(block, count):
    """Floats: as they are, or in runs of 16384 with their lowest bytes first, then the next, under zstd."""
    raw = block[1:]
    if block[0] == 1:
        raw = subprocess.run(["zstd", "-dc"], input=raw, capture_output=True).stdout
        runs = [raw[at : at + 65536] for at in range(0, len(raw), 65536)]
        raw = b"".join(bytes(run[lane * (len(run) // 4) + i] for i in range(len(run) // 4) for lane in range(4)) for run in runs)
    assert len(raw) == 4 * count, "damaged scores"
    return struct.unpack(f"<{count}f", raw)


def scores(blob, runs, sets):
    """[sequence][row][curve]: the motion vectors of a clip, run after run."""
    part, level = Bytes(stream(blob)[1]["scores"]), 0
    out = [[[None] * sets[cycles].rows for _, _, cycles, _, _ in run] for run in runs]
    curves = sets[0].curves
    while part.at < len(part.data):
        size, _ = part.varint(), part.take(4)  # checksum
        block, level = part.take(size), level + 1
        places = []  # run, sequence and row of each row of the block
        for r, run in enumerate(runs):
            for i, (_, _, cycles, extra, _) in enumerate(run):
                of = sets[cycles]
                kept = of.rows_at(own_level(level - 1, extra)) if level > 1 else 0
                shared = 1 if i > 0 and kept == 0 and of.pinned else 0  # the end of the sequence before
                places += [(row - kept - shared, r, i, row) for row in range(kept + shared, of.rows_at(own_level(level, extra)))]
        steps = unpacked(block, len(places) * curves)
        for at, (_, r, i, row) in enumerate(sorted(places)):
            step = 1e-4 / math.sqrt(sets[runs[r][i][2]].pace)
            out[r][i][row] = [step * value for value in steps[at * curves : (at + 1) * curves]]
    for run, vectors in zip(runs, out):
        for before, vector in zip(vectors, vectors[1:]):
            if vector[0] is None:
                vector[0] = before[1]
    return [vector for run in out for vector in run]


def main(path, wanted=None):
    library = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    clips = library.execute("SELECT name, id, frames, rate_hz, space_id FROM clips ORDER BY id").fetchall()
    print("clips", len(clips))
    for name, _, frames, rate, _ in clips:
        print(f"  {name} {frames} frames {rate:g} Hz")
    spaces = {}
    for number, name, blob in library.execute("SELECT id, name, blob FROM spaces WHERE name LIKE 'sequences %' ORDER BY id"):
        spaces[number] = space(blob)
        print("space", name.removeprefix("sequences "))
        for cycles, of in spaces[number].items():
            print("  cycles", cycles)
            print("    functions", max(len(group[3]) for group in of.groups))
            print(f"    variance {1 - sum(group[1] for group in of.groups) / (sum(group[0] for group in of.groups) or 1):.9f}")
            for group in of.groups:
                print("    shares", *[f"{value / group[0]:.6f}" for value in group[3]])

    name, number, _, _, home = next((clip for clip in clips if wanted in (None, clip[0])), None) or sys.exit(f"no clip {wanted}")
    blob = lambda table: library.execute(f"SELECT blob FROM {table} WHERE clip_id = ?", (number,)).fetchone()[0]
    runs = sequences(blob("clip_warps"))
    vectors = scores(blob("clip_vectors"), runs, spaces[home]) if shutil.which("zstd") else []
    print("clip", name, "curves", spaces[home][0].curves)
    for i, (first, last, cycles, _, warp) in enumerate(itertools.chain(*runs)):
        print("  frames", first, "to", last, "cycles", cycles, "warp", *warp)
        if vectors:
            print("    lengths", *[f"{math.hypot(*row):.4f}" for row in vectors[i] if row])
    if not vectors:
        print("  no motion vectors: they are packed with zstd, and there is no zstd command here")


if __name__ == "__main__":
    main(*sys.argv[1:])
