import concurrent.futures
import os
import queue
import signal
import threading
import time
import unittest

import numpy as np
from support import FOLDER, library_file, samples

import kinespace


class LibraryTest(unittest.TestCase):
    def setUp(self):
        self.library = kinespace.Library(library_file())

    def test_lists_its_clips(self):
        library = self.library
        files = sorted(samples().glob("*.bvh"))
        self.assertEqual(library.clips, [file.stem for file in files])
        self.assertEqual(len(library), 72)
        self.assertEqual(library.path, library_file())
        self.assertIn("walk_fast_002", library)
        self.assertNotIn("walk_fast", library)
        at = library.clips.index("walk_fast_002")
        self.assertEqual(library.labels[at], ["walk", "fast"])
        clip = kinespace.read_clip(files[at])
        self.assertEqual((library.frames[at], library.rates[at]), (clip.frames, clip.rate))

    def test_vectors_are_one_block_without_a_copy(self):
        vectors = self.library.vectors
        self.assertEqual((vectors.shape[0], vectors.dtype), (72, np.float32))
        self.assertFalse(vectors.flags.owndata)
        self.assertFalse(vectors.flags.writeable)
        self.assertTrue(np.shares_memory(vectors, self.library.vectors))
        kept = vectors.copy()
        del self.library
        np.testing.assert_array_equal(vectors, kept)

    def test_distances_are_those_of_the_vectors(self):
        vectors = self.library.vectors.astype(np.float64)
        distances = self.library.distance_matrix()
        np.testing.assert_allclose(distances, np.linalg.norm(vectors[:, None] - vectors, axis=2), rtol=1e-5, atol=1e-6)
        np.testing.assert_array_equal(distances, distances.T)
        self.assertGreater(np.abs(self.library.distance_matrix(weighted=True) - distances).max(), 0.01)

    def test_query_without_time_warping_goes_by_the_vectors(self):
        at = self.library.clips.index("walk_fast_002")
        others = np.delete(np.arange(72), at)
        distances = self.library.distance_matrix()[at, others]
        matches = self.library.query("walk_fast_002", k=5, rerank=False)
        self.assertEqual([m.clip for m in matches], [self.library.clips[others[i]] for i in np.argsort(distances, kind="stable")[:5]])
        # The query is the clip as it decodes, the matrix of the clip as it was read.
        np.testing.assert_allclose([m.distance for m in matches], np.sort(distances)[:5], rtol=0.02)

    def test_query_takes_clips_and_labels(self):
        clip = kinespace.read_clip(samples() / "walk_fast_002.bvh")
        self.assertEqual(self.library.query(clip, k=1)[0].clip, "walk_fast_002")
        matches = self.library.query(clip, k=4, labels=["run"])
        self.assertEqual(len(matches), 4 - max(0, 4 - sum("run" in of for of in self.library.labels)))
        self.assertTrue(all("run" in m.labels for m in matches))
        self.assertEqual([m.distance for m in matches], sorted(m.distance for m in matches))

    def test_clips_come_back_from_functions(self):
        original = kinespace.read_clip(samples() / "walk_fast_002.bvh").positions
        errors = {}
        for functions in (3, 10, None):
            off = np.linalg.norm(self.library.clip("walk_fast_002", functions).positions - original, axis=2)
            errors[functions] = off.mean(), off.max()
        self.assertGreater(errors[3], errors[10])
        self.assertGreater(errors[10], errors[None])
        self.assertLess(errors[None][1], 1)
        levels = self.library.level_errors("walk_fast_002")
        at = list(levels["functions"]).index(10)
        np.testing.assert_allclose([levels["mean_joint_error_cm"][at], levels["max_joint_error_cm"][at]], errors[10], rtol=0.02)

    def test_functions_are_orthonormal(self):
        sets = self.library.functions
        self.assertGreater(len(sets), 1)
        for groups in sets.values():
            for functions in groups:
                self.assertFalse(functions.flags.owndata or functions.flags.writeable)
                weights = np.full(functions.shape[1], 1 / (functions.shape[1] - 1))
                weights[[0, -1]] /= 2
                np.testing.assert_allclose((functions * weights) @ functions.T, np.eye(len(functions)), atol=1e-8)

    def test_what_is_not_there_is_an_error(self):
        with self.assertRaisesRegex(kinespace.Error, "walk_fast_002") as caught:
            self.library.clip("walk_fast_02")
        self.assertEqual(caught.exception.kind, "usage")
        for call in (lambda: kinespace.Library(FOLDER / "gone.kspace"), lambda: kinespace.Library(samples() / "walk_fast_002.bvh"),
                     lambda: self.library.query("walk_fast_002", k=0), lambda: self.library.query("walk_fast_002", device="abacus")):
            with self.assertRaises(kinespace.Error):
                call()
        with self.assertRaises(ValueError):
            self.library.clip("walk_fast_002", 0)
        with self.assertRaises(TypeError):
            self.library.query(7)

    def test_threads_share_a_library(self):
        wanted = [[m.clip for m in self.library.query(name, k=3)] for name in self.library.clips[:8]]
        shared = kinespace.Library(library_file())
        with concurrent.futures.ThreadPoolExecutor(4) as pool:
            found = pool.map(lambda name: [m.clip for m in shared.query(name, k=3, progress=lambda *_: None)], self.library.clips[:8])
            self.assertEqual(list(found), wanted)


