"""Pictures, one after the other, as a film."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from PIL import Image

from flexspine.errors import InputError, MachineError, OutputError

if TYPE_CHECKING:
    from numpy.typing import NDArray


def write_film(
    pictures: Iterable[NDArray[np.uint8]],
    path: Path,
    *,
    fps: int,
    count: int,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write pictures of shape (height, width, 3) as a GIF or an MP4, by the suffix of ``path``.

    ``progress`` is told which share of ``count`` is done. Raises `InputError`, among them
    `OutputError` for a path that cannot be written to, and `MachineError` where the video encoder
    fails; whatever raises leaves no file behind.
    """
    suffix = path.suffix.lower()
    if suffix not in (".gif", ".mp4"):
        raise InputError(f"cannot write a film as '{path.name}'", "name it .gif or .mp4")
    part = path.with_name(f".{path.stem}.part{suffix}")

    def told() -> Iterable[NDArray[np.uint8]]:
        for number, picture in enumerate(pictures, start=1):
            yield picture
            if progress is not None:
                progress(number / count)

    try:
        (_write_gif if suffix == ".gif" else _write_video)(told(), part, fps)
        part.replace(path)
    except OSError as failure:
        raise OutputError(
            f"cannot write '{path}' ({failure.strerror or failure})",
            "give a place that can be written to",
        ) from failure
    finally:
        if part.parent.is_dir():
            part.unlink(missing_ok=True)


def _write_gif(pictures: Iterable[NDArray[np.uint8]], path: Path, fps: int) -> None:
    frames: list[Image.Image] = []
    for picture in pictures:
        # The colours of the first picture will do for all of them.
        image = Image.fromarray(picture)
        frames.append(
            image.quantize(palette=frames[0], dither=Image.Dither.NONE)
            if frames
            else image.quantize(256)
        )
    duration = round(1000 / fps)  # ms
    frames[0].save(path, save_all=True, append_images=frames[1:], duration=duration, loop=0)


def _write_video(pictures: Iterable[NDArray[np.uint8]], path: Path, fps: int) -> None:
    import imageio_ffmpeg

    writer = None
    try:
        for picture in pictures:
            if writer is None:
                size = picture.shape[1], picture.shape[0]
                writer = imageio_ffmpeg.write_frames(
                    str(path), size, fps=fps, codec="libx264", quality=7, macro_block_size=2
                )
                writer.send(None)
            writer.send(np.ascontiguousarray(picture))
    except RuntimeError as failure:
        raise MachineError("the video encoder failed", "write a .gif instead") from failure
    finally:
        if writer is not None:
            writer.close()
