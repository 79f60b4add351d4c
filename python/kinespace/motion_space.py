"""Motion files and the libraries that are built of them."""
import os
import pathlib
import warnings
from typing import TYPE_CHECKING, List, Optional, Sequence, Union

from . import _kinespace

if TYPE_CHECKING:
    from ._kinespace import Path, Progress


def paths_of(paths: "Union[Path, Sequence[Path]]") -> "List[Path]":
    """One path, or several."""
    return [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)


def find_motion_files(paths: "Union[Path, Sequence[Path]]") -> List[pathlib.Path]:
    """Every motion file among files and folders (with all below them); sorted, each once. Error when there is none."""
    return _kinespace.find_motion_files(paths_of(paths))


class MotionSpace:
    """Makes motion spaces; what was made is a Library."""

    @staticmethod
    def build(
        paths: "Union[Path, Sequence[Path]]",
        out: "Path",
        *,
        add: bool = False,
        by_skeleton: bool = False,
        asf: "Optional[Path]" = None,
        variance: float = 0.999999,
        functions: Optional[int] = None,
        points: int = 0,
        grouping: str = "all",
        smooth: bool = False,
        cycles: int = 3,
        align: bool = True,
        device: str = "auto",
        progress: "Optional[Progress]" = None,
    ) -> _kinespace.Library:
        """Builds the library file `out` of clips, or of folders of clips, and opens it. It is replaced in one step at the end.

        add: extend the library that is there. by_skeleton: a space for each joint tree. asf: the skeleton of .amc clips, else found beside them.
        variance: share of the curves' variance that every sequence keeps, in (0, 1]; functions: a count instead. points: of a sequence's time grid,
        4 to 1024 (0: by the frame rate). grouping: which curves share functions, "all", "component" or "joint". smooth: smooth mean and covariance,
        expected scores. cycles: most whole cycles of a sequence, 0 to 8. align: False for windows of equal length without warps. device: "auto",
        "cpu", "opencl" or "opencl:N".

        What looks wrong in clips is a warning. Stopped (Ctrl-C, or by what `progress` raises), it leaves `out` as it was; the same call goes on
        from what it has read.
        """
        report = _kinespace.build_library(
            paths_of(paths), out, add=add, by_skeleton=by_skeleton, asf=asf, variance=variance, functions=functions, points=points,
            grouping=grouping, smooth=smooth, cycles=cycles, align=align, device=device, progress=progress,
        )  # fmt: skip
        for doubt in report["doubts"]:
            warnings.warn(doubt, stacklevel=2)
        return _kinespace.Library(out)
