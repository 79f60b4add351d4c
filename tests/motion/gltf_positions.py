#!/usr/bin/env python3
"""Where joints of glTF files are, worked out here from the specification alone, against what `kinespace convert` makes of them.

    gltf_positions.py KINESPACE [FOLDER_OR_FILE...]      else foreign/gltf of $KINESPACE_DATA

Every .glb and .gltf file that moves a skeleton is converted to BVH, animation by animation; at every frame each joint must be within 0.01 cm of
its node's place in the scene. Files without a skin and an animation of nodes, and those whose buffer is not there, must be refused by a message that says so. Exit code 77: nothing there.
"""
import base64
import bisect
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import tempfile

ALLOWED_CM = 0.01
WIDTH = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
COMPONENT = {5120: ("b", 127), 5121: ("B", 255), 5122: ("h", 32767), 5123: ("H", 65535), 5125: ("I", 4294967295), 5126: ("f", None)}


def product(a, b):
    """Of matrices as lists of rows."""
    return [[sum(a[i][k] * b[k][j] for k in range(len(b))) for j in range(len(b[0]))] for i in range(len(a))]


def rotation(q):
    x, y, z, w = (c / math.sqrt(sum(v * v for v in q)) for c in q)
    return [
        [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
        [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
        [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
    ]


def placed(linear, translation):
    return [linear[i] + [translation[i]] for i in range(3)] + [[0, 0, 0, 1]]


class Gltf:
    def __init__(self, path):
        self.missing = False
        data = path.read_bytes()
        binary = None
        if data[:4] == b"glTF":
            length = struct.unpack_from("<I", data, 12)[0]
            self.json = json.loads(data[20 : 20 + length])
            binary = data[28 + length :]
        else:
            self.json = json.loads(data)
        self.buffers = []
        for buffer in self.json.get("buffers", []):
            uri = buffer.get("uri")
            if uri is None:
                self.buffers.append(binary)
            elif uri.startswith("data:"):
                self.buffers.append(base64.b64decode(uri.split(",", 1)[1]))
            elif (path.parent / uri).exists():
                self.buffers.append((path.parent / uri).read_bytes())
            else:
                self.missing = True
        self.nodes = self.json.get("nodes", [])
        self.parent = [-1] * len(self.nodes)
        for n, node in enumerate(self.nodes):
            for child in node.get("children", []):
                self.parent[child] = n

    def values(self, view, offset, component, count, width, normalized=False):
        view = self.json["bufferViews"][view]
        letter, most = COMPONENT[component]
        size = struct.calcsize("<" + letter) * width
        stride = view.get("byteStride", size)
        start = view.get("byteOffset", 0) + offset
        rows = [struct.unpack_from(f"<{width}{letter}", self.buffers[view["buffer"]], start + i * stride) for i in range(count)]
        return [[max(v / most, -1) if normalized and most else v for v in row] for row in rows]

    def accessor(self, index):
        a = self.json["accessors"][index]
        width, count = WIDTH[a["type"]], a["count"]
        rows = [[0] * width for _ in range(count)]
        if "bufferView" in a:
            rows = self.values(a["bufferView"], a.get("byteOffset", 0), a["componentType"], count, width, a.get("normalized", False))
        if "sparse" in a:
            at, new = a["sparse"]["indices"], a["sparse"]["values"]
            where = self.values(at["bufferView"], at.get("byteOffset", 0), at["componentType"], a["sparse"]["count"], 1)
            what = self.values(new["bufferView"], new.get("byteOffset", 0), a["componentType"], a["sparse"]["count"], width, a.get("normalized", False))
            for (i,), row in zip(where, what):
                rows[i] = row
        return rows

    def channels(self, animation):
        out = []
        for channel in animation["channels"]:
            target = channel["target"]
            if "node" not in target or target["path"] == "weights":
                continue
            sampler = animation["samplers"][channel["sampler"]]
            times = [t for (t,) in self.accessor(sampler["input"])]
            out.append((target["node"], target["path"], sampler.get("interpolation", "LINEAR"), times, self.accessor(sampler["output"])))
        return out

    def places(self, channels, time):
        """World matrices of all nodes, metres."""
        posed = [dict(node) for node in self.nodes]
        for node, path, kind, times, values in channels:
            posed[node].pop("matrix", None)
            posed[node][path] = sampled(path, kind, times, values, time)
        out = [None] * len(posed)

        def place(n):
            if out[n] is None:
                node = posed[n]
                if "matrix" in node:
                    m = node["matrix"]
                    local = [[m[4 * column + row] for column in range(4)] for row in range(4)]
                else:
                    turn, scale = rotation(node.get("rotation", [0, 0, 0, 1])), node.get("scale", [1, 1, 1])
                    local = placed([[turn[i][j] * scale[j] for j in range(3)] for i in range(3)], node.get("translation", [0, 0, 0]))
                out[n] = local if self.parent[n] < 0 else product(place(self.parent[n]), local)
            return out[n]

        for n in range(len(posed)):
            place(n)
        return out

    def name(self, n):
        return self.nodes[n].get("name") or f"node_{n}"


def sampled(path, kind, times, values, time):
    cubic = kind == "CUBICSPLINE"
    key = lambda i: values[3 * i + 1] if cubic else values[i]
    if time <= times[0]:
        return key(0)
    if time >= times[-1]:
        return key(len(times) - 1)
    i = bisect.bisect_right(times, time) - 1
    span = times[i + 1] - times[i]
    t = (time - times[i]) / span
    if kind == "STEP":
        return key(i)
    if cubic:
        a = (2 * t**3 - 3 * t**2 + 1, span * (t**3 - 2 * t**2 + t), 3 * t**2 - 2 * t**3, span * (t**3 - t**2))
        rows = (values[3 * i + 1], values[3 * i + 2], values[3 * i + 4], values[3 * i + 3])
        return [sum(w * row[k] for w, row in zip(a, rows)) for k in range(len(rows[0]))]
    p, q = key(i), key(i + 1)
    if path != "rotation":
        return [(1 - t) * a + t * b for a, b in zip(p, q)]
    unit = lambda v: [c / math.sqrt(sum(x * x for x in v)) for c in v]
    p, q = unit(p), unit(q)
    dot = sum(a * b for a, b in zip(p, q))
    if dot < 0:
        q, dot = [-c for c in q], -dot
    angle = math.acos(min(dot, 1))
    if angle < 1e-6:
        return [(1 - t) * a + t * b for a, b in zip(p, q)]
    return [(math.sin((1 - t) * angle) * a + math.sin(t * angle) * b) / math.sin(angle) for a, b in zip(p, q)]


def read_bvh(path):
    """(joints with name, parent, offset, channels; rows; seconds a frame)"""
    words = path.read_text().split("\n")
    joints, stack, at = [], [], 0
    while words[at].strip() != "MOTION":
        word = words[at].split()
        if word and word[0] in ("ROOT", "JOINT"):
            joints.append({"name": words[at].strip().split(" ", 1)[1], "parent": stack[-1] if stack else -1, "channels": []})
            stack.append(len(joints) - 1)
        elif word and word[0] == "End":
            stack.append(-2)
        elif word and word[0] == "}":
            stack.pop()
        elif word and word[0] == "OFFSET" and stack[-1] != -2:
            joints[stack[-1]]["offset"] = [float(v) for v in word[1:]]
        elif word and word[0] == "CHANNELS":
            joints[stack[-1]]["channels"] = word[2:]
        at += 1
    frame_time = float(words[at + 2].split()[2])
    return joints, [[float(v) for v in line.split()] for line in words[at + 3 :] if line.strip()], frame_time


def bvh_places(joints, row):
    out, column = [], 0
    for joint in joints:
        at, turn = list(joint["offset"]), [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
        for channel in joint["channels"]:
            axis, value = "XYZ".index(channel[0]), row[column]
            column += 1
            if channel.endswith("position"):
                at[axis] = value
                continue
            half = math.radians(value) / 2
            turn = product(turn, rotation([math.sin(half) * (k == axis) for k in range(3)] + [math.cos(half)]))
        local = placed(turn, at)
        out.append(local if joint["parent"] < 0 else product(out[joint["parent"]], local))
    return out


def check_clip(gltf, animation, bvh, label):
    channels = gltf.channels(animation) if animation else []
    joints, rows, frame_time = read_bvh(bvh)
    first = min((c[3][0] for c in channels), default=0)
    nodes = {}
    for n in range(len(gltf.nodes)):
        nodes.setdefault(gltf.name(n), []).append(n)
    worst, matched = 0.0, 0
    step = max(1, len(rows) // 200)
    for f in range(0, len(rows), step):
        want, got, used = gltf.places(channels, first + f * frame_time), bvh_places(joints, rows[f]), {}
        for joint, place in zip(joints, got):
            named = nodes.get(joint["name"])
            if not named:
                continue
            n = named[min(used.setdefault(joint["name"], 0), len(named) - 1)]
            used[joint["name"]] += 1
            matched += 1
            worst = max(worst, math.dist([100 * want[n][i][3] for i in range(3)], [place[i][3] for i in range(3)]))
    print(f"{label}: {len(rows)} frames at {1 / frame_time:.6g} Hz, {len(joints)} joints, {matched} places, largest error {worst:.2g} cm")
    return worst <= ALLOWED_CM and matched >= (len(joints) - 1) * len(range(0, len(rows), step))


def check_file(kinespace, path, folder):
    gltf = Gltf(path)
    animations = gltf.json.get("animations", [])
    moves = not gltf.missing and (any(gltf.channels(animation) for animation in animations) or gltf.json.get("skins"))
    reason = "beside it" if gltf.missing else "no skin"
    good = True
    for number, animation in enumerate(animations or [None], 1):
        bvh = folder / "out.bvh"
        chosen = ["--animation", str(number)] if animation else []
        run = subprocess.run([kinespace, "convert", str(path), str(bvh), "--quiet", *chosen], capture_output=True, text=True)
        label = f"{path.name} {(animation or {}).get('name', '')}"
        if not moves:
            good = good and run.returncode == 1 and reason in run.stderr
            print(f"{label}: refused: {run.stderr.strip()}")
        elif run.returncode != 0:
            good = False
            print(f"{label}: exit code {run.returncode}: {run.stderr.strip()}")
        else:
            good = check_clip(gltf, animation, bvh, label) and good
    return good


def main():
    files = []
    data = pathlib.Path(os.environ.get("KINESPACE_DATA", "build/data")) / "foreign" / "gltf"
    for argument in map(pathlib.Path, sys.argv[2:] or [data]):
        files += sorted(argument.glob("*.gl*")) if argument.is_dir() else [argument] * argument.exists()
    if not files:
        print("no files to look at")
        return 77
    with tempfile.TemporaryDirectory() as folder:
        good = [check_file(sys.argv[1], path, pathlib.Path(folder)) for path in files]
    print(f"{sum(good)} of {len(good)} files as they should be")
    return 0 if all(good) else 1


sys.exit(main())
