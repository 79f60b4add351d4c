"""The types and the manual of the extension. Paths are str or os.PathLike."""
import os
import pathlib
from typing import Callable, Dict, List, Optional, Sequence, Tuple, TypedDict, Union, overload

import numpy as np
import numpy.typing as npt

__version__: str

Path = Union[str, "os.PathLike[str]"]
# Called with the stage and its share done, 0 to 1; what it raises stops the work and is raised by the call.
Progress = Callable[[str, float], object]

class Error(Exception):
    """Bad input (a file, a stream, an option), or a machine that cannot go on.

    str(error) names the file and line, what was found, what was expected and what to do.
    """

    kind: str  # "bad_input", "usage" or "machine"
    file: Optional[str]
    line: Optional[int]  # from 1

class Clip:
    """The motion of one skeleton at a fixed rate. From read_clip, decode and Library.clip."""

    name: str  # the file name without its ending
    @property
    def frames(self) -> int: ...
    @property
    def rate(self) -> float:
        """Frames per second."""
    @property
    def frame_time(self) -> float:
        """Seconds from one frame to the next."""
    @property
    def duration(self) -> float:
        """Seconds from the first frame to the last."""
    @property
    def joints(self) -> List[str]:
        """Names, in file order: every parent before its children, joint 0 first."""
    @property
    def parents(self) -> List[int]:
        """Of each joint; -1 for joint 0."""
    @property
    def offsets(self) -> npt.NDArray[np.float64]:
        """[joints, 3]: where each joint is at rest in its parent's frame, cm. A copy."""
    @property
    def rotations(self) -> npt.NDArray[np.float64]:
        """[frames, joints, 4]: local unit quaternions w x y z. A view of the clip: what is written to it is the clip's."""
    @property
    def translations(self) -> Dict[int, npt.NDArray[np.float64]]:
        """By joint, of those that move in their parent's frame: [frames, 3] in cm, in place of the offset. Views of the clip, as rotations."""
    @property
    def positions(self) -> npt.NDArray[np.float64]:
        """[frames, joints, 3]: world positions in cm, computed anew each time it is asked for, from rotations and translations as they are."""
    def part(self, first: int, count: int) -> Clip:
        """Frames first to first + count - 1 as a clip of its own. ValueError when they are not there."""
    def copy(self) -> Clip: ...
    def __copy__(self) -> Clip: ...
    def __deepcopy__(self, memo: Dict[int, object]) -> Clip: ...
    def __len__(self) -> int: ...
    def write(self, path: Path) -> None:
        """Writes a file by its ending (.bvh, .amc with its .asf, .glb), whole or not at all."""

class Match:
    """A clip near to another."""

    @property
    def clip(self) -> str: ...
    @property
    def labels(self) -> List[str]: ...
    @property
    def distance(self) -> float:
        """What matches are ordered by: the normalised cost of time warping, or without rerank the vectors' distance."""
    @property
    def vector_distance(self) -> float: ...
    @property
    def start(self) -> float:
        """Where in the clip, in seconds; end likewise."""
    @property
    def end(self) -> float: ...

class LevelErrors(TypedDict):
    functions: npt.NDArray[np.int64]
    mean_joint_error_cm: npt.NDArray[np.float64]
    max_joint_error_cm: npt.NDArray[np.float64]

