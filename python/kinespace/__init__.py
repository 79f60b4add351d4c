"""Motion capture in function space.

    import kinespace

    library = kinespace.MotionSpace.build("clips", "mine.kspace")
    for match in library.query("walk_fast_002", k=5):
        print(match.clip, match.distance)

Units: centimetres, seconds, Y up, unit quaternions (w, x, y, z). Arrays are views of the library's own memory where that is said. Long calls let
other threads run, stop at Ctrl-C, and take `progress`, a function that is called with the stage and its share done.
"""
from ._kinespace import Clip, Error, Library, Match, __version__, build_library, read_clip
from .codecs import codecs, decode, encode
from .functional_pca import FunctionalPCA, NotFittedError
from .motion_space import MotionSpace, find_motion_files

__all__ = [
    "Clip",
    "Error",
    "FunctionalPCA",
    "Library",
    "Match",
    "MotionSpace",
    "NotFittedError",
    "__version__",
    "build_library",
    "codecs",
    "decode",
    "encode",
    "find_motion_files",
    "read_clip",
]
