"""What the tests of the Python package share: the build, sample clips, a library of them."""
import atexit
import functools
import pathlib
import subprocess
import sys
import tempfile

BUILD = pathlib.Path(sys.argv[1]).resolve()
SOURCE = pathlib.Path(__file__).resolve().parent.parent.parent
_folder = tempfile.TemporaryDirectory(prefix="kinespace-python-")
atexit.register(_folder.cleanup)
FOLDER = pathlib.Path(_folder.name)


@functools.lru_cache(maxsize=None)
def samples():
    """The folder of the 72 sample clips."""
    subprocess.run([BUILD / "kinespace-samples", FOLDER / "clips"], check=True, stdout=subprocess.DEVNULL)
    return FOLDER / "clips"


@functools.lru_cache(maxsize=None)
def library_file():
    import kinespace

    kinespace.MotionSpace.build(samples(), FOLDER / "sample.kspace")
    return FOLDER / "sample.kspace"