class BuildTest(unittest.TestCase):
    def few(self, n=6):
        return sorted(samples().glob("walk_*.bvh"))[:n]

    def test_options_reach_the_build(self):
        report = kinespace.build_library(self.few(), FOLDER / "few.kspace", functions=4, align=False, cycles=0)
        self.assertEqual((report["clips"], report["functions"]), (6, 4))
        more = kinespace.MotionSpace.build(sorted(samples().glob("run_*.bvh"))[:2], FOLDER / "few.kspace", add=True)
        self.assertEqual(len(more), 8)
        with self.assertRaisesRegex(ValueError, "grouping"):
            kinespace.MotionSpace.build(self.few(), FOLDER / "never.kspace", grouping="none")
        with self.assertRaises(kinespace.Error):
            kinespace.MotionSpace.build(self.few(), FOLDER / "never.kspace", variance=2)
        self.assertFalse((FOLDER / "never.kspace").exists())

    def test_progress_is_told(self):
        told = []
        kinespace.MotionSpace.build(self.few(), FOLDER / "told.kspace", progress=lambda stage, done: told.append((stage, done)))
        self.assertGreater(len({stage for stage, _ in told}), 1)
        self.assertTrue(all(0 <= done <= 1 for _, done in told))

    def test_what_the_callback_raises_stops_the_build(self):
        out = FOLDER / "stopped.kspace"

        def stop(stage, done):
            raise RuntimeError(f"enough of {stage}")

        with self.assertRaisesRegex(RuntimeError, "enough of"):
            kinespace.MotionSpace.build(self.few(), out, progress=stop)
        self.assertFalse(out.exists())

    def test_a_library_in_use_says_so_to_its_own_callback(self):
        library = kinespace.Library(library_file())
        raised = []

        def again(stage, done):
            try:
                library.clip("walk_fast_002")
            except kinespace.Error as error:
                raised.append(error.kind)

        library.query("walk_fast_002", progress=again)
        self.assertEqual(set(raised), {"usage"})

    def test_ctrl_c_stops_a_build(self):
        out = FOLDER / "interrupted.kspace"
        # A callback without a line of Python: no interpreter is there to see the signal but by the build's own asking.
        told = queue.SimpleQueue()

        def interrupt():
            told.get()
            os.kill(os.getpid(), signal.SIGINT)

        thread = threading.Thread(target=interrupt)
        thread.start()
        with self.assertRaises(KeyboardInterrupt):
            kinespace.MotionSpace.build(samples(), out, progress=told.put)
        thread.join()
        # One that does not listen ends first, and then raises.
        self.assertFalse(out.exists())

    def test_other_threads_run_meanwhile(self):
        turns, done = [], threading.Event()

        def run():
            while not done.is_set():
                turns.append(1)
                time.sleep(0.001)

        thread = threading.Thread(target=run)
        thread.start()
        before = len(turns)
        kinespace.MotionSpace.build(samples(), FOLDER / "meanwhile.kspace")
        after = len(turns)
        done.set()
        thread.join()
        self.assertGreater(after - before, 10)
