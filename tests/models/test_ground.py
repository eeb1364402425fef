"""Height profiles of the ground."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from flexspine.errors import InputError, ParameterError
from flexspine.models.ground import SIGHT, Ground


def test_heights_of_every_kind() -> None:
    assert Ground.step(0.05, at=2.0).heights([1.99, 2.0, 9.0]).tolist() == [0.0, 0.05, 0.05]
    assert Ground.step(0.05, at=2.0).height(2.0, ahead=False) == 0.0
    stairs = Ground.stairs(0.1, 0.5, 3, at=1.0).heights([0.9, 1.2, 1.7, 2.2, 9.0])
    assert stairs == pytest.approx([0.0, 0.1, 0.2, 0.3, 0.3])
    assert Ground.ramp(0.2, 4.0, at=1.0).heights([0, 2, 5, 8]) == pytest.approx([0, 0.05, 0.2, 0.2])
    assert Ground.slope(-45, at=1.0).heights([0, 3]) == pytest.approx([0, -2])
    wave = Ground.waves(0.1, 4.0, at=1.0).heights([0, 2, 4, 5])
    assert wave == pytest.approx([0, 0.1, -0.1, 0])


def test_rough_ground_repeats_for_a_seed_and_keeps_to_its_height() -> None:
    one, same, other = (Ground.rough(0.03, 0.25, 50.0, seed) for seed in (1, 1, 2))
    assert one == same
    assert one.points != other.points
    places = np.linspace(0, 60, 5000)
    heights = one.heights(places)
    assert np.abs(heights).max() <= 0.03
    assert np.abs(heights).max() > 0.025
    assert heights[places < 1.0].max() == 0.0


def test_blocks_are_level_between_faces() -> None:
    ground = Ground.blocks(0.03, 0.5, 10.0, seed=4)
    for k in range(19):
        inside = ground.heights(np.linspace(1.0 + 0.5 * k + 1e-9, 1.5 + 0.5 * k - 1e-9, 5))
        assert np.ptp(inside) == 0.0
    assert len(set(ground.heights(np.arange(1.25, 10, 0.5)))) == 18


# Some of them as far apart as the animal sees.
places = st.floats(-20, 20) | st.integers(-8, 8).map(lambda k: k / 2)
profiles = st.lists(st.tuples(places, st.floats(-1, 1)), min_size=1, max_size=12).map(
    lambda points: _made_a_profile(sorted(points))
)


def _made_a_profile(points: list[tuple[float, float]]) -> tuple[tuple[float, float], ...]:
    """No more than two points at one x, and no slopes that are nearly faces."""
    kept = points[:1]
    for x, y in points[1:]:
        same = [each for each in kept if each[0] == x]
        if len(same) == 1 or (not same and x - kept[-1][0] > 0.05):
            kept.append((x, y))
    return tuple(kept)


@given(profiles, st.floats(-1, 1), st.floats(-1, 1), st.floats(-0.1, 0.1), places)
def test_pieces_are_the_ground(
    points: tuple[tuple[float, float], ...], before: float, after: float, wave: float, x: float
) -> None:
    """Each piece agrees with interpolation, holds its place, and is never far."""
    ground = Ground("any", points, before, after, wave, 2.0)
    xs, ys = np.transpose(points)
    for ahead in (True, False):
        piece = ground.piece(x, ahead=ahead)
        assert piece.start <= x <= piece.end
        assert piece.start < piece.end
        assert piece.end - piece.start <= 2 * SIGHT + 1e-9
        middle = (piece.start + piece.end) / 2
        expected = float(np.interp(middle, xs, ys))
        if middle < xs[0]:
            expected += before * (middle - xs[0])
        if middle > xs[-1]:
            expected += after * (middle - xs[-1]) + wave * math.sin(math.pi * (middle - xs[-1]))
        assert ground.height(middle) == pytest.approx(expected, abs=1e-9)
    near = [*np.linspace(x - SIGHT, x + SIGHT, 101), *(p for p in xs if abs(p - x) <= SIGHT)]
    tops = [ground.height(float(p), ahead=ahead) for p in near for ahead in (True, False)]
    assert max(tops) <= ground.top(x) + 1e-12


def test_an_outline_runs_through_every_point() -> None:
    ground = Ground.stairs(0.1, 0.5, 3, at=1.0)
    outline = ground.outline(0.0, 3.0)
    assert outline[0].tolist() == [0.0, 0.0]
    assert outline[-1] == pytest.approx([3.0, 0.3])
    assert outline[1:-1] == pytest.approx(np.array(ground.points))
    waves = Ground.waves(0.1, 1.0).outline(0.0, 4.0)
    assert waves[:, 1].max() == pytest.approx(0.1, rel=1e-2)


def test_ground_is_read_from_csv(tmp_path: Path) -> None:
    file = tmp_path / "track.csv"
    file.write_text("x,y\n0,0\n2,0.1\n2,0.2\n")
    assert Ground.read(file) == Ground("track.csv", ((0.0, 0.0), (2.0, 0.1), (2.0, 0.2)))
    file.write_text("\ufeffx,y\n0,0\n\n1,0.5\n", encoding="utf-8")
    assert Ground.read(file).height(0.5) == pytest.approx(0.25)


@pytest.mark.parametrize(
    ("text", "told"),
    [
        ("x,y\n0,zero\n", "line 2"),
        ("x,y\n0\n", "line 2"),
        ("0,inf\n", "line 1"),
        ("1,0\n0,0\n", "goes back"),
        ("", "track.csv. has no points"),
        ("0,1e9\n", "too high"),
        ("1,0\n1,0.5\n1,0\n", "two for a face"),
        ("1,0\n1.0001,0.5\n", "same x"),
    ],
)
def test_what_is_no_ground_is_told_in_one_line(tmp_path: Path, text: str, told: str) -> None:
    file = tmp_path / "track.csv"
    file.write_text(text)
    with pytest.raises(InputError, match=told):
        Ground.read(file)


def test_a_file_that_is_missing_or_no_text_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="No such file"):
        Ground.read(tmp_path / "none.csv")
    (tmp_path / "bytes.csv").write_bytes(b"\xff\xfe\x00\x01")
    with pytest.raises(InputError, match="cannot be read"):
        Ground.read(tmp_path / "bytes.csv")


@pytest.mark.parametrize(
    "make",
    [
        lambda: Ground.rough(0.1, spacing=0.0),
        lambda: Ground.rough(math.nan),
        lambda: Ground.rough(0.1, seed=-1),
        lambda: Ground.rough(0.1, spacing=1e-3, length=1e6),
        lambda: Ground.waves(0.1, 0.0),
        lambda: Ground.waves(math.inf),
        lambda: Ground.slope(90),
        lambda: Ground.stairs(0.1, count=0),
        lambda: Ground.stairs(0.1, count=2.7),  # type: ignore[arg-type]
        lambda: Ground.rough(0.1, spacing=500.0),
        lambda: Ground.waves(0.1, 1e-3),
        lambda: Ground.stairs(0.1, length=-1),
        lambda: Ground.ramp(0.1, length=0),
        lambda: Ground.step(math.nan),
        lambda: Ground.step(0.1, at=math.nan),
    ],
)
def test_numbers_that_make_no_ground_are_refused(make: Callable[[], Ground]) -> None:
    with pytest.raises(ParameterError):
        make()
