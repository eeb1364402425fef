"""Work that is kept piece by piece."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from flexspine.errors import OutputError
from flexspine.workers.lasting import do_all

done: list[int] = []


def square(piece: int) -> int:
    done.append(piece)
    if piece == 99:
        raise KeyboardInterrupt
    return piece**2


def carried_out(pieces: list[int], store: Path | None, **about: Any) -> list[int]:
    done.clear()
    return do_all(
        square, pieces, processes=1, progress=lambda _done, _whole: None, store=store,
        description=about, to_json=str, from_json=int,
    )  # fmt: skip


def test_what_is_finished_is_not_done_again(tmp_path: Path) -> None:
    store = tmp_path / "kept.jsonl"
    with pytest.raises(KeyboardInterrupt):
        carried_out([3, 4, 99, 6], store, seed=1)
    assert done == [3, 4, 99]
    text = store.read_text()
    # As if the machine had gone down while a line was written.
    store.write_text(text + '{"piece": 2, "res')
    assert carried_out([3, 4, 5, 6], store, seed=1) == [9, 16, 25, 36]
    assert done == [5, 6]
    assert carried_out([3, 4, 5, 6], store, seed=1) == [9, 16, 25, 36]
    assert done == []


def test_results_come_in_order_and_progress_counts_pieces() -> None:
    seen: list[tuple[int, int]] = []

    def progress(count: int, whole: int) -> None:
        seen.append((count, whole))

    found = do_all(
        square, [1, 2, 3], processes=2, progress=progress, store=None, description={},
        to_json=str, from_json=int,
    )  # fmt: skip
    assert found == [1, 4, 9]
    assert seen == [(0, 3), (1, 3), (2, 3), (3, 3)]


@pytest.mark.parametrize(
    "text", ["{}\n", "no json\n", '{"pieces": 2, "seed": 1}\n', "\xff\n", "[1]\n{}\n"]
)
def test_a_file_of_something_else_is_refused_and_kept(tmp_path: Path, text: str) -> None:
    store = tmp_path / "kept.jsonl"
    store.write_text(text, encoding="latin-1")
    with pytest.raises(OutputError, match="damaged, or holds"):
        carried_out([1, 2], store, seed=1)
    assert store.read_text(encoding="latin-1") == text
    assert done == []


def test_a_file_that_was_made_and_not_written_is_begun_anew(tmp_path: Path) -> None:
    store = tmp_path / "kept.jsonl"
    store.touch()
    assert carried_out([2], store) == [4]
    assert carried_out([2], store) == [4]
    assert done == []


def test_other_settings_are_other_work(tmp_path: Path) -> None:
    store = tmp_path / "kept.jsonl"
    carried_out([1, 2], store, seed=1)
    for pieces, seed in (([1, 2], 2), ([1, 2, 3], 1)):
        with pytest.raises(OutputError, match="other settings"):
            carried_out(pieces, store, seed=seed)
