#!/usr/bin/env python3
"""Reads a motion-space library without kinespace, as docs/files.md says: Python's standard library, and the zstd command for the scores.

    read_library.py LIB.kspace [CLIP]

prints the clips, the functions of each motion space with their shares of the variance, and of CLIP (the first when none is named) each sequence:
its frames, its time warp and the length of its motion vector in each function. Checksums are not checked: Python has no XXH3.
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


def space(blob):
    """The number of curves, and of each group of them: variance, mean, eigenvalues, eigenfunctions."""
    options, sections = stream(blob)
    points, groups = int(options["points"]), []
    while section := sections.get(f"group {len(groups)}"):
        group = Bytes(section)
        count, _ = group.varint(), group.varint()
        (variance,), mean, eigenvalues = group.numbers("d", 1), group.numbers("d", points), group.numbers("d", count)
        groups.append((variance, mean, eigenvalues, [group.numbers("d", points) for _ in range(count)]))
    return 3 + 4 * (len(sections["references"]) // 32), groups


def sequences(blob):
    """First frame, last frame and the five coefficients of the warp of each sequence of a clip."""
    part, out = Bytes(stream(blob)[1]["sequences"]), []
    for _ in range(part.varint()):  # runs
        count, first = part.varint(), part.varint()
        for _ in range(count):
            last = first + part.varint()
            out.append((first, last, [a / 64 for a in part.numbers("b", 5)]))
            first = last
    return out


def unpacked(block, count):
    """Floats: as they are, or in runs of 16384 with their lowest bytes first, then the next, under zstd."""
    raw = block[1:]
    if block[0] == 1:
        raw = subprocess.run(["zstd", "-dc"], input=raw, capture_output=True).stdout
        runs = [raw[at : at + 65536] for at in range(0, len(raw), 65536)]
        raw = b"".join(bytes(run[lane * (len(run) // 4) + i] for i in range(len(run) // 4) for lane in range(4)) for run in runs)
    assert len(raw) == 4 * count, "damaged scores"
    return struct.unpack(f"<{count}f", raw)


def scores(blob, count, curves):
    """[function][sequence][curve]: the motion vectors of a clip of so many sequences."""
    part, out = Bytes(stream(blob)[1]["scores"]), []
    while part.at < len(part.data):
        size, _ = part.varint(), part.take(4)  # checksum
        steps = unpacked(part.take(size), count * curves)
        out.append([[1e-4 * step for step in steps[i * curves : (i + 1) * curves]] for i in range(count)])
    return out


def main(path, wanted=None):
    library = sqlite3.connect(f"file:{path}?mode=ro", uri=True)
    clips = library.execute("SELECT name, id, frames, rate_hz, space_id FROM clips ORDER BY id").fetchall()
    print("clips", len(clips))
    for name, _, frames, rate, _ in clips:
        print(f"  {name} {frames} frames {rate:g} Hz")
    spaces = {}
    for number, name, blob in library.execute("SELECT id, name, blob FROM spaces WHERE name LIKE 'sequences %' ORDER BY id"):
        _, groups = spaces[number] = space(blob)
        print("space", name.removeprefix("sequences "))
        print("  functions", max(len(group[2]) for group in groups))
        print(f"  variance {sum(sum(group[2]) for group in groups) / sum(group[0] for group in groups):.9f}")
        for group in groups:
            print("  shares", *[f"{value / group[0]:.6f}" for value in group[2]])

    name, number, _, _, home = next((clip for clip in clips if wanted in (None, clip[0])), None) or sys.exit(f"no clip {wanted}")
    blob = lambda table: library.execute(f"SELECT blob FROM {table} WHERE clip_id = ?", (number,)).fetchone()[0]
    parts, curves = sequences(blob("clip_warps")), spaces[home][0]
    vectors = scores(blob("clip_vectors"), len(parts), curves) if shutil.which("zstd") else []
    print("clip", name, "curves", curves)
    for i, (first, last, warp) in enumerate(parts):
        print("  frames", first, "to", last, "warp", *warp)
        print("    lengths", *[f"{math.hypot(*function[i]):.4f}" for function in vectors])
    if not vectors:
        print("  no motion vectors: they are packed with zstd, and there is no zstd command here")


if __name__ == "__main__":
    main(*sys.argv[1:])
