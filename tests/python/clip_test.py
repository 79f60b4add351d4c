import copy
import pathlib
import unittest

import numpy as np
from support import FOLDER, samples

import kinespace


def rotated(q, v):
    """v turned by the unit quaternions w x y z."""
    w, u = q[..., :1], q[..., 1:]
    return v + 2 * np.cross(u, np.cross(u, v) + w * v)


def product(a, b):
    w = a[..., :1] * b[..., :1] - (a[..., 1:] * b[..., 1:]).sum(-1, keepdims=True)
    return np.concatenate([w, a[..., :1] * b[..., 1:] + b[..., :1] * a[..., 1:] + np.cross(a[..., 1:], b[..., 1:])], axis=-1)


def world_positions(clip):
    """Forward kinematics of its own, joint by joint."""
    positions, turns = [], []
    for joint, parent in enumerate(clip.parents):
        local = clip.translations.get(joint, np.tile(clip.offsets[joint], (clip.frames, 1)))
        turn = clip.rotations[:, joint]
        positions.append(local if parent < 0 else positions[parent] + rotated(turns[parent], local))
        turns.append(turn if parent < 0 else product(turns[parent], turn))
    return np.stack(positions, axis=1)


class ClipTest(unittest.TestCase):
    def setUp(self):
        self.file = samples() / "walk_fast_002.bvh"
        self.clip = kinespace.read_clip(self.file)

    def test_says_what_the_file_says(self):
        text = self.file.read_text()
        lines = text[text.index("Frame Time:") :].split("\n")
        rows = np.array([line.split() for line in lines[1:] if line], dtype=float)
        self.assertEqual(self.clip.name, "walk_fast_002")
        self.assertEqual(len(self.clip), len(rows))
        self.assertAlmostEqual(self.clip.frame_time, float(lines[0].split()[-1]), places=6)
        self.assertAlmostEqual(self.clip.duration, (len(rows) - 1) / self.clip.rate)
        self.assertEqual(self.clip.joints, [line.split()[1] for line in text.split("\n") if line.strip().startswith(("ROOT", "JOINT"))])
        np.testing.assert_allclose(self.clip.positions[:, 0], rows[:, :3], atol=1e-9)

    def test_positions_are_those_of_forward_kinematics(self):
        self.assertEqual(self.clip.positions.shape, (self.clip.frames, len(self.clip.joints), 3))
        np.testing.assert_allclose(self.clip.positions, world_positions(self.clip), atol=1e-9)

    def test_rotations_are_the_clips_own_memory(self):
        turns = self.clip.rotations
        self.assertTrue(np.shares_memory(turns, self.clip.rotations))
        self.assertFalse(turns.flags.owndata)
        np.testing.assert_allclose(np.linalg.norm(turns, axis=2), 1, atol=1e-12)
        before = self.clip.positions
        turns[:, 1] = [1, 0, 0, 0]
        self.assertGreater(np.abs(self.clip.positions - before).max(), 0.01)
        np.testing.assert_allclose(self.clip.positions, world_positions(self.clip), atol=1e-9)

    def test_translations_are_the_clips_own_memory(self):
        before = self.clip.positions
        self.clip.translations[0][:] += [1, 2, 3]
        np.testing.assert_allclose(self.clip.positions - before, np.broadcast_to([1, 2, 3], before.shape), atol=1e-9)

    def test_arrays_outlive_the_clip(self):
        turns, positions = self.clip.rotations, self.clip.positions
        kept = turns.copy(), positions.copy()
        del self.clip
        np.testing.assert_array_equal(turns, kept[0])
        np.testing.assert_array_equal(positions, kept[1])

    def test_copies_share_nothing(self):
        for other in (self.clip.copy(), copy.copy(self.clip), copy.deepcopy(self.clip)):
            self.assertFalse(np.shares_memory(other.rotations, self.clip.rotations))
            np.testing.assert_array_equal(other.rotations, self.clip.rotations)

    def test_a_part_has_those_frames(self):
        part = self.clip.part(10, 20)
        np.testing.assert_array_equal(part.positions, self.clip.positions[10:30])
        for first, count in ((-1, 5), (0, 0), (0, self.clip.frames + 1), (self.clip.frames, 1), (2**31 - 1, 2**31 - 1)):
            with self.assertRaises(ValueError):
                self.clip.part(first, count)

    def test_what_is_written_is_read(self):
        out = FOLDER / "written.bvh"
        self.clip.name = "other"
        self.clip.write(out)
        np.testing.assert_allclose(kinespace.read_clip(str(out)).positions, self.clip.positions, atol=1e-3)

    def test_bad_files_are_errors_that_name_the_line(self):
        lines = self.file.read_text().split("\n")
        at = len(lines) - 3
        lines[at] = "1,5 " + lines[at].partition(" ")[2]
        broken = FOLDER / "broken.bvh"
        broken.write_text("\n".join(lines))
        with self.assertRaises(kinespace.Error) as caught:
            kinespace.read_clip(broken)
        self.assertEqual((caught.exception.kind, caught.exception.file, caught.exception.line), ("bad_input", str(broken), at + 1))
        self.assertIn(f"{broken}:{at + 1}: \"1,5\"", str(caught.exception))
        with self.assertRaises(kinespace.Error) as caught:
            kinespace.read_clip(FOLDER / "gone.bvh")
        self.assertIsNone(caught.exception.line)

    def test_names_that_are_no_utf8_come_through(self):
        text = self.file.read_bytes().replace(b"ROOT Hips", b"ROOT H\xfcfte")
        (FOLDER / "latin.bvh").write_bytes(text)
        self.assertEqual(kinespace.read_clip(FOLDER / "latin.bvh").joints[0].encode("utf-8", "surrogateescape"), b"H\xfcfte")

    def test_motion_files_are_found_in_folders(self):
        found = kinespace.find_motion_files(samples())
        self.assertEqual(found, sorted(samples().glob("*.bvh")))
        self.assertEqual(kinespace.find_motion_files([str(self.file), self.file]), [self.file])
        self.assertIsInstance(found[0], pathlib.Path)
        with self.assertRaises(kinespace.Error):
            kinespace.find_motion_files(FOLDER / "gone")
