#!/usr/bin/env python3
"""run_tests.py BUILD_FOLDER [unittest options]: the tests of the Python package as it is built there, with sample clips alone."""
import pathlib
import sys
import unittest

HERE = pathlib.Path(__file__).resolve().parent
sys.path[:0] = [str(HERE), str(pathlib.Path(sys.argv[1]).resolve() / "python")]

if __name__ == "__main__":
    tests = unittest.defaultTestLoader.discover(str(HERE), pattern="*_test.py")
    done = unittest.TextTestRunner(verbosity=2).run(tests)
    sys.exit(0 if done.wasSuccessful() and done.testsRun > 0 else 1)
