"""What every crew of workers has to do."""

from __future__ import annotations

from collections.abc import Iterator

from flexspine.workers.crew import Crew


def assert_every_piece_is_done_once(crew: Crew, most_ahead: int) -> None:
    """In any order, with few pieces taken before they are wanted."""
    taken, most, done = 0, 0, dict[int, int]()

    def jobs() -> Iterator[tuple[int, int]]:
        nonlocal taken
        for number in range(50):
            taken += 1
            yield number, -number

    for number, result in crew.map(abs, jobs()):
        most = max(most, taken - len(done))
        assert number not in done
        done[number] = result
    assert list(crew.map(abs, [])) == []
    assert done == {number: number for number in range(50)}
    assert 1 <= most <= most_ahead