class Library:
    """A library file, as it was when it was opened. Threads may share one; they take turns."""

    def __init__(self, path: Path) -> None: ...
    @property
    def path(self) -> pathlib.Path: ...
    @property
    def clips(self) -> List[str]:
        """Names, in the order of adding. All that is one value a clip has this order."""
    @property
    def labels(self) -> List[List[str]]: ...
    @property
    def frames(self) -> npt.NDArray[np.int64]:
        """[clips]: lengths in frames."""
    @property
    def rates(self) -> npt.NDArray[np.float64]:
        """[clips]: frames per second."""
    @property
    def vectors(self) -> npt.NDArray[np.float32]:
        """[clips, dimensions]: the vector of each clip, most important function first; the distance of two is that of the clips' curves.

        Read once and kept; read-only. Error when the clips are of several joint trees.
        """
    @property
    def functions(self) -> Dict[int, List[npt.NDArray[np.float64]]]:
        """The functions of the motion space, by the whole cycles that a sequence holds (0: cut at rests); [functions, points] for each group of curves.

        Orthonormal under the trapezoid rule over [0, 1]. Read-only views.
        """
    def distance_matrix(self, *, weighted: bool = False, progress: Optional[Progress] = None) -> npt.NDArray[np.float64]:
        """[clips, clips]: the distances of vectors. weighted: joints count by how far they move what hangs on them."""
    @overload
    def query(self, clip: str, k: int = 10, *, rerank: bool = True, weighted: bool = False, labels: Sequence[str] = (), device: str = "auto",
              progress: Optional[Progress] = None) -> List[Match]:
        """The k clips nearest to one of the library (which is left out), or to any Clip; nearest first.

        rerank: the 50 best by their vectors are ordered again by time warping. labels: only clips that have all of these.
        """
    @overload
    def query(self, clip: Clip, k: int = 10, *, rerank: bool = True, weighted: bool = False, labels: Sequence[str] = (), device: str = "auto",
              progress: Optional[Progress] = None) -> List[Match]: ...
    def clip(self, name: str, functions: Optional[int] = None) -> Clip:
        """The clip decoded from that many functions, all when None."""
    def level_errors(self, name: str) -> LevelErrors:
        """How far the joints of some levels of detail are from those of the clip as it was read, in cm."""
    def __len__(self) -> int: ...
    def __contains__(self, name: str) -> bool: ...

class Report(TypedDict):
    clips: int
    added: int
    unchanged: int
    sequences: int
    spaces: int
    functions: int
    variance: float
    movement: float
    mean_joint_error_cm: float
    max_joint_error_cm: float
    frames: int
    bytes: int
    doubts: List[str]

class Fit(TypedDict):
    mean: npt.NDArray[np.float64]
    weights: npt.NDArray[np.float64]
    eigenvalues: npt.NDArray[np.float64]
    shares: npt.NDArray[np.float64]
    functions: npt.NDArray[np.float64]
    projection: npt.NDArray[np.float64]
    noise_variance: Optional[float]

class Encoded(TypedDict):
    bytes: int
    mean_joint_error_cm: float
    max_joint_error_cm: float

def read_clip(path: Path, asf: Optional[Path] = None, animation: str = "") -> Clip:
    """Reads a clip by its ending; an .amc with `asf`, else with the .asf beside it; of a glTF file with several animations the first, or that of the name or number `animation`."""

def build_library(paths: Sequence[Path], out: Path, *, add: bool = False, by_skeleton: bool = False, asf: Optional[Path] = None,
                  variance: float = 0.999999, functions: Optional[int] = None, points: int = 0, grouping: str = "all", smooth: bool = False,
                  cycles: int = 3, align: bool = True, device: str = "auto", progress: Optional[Progress] = None) -> Report:
    """What `kinespace build` does, with its options; returns what it prints. MotionSpace.build is the same and opens the library."""

def find_motion_files(paths: Sequence[Path]) -> List[pathlib.Path]: ...
def clip_names(files: Sequence[Path]) -> List[str]: ...
def codec_names() -> List[str]: ...
def encode_clips(clips: Sequence[Clip], out: Path, *, codec: str, mean_error_cm: Optional[float], max_error_cm: Optional[float],
                 bytes: Optional[int], settings: Dict[str, str], basis: Optional[Path], progress: Optional[Progress]) -> Encoded: ...
def decode_clips(path: Path, *, level: int, basis: Optional[Path]) -> List[Clip]: ...
def fit_functional_pca(curves: npt.NDArray[np.float64], *, count: Optional[int], share: float, smoothing: Optional[float], start: float,
                       end: float) -> Fit: ...
