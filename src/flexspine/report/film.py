"""Pictures, one after the other, as a film."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterable, Sequence
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any, Protocol

import numpy as np
from PIL import Image

from flexspine.errors import OUT_OF_SPACE, InputError, MachineError, OutputError

if TYPE_CHECKING:
    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

# Hz; a GIF counts time in hundredths of a second and is large: it takes every second picture of
# faster films.
GIF_RATE = 13


class _Film(Protocol):
    """A film that is being made."""

    def add(self, picture: Picture) -> None:
        """Add a picture."""

    def close(self) -> None:
        """Finish the file."""


def write_film(
    pictures: Iterable[Picture],
    paths: Sequence[Path],
    *,
    fps: int,
    count: int,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write pictures of shape (height, width, 3) to files, GIF or MP4 by their suffixes.

    ``progress`` is told which share of ``count`` is done. Raises `InputError`, among them
    `OutputError` for a path that cannot be written to, and `MachineError` where the video encoder
    fails; whatever raises leaves no file behind.
    """
    makers: dict[str, Callable[[Path, int], _Film]] = {".gif": _Gif, ".mp4": _Video}
    for path in paths:
        if path.suffix.lower() not in makers:
            raise InputError(f"cannot write a film as '{path.name}'", "name it .gif or .mp4")
    parts = {path: path.with_name(f".{path.stem}.part{path.suffix.lower()}") for path in paths}
    try:
        films = [makers[part.suffix](part, fps) for part in parts.values()]
        for number, picture in enumerate(pictures, start=1):
            for film in films:
                film.add(picture)
            if progress is not None:
                progress(number / count)
        for film in films:
            film.close()
        for path, part in parts.items():
            part.replace(path)
    except OSError as failure:
        if failure.errno in OUT_OF_SPACE:
            raise
        raise OutputError(
            f"cannot write '{paths[0].parent}' ({failure.strerror or failure})",
            "give a place that can be written to",
        ) from failure
    finally:
        for part in parts.values():
            if part.parent.is_dir():
                part.unlink(missing_ok=True)


class _Gif:
    def __init__(self, path: Path, fps: int) -> None:
        self._path, self._every = path, 2 if fps > GIF_RATE else 1
        self._duration = round(1000 * self._every / fps)  # ms
        self._frames: list[Image.Image] = []
        self._seen = 0

    def add(self, picture: Picture) -> None:
        self._seen += 1
        if (self._seen - 1) % self._every:
            return
        image = Image.fromarray(picture)
        if not self._frames:
            self._frames.append(image.quantize(256))
            return
        # The colours of the first picture will do for all of them.
        frame = image.quantize(palette=self._frames[0], dither=Image.Dither.NONE)
        self._frames.append(frame)

    def close(self) -> None:
        first, *others = self._frames
        first.save(self._path, save_all=True, append_images=others, duration=self._duration, loop=0)


class _Video:
    def __init__(self, path: Path, fps: int) -> None:
        self._path, self._fps = path, fps
        self._writer: Any = None

    def add(self, picture: Picture) -> None:
        import imageio_ffmpeg

        try:
            if self._writer is None:
                video_encoder()
                size = picture.shape[1], picture.shape[0]
                self._writer = imageio_ffmpeg.write_frames(
                    str(self._path), size, fps=self._fps, codec="libx264", quality=7,
                    macro_block_size=2,
                )  # fmt: skip
                self._writer.send(None)
            self._writer.send(np.ascontiguousarray(picture))
        except RuntimeError as failure:
            raise MachineError("the video encoder failed", "run it again") from failure

    def close(self) -> None:
        if self._writer is not None:
            self._writer.close()


def video_encoder() -> str:
    """Where ffmpeg is. Raises `MachineError` if it is nowhere."""
    import imageio_ffmpeg

    found: str | None = None
    with suppress(RuntimeError):
        found = shutil.which(imageio_ffmpeg.get_ffmpeg_exe())
    if found is None:
        raise MachineError(
            "there is no ffmpeg to make videos with",
            "pip install imageio-ffmpeg, set IMAGEIO_FFMPEG_EXE to one, or give --no-animation",
        )
    return found
