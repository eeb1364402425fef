"""Pictures, one after the other, as a film."""

from __future__ import annotations

import shutil
import subprocess
import tempfile
from collections.abc import Callable, Iterable, Sequence
from contextlib import ExitStack, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Protocol

from PIL import Image

from flexspine.errors import OUT_OF_SPACE, InputError, MachineError, OutputError

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    Picture = NDArray[np.uint8]

QUALITY = 20  # x264's constant rate factor; 18 looks as it was drawn, each 6 halves the file


def is_gif(path: Path) -> bool:
    """Tell a GIF from other films by its name."""
    return path.suffix.lower() == ".gif"


class _Film(Protocol):
    """A film that is being made."""

    def add(self, picture: Picture) -> None:
        """Add a picture."""

    def close(self) -> None:
        """Finish the file."""

    def abandon(self) -> None:
        """Let go of everything, the film finished or not."""


def write_film(
    pictures: Iterable[Picture],
    paths: Sequence[Path],
    *,
    fps: int,
    count: int,
    colors: Image.Image | None = None,
    gif_every: int = 1,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write pictures of shape (height, width, 3) to files, GIF or MP4 by their suffixes.

    A GIF gets every ``gif_every``-th picture, in the palette of ``colors`` or else of the first
    picture. ``progress`` is told which share of ``count`` is done. Raises `InputError`, among them
    `OutputError` for a path that cannot be written to, and `MachineError` where the video encoder
    fails; whatever raises leaves no file behind.
    """
    for path in paths:
        if path.suffix.lower() not in (".gif", ".mp4"):
            raise InputError(f"cannot write a film as '{path.name}'", "name it .gif or .mp4")
    # Pictures go to files beside them, so that a failure leaves none half-written.
    parts = {path: path.with_name(f".{path.stem}.part{path.suffix.lower()}") for path in paths}
    films: list[_Film] = []
    try:
        with ExitStack() as made:
            for part in parts.values():
                part.touch()
                films.append(
                    _Gif(part, fps, gif_every, colors) if is_gif(part) else _Video(part, fps)
                )
                made.callback(films[-1].abandon)
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
    def __init__(self, path: Path, fps: int, every: int, colors: Image.Image | None) -> None:
        self._path, self._every, self._colors = path, every, colors
        self._duration = round(1000 * every / fps)  # ms
        self._frames: list[Image.Image] = []
        self._seen = 0

    def add(self, picture: Picture) -> None:
        self._seen += 1
        if (self._seen - 1) % self._every:
            return
        image = Image.fromarray(picture)
        # The same colours in all pictures save time, memory and disk.
        if self._colors is None:
            self._colors = image.quantize(256)
        self._frames.append(image.quantize(palette=self._colors, dither=Image.Dither.NONE))

    def close(self) -> None:
        first, *others = self._frames
        first.save(self._path, save_all=True, append_images=others, duration=self._duration, loop=0)

    def abandon(self) -> None:
        self._frames.clear()


class _Video:
    def __init__(self, path: Path, fps: int) -> None:
        self._path, self._fps, self._encoder = path, fps, video_encoder()
        self._said = tempfile.TemporaryFile()  # noqa: SIM115 (closed by abandon)
        self._process: subprocess.Popen[bytes] | None = None

    def add(self, picture: Picture) -> None:
        if self._process is None:
            self._process = self._start(*picture.shape[:2])
        assert self._process.stdin is not None
        try:
            self._process.stdin.write(picture.tobytes())
        except BrokenPipeError:
            self._process.wait()
            raise self._failure() from None

    def close(self) -> None:
        if self._process is not None:
            self._let_go(self._process)
            if self._process.wait():
                raise self._failure()

    def abandon(self) -> None:
        if self._process is not None:
            self._process.kill()
            self._let_go(self._process)
            self._process.wait()
        self._said.close()

    def _let_go(self, process: subprocess.Popen[bytes]) -> None:
        """Tell the encoder that nothing more will come."""
        assert process.stdin is not None
        with suppress(BrokenPipeError):
            process.stdin.close()

    def _failure(self) -> MachineError:
        self._said.seek(0)
        said = self._said.read().decode(errors="replace").strip() or "it does not say why"
        return MachineError(
            f"the video encoder failed ({said.splitlines()[-1]})", "write a .gif instead"
        )

    def _start(self, height: int, width: int) -> subprocess.Popen[bytes]:
        taken = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r {self._fps} -i -"
        # The codec wants an even number of rows and columns.
        given = f"-c:v libx264 -crf {QUALITY} -pix_fmt yuv420p -vf crop=trunc(iw/2)*2:trunc(ih/2)*2"
        return subprocess.Popen(
            [self._encoder, "-y", "-loglevel", "error", *taken.split(), *given.split(),
             str(self._path.absolute())],
            stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=self._said,
            start_new_session=True,  # an interrupt is for us alone
        )  # fmt: skip


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
