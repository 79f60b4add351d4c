import unittest

import numpy as np
from support import FOLDER, library_file, samples

import kinespace


class CodecsTest(unittest.TestCase):
    def test_streams_keep_to_their_target(self):
        files = sorted(samples().glob("walk_*.bvh"))[:4]
        out = FOLDER / "walks.ksm"
        for clips in (files, [kinespace.read_clip(file) for file in files]):
            report = kinespace.encode(clips, out, max_error_cm=1.0)
            decoded = kinespace.decode(out)
            self.assertEqual(report["bytes"], out.stat().st_size)
            self.assertEqual([clip.name for clip in decoded], [file.stem for file in files])
            worst = max(np.linalg.norm(clip.positions - kinespace.read_clip(file).positions, axis=2).max() for clip, file in zip(decoded, files))
            self.assertLessEqual(worst, 1.0)
            self.assertAlmostEqual(report["max_joint_error_cm"], worst, places=4)

    def test_every_codec_goes_there_and_back(self):
        clip = kinespace.read_clip(samples() / "walk_fast_002.bvh")
        self.assertIn("motion-space", kinespace.codecs())
        for codec in kinespace.codecs():
            kinespace.encode(clip, FOLDER / "one.ksm", codec=codec)
            (back,) = kinespace.decode(FOLDER / "one.ksm")
            self.assertEqual((back.frames, back.joints), (clip.frames, clip.joints))

    def test_a_basis_makes_streams_small_and_is_asked_for(self):
        file = samples() / "walk_fast_002.bvh"
        alone = kinespace.encode(file, FOLDER / "alone.ksm", mean_error_cm=0.5)["bytes"]
        shared = kinespace.encode(file, FOLDER / "shared.ksm", mean_error_cm=0.5, basis=library_file())["bytes"]
        self.assertLess(shared, alone)
        self.assertEqual(len(kinespace.decode(FOLDER / "shared.ksm", basis=library_file())), 1)
        with self.assertRaises(kinespace.Error):
            kinespace.decode(FOLDER / "shared.ksm")

    def test_settings_are_checked(self):
        file = samples() / "walk_fast_002.bvh"
        for bad in ({"codec": "none"}, {"settings": {"none": 1}}, {"mean_error_cm": -1.0}, {"mean_error_cm": 1.0, "bytes": 1000}):
            with self.assertRaises(kinespace.Error):
                kinespace.encode(file, FOLDER / "never.ksm", **bad)
        self.assertFalse((FOLDER / "never.ksm").exists())

    def test_what_the_callback_raises_stops_encoding(self):
        def stop(stage, done):
            raise RuntimeError("enough")

        # Learning the tables of a library that has none yet is what takes long, and tells.
        files = sorted(samples().glob("walk_*.bvh"))[:4]
        kinespace.MotionSpace.build(files, FOLDER / "basis.kspace")
        with self.assertRaisesRegex(RuntimeError, "enough"):
            kinespace.encode(files, FOLDER / "stopped.ksm", mean_error_cm=0.5, basis=FOLDER / "basis.kspace", progress=stop)
        self.assertFalse((FOLDER / "stopped.ksm").exists())
