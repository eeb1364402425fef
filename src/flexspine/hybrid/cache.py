"""Machine code kept on disk, so that only the first start compiles.

heyoka stores what it compiled under a checksum and keys it by the code itself, its own version
and the CPU. This module only gives that store a place of its own and sees to it that a broken
one is thrown away and an unusable one is done without, both silently.
"""

from __future__ import annotations

import contextlib
import os
import shutil
from pathlib import Path

import heyoka as hy
from platformdirs import user_cache_path

DIRECTORY_VARIABLE = "FLEXSPINE_CACHE_DIR"

_opened: list[Path] = []


def cache_directory() -> Path:
    """Return where compiled code is kept: ``$FLEXSPINE_CACHE_DIR`` or the user's cache."""
    chosen = os.environ.get(DIRECTORY_VARIABLE)
    return Path(chosen) if chosen else user_cache_path("flexspine") / "compiled"


def open_cache() -> None:
    """Make heyoka use the store; called before anything is compiled."""
    directory = cache_directory()
    if directory in _opened:
        return
    _opened[:] = [directory]
    hy.set_logger_level_critical()  # an unusable store costs a compilation, not a message
    hy.llvm_state.set_diskcache_path(directory)
    hy.llvm_state.set_diskcache_enabled(True)
    mend_cache()
    if not _usable():
        hy.llvm_state.set_diskcache_enabled(False)


def mend_cache() -> None:
    """Delete a corrupt store, so that the next compilation rebuilds it."""
    directory = cache_directory()
    if directory.exists() and not _usable():
        _delete(directory)


def clear_cache() -> tuple[Path, int]:
    """Delete all compiled code; returns the directory and the bytes freed."""
    directory = cache_directory()
    size = sum(file.stat().st_size for file in directory.glob("*")) if directory.is_dir() else 0
    _delete(directory)
    _opened.clear()
    return directory, size


def _usable() -> bool:
    try:
        hy.llvm_state.get_diskcache_size()
    except RuntimeError:
        return False
    return True


def _delete(directory: Path) -> None:
    with contextlib.suppress(OSError):
        shutil.rmtree(directory)
