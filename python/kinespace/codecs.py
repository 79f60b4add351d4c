"""Clips to small streams, and back."""
from typing import TYPE_CHECKING, List, Mapping, Optional, Sequence, Union

from . import _kinespace
from ._kinespace import Clip
from .motion_space import paths_of

if TYPE_CHECKING:
    from ._kinespace import Encoded, Path, Progress


def codecs() -> List[str]:
    """Names of the codecs of clips."""
    return _kinespace.codec_names()


def _read(paths: "Sequence[Path]") -> List[Clip]:
    files = _kinespace.find_motion_files(paths)
    clips = []
    for file, name in zip(files, _kinespace.clip_names(files)):
        clips.append(_kinespace.read_clip(file))
        clips[-1].name = name
    return clips


def _setting(value: Union[bool, float, str]) -> str:
    return ("on" if value else "off") if isinstance(value, bool) else str(value)


def encode(
    clips: "Union[Path, Clip, Sequence[Union[Path, Clip]]]",
    out: "Path",
    *,
    codec: str = "motion-space",
    mean_error_cm: Optional[float] = None,
    max_error_cm: Optional[float] = None,
    bytes: Optional[int] = None,
    settings: Optional[Mapping[str, Union[bool, float, str]]] = None,
    basis: "Optional[Path]" = None,
    progress: "Optional[Progress]" = None,
) -> "Encoded":
    """Compresses clips of one skeleton (Clip objects, or files and folders) into the stream `out`.

    At most one target: mean_error_cm of joint positions over all joints and frames, max_error_cm of any joint in any frame, bytes of the stream.
    settings: of the codec, as `kinespace encode --settings` lists them. basis: a library whose tables the stream leaves out.
    Returns the size in bytes and the errors in cm, measured on what decodes.
    """
    given = [clips] if isinstance(clips, Clip) else clips if not isinstance(clips, str) and isinstance(clips, Sequence) else paths_of(clips)
    ready = [c for c in given if isinstance(c, Clip)]
    ready += _read([c for c in given if not isinstance(c, Clip)]) if len(ready) < len(given) else []
    return _kinespace.encode_clips(
        ready, out, codec=codec, mean_error_cm=mean_error_cm, max_error_cm=max_error_cm, bytes=bytes,
        settings={name: _setting(value) for name, value in (settings or {}).items()}, basis=basis, progress=progress,
    )  # fmt: skip


def decode(path: "Path", *, level: Optional[int] = None, basis: "Optional[Path]" = None) -> List[Clip]:
    """The clips of a stream; the first `level` levels of detail of it, all when None. basis: the library that it was encoded with, if it was."""
    return _kinespace.decode_clips(path, level=-1 if level is None else level, basis=basis)
