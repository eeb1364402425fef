"""Machine code kept on disk, so that only the first start compiles.

heyoka stores what it compiled under a checksum and keys it by the code itself, its own version
and the CPU. This module only gives that store a place of its own and sees to it that a broken
one is thrown away and an unusable one is done without, both silently.
"""

from __future__ import annotations

import contextlib
import os
from pathlib import Path

import heyoka as hy
from platformdirs import user_cache_path

DIRECTORY_VARIABLE = "FLEXSPINE_CACHE_DIR"

_STORE_FILES = "cache.db*"

# A store that is locked or read-only is another matter: it is done without, never deleted.
_SIGNS_OF_CORRUPTION = ("corrupt", "malformed", "not a database")

# Bytes; a start takes the longer the larger the store is, and heyoka would keep 20 GB.
LIMIT = 1 << 30

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
    with contextlib.suppress(RuntimeError):  # of a store that others may read and not write
        if hy.llvm_state.get_diskcache_enabled() and hy.llvm_state.get_diskcache_limit() != LIMIT:
            hy.llvm_state.set_diskcache_limit(LIMIT)


def mend_cache() -> None:
    """Delete a corrupt store, so that the next compilation rebuilds it; give up an unusable one."""
    if not hy.llvm_state.get_diskcache_enabled():
        return
    fault = _fault()
    if any(sign in fault for sign in _SIGNS_OF_CORRUPTION):
        _delete_store()
        fault = _fault()
    if fault:
        hy.llvm_state.set_diskcache_enabled(False)


def clear_cache() -> tuple[Path, int]:
    """Delete all compiled code; returns the directory and the bytes freed."""
    freed = _delete_store()
    _opened.clear()
    return cache_directory(), freed


def _fault() -> str:
    """What heyoka says about the store; nothing if it can be used. It waits 5 s for a lock."""
    try:
        hy.llvm_state.get_diskcache_size()
    except RuntimeError as fault:
        return str(fault)
    return ""


def _delete_store() -> int:
    """Delete heyoka's own files and nothing else; returns the bytes freed."""
    freed = 0
    for file in cache_directory().glob(_STORE_FILES):
        with contextlib.suppress(OSError):
            size = file.stat().st_size
            file.unlink()
            freed += size
    return freed
