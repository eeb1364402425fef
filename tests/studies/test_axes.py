"""Where a plan puts its points: grids, samples, and ranges about a model's own value."""

from __future__ import annotations

import itertools
import tomllib
from importlib.resources import files
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import qmc

from flexspine import InputError, Model, Plan, load_model
from flexspine.studies.axes import Axis

FLEXIBLE, SCOUT = "kamimura2015-flexible", "scout2"

# Sampled over [0, 1], which every apex coordinate may be.
UNIT = {"low": 0, "high": 1}


def plan_of(axes: dict[str, Any], *models: Model | str, **more: Any) -> Plan:
    """A plan with the axes that a file would describe like this."""
    loaded = [load_model(m) if isinstance(m, str) else m for m in models or (FLEXIBLE,)]
    return Plan(tuple(loaded), tuple(Axis.read(n, what) for n, what in axes.items()), **more)


def points_of(plan: Plan, number: int = 0) -> dict[str, np.ndarray]:
    """All points of one of the models of a plan, chunk after chunk."""
    chunks = range(number * plan.chunks_each, (number + 1) * plan.chunks_each)
    parts = [plan.at(chunk) for chunk in chunks]
    return {name: np.concatenate([part[name] for part in parts]) for name in parts[0]}


def preset_apex(preset: str) -> dict[str, float]:
    """The apex of a preset, read from its file."""
    text = (files("flexspine") / "presets" / f"{preset}.toml").read_text(encoding="utf-8")
    return dict(tomllib.loads(text)["apex"])


@pytest.mark.parametrize("chunk", [1, 4, 7, 100])
def test_a_grid_is_the_product_of_its_axes_and_the_last_changes_fastest(chunk: int) -> None:
    axes = {
        "spine.stiffness": [260.0, 200.0, 230.0],
        "height": {"low": 0.3, "high": 0.34, "steps": 5},
        "touchdown.fore": [0.46, 0.47],
    }
    found = points_of(plan_of(axes, chunk=chunk))
    lines = [[260, 200, 230], [0.3, 0.31, 0.32, 0.33, 0.34], [0.46, 0.47]]
    expected = list(itertools.product(*lines))
    assert len(expected) == 30
    assert list(found) == list(axes)
    assert np.column_stack(list(found.values())) == pytest.approx(np.array(expected), abs=1e-15)


@given(sizes=st.lists(st.integers(1, 6), min_size=1, max_size=4), chunk=st.integers(1, 50))
@settings(max_examples=40)
def test_every_grid_is_a_product_whatever_its_chunks(sizes: list[int], chunk: int) -> None:
    names = ("height", "speed", "gravity", "spine.stiffness")
    lines = [[float(3 * place + k + 1) for k in range(n)] for place, n in enumerate(sizes)]
    plan = plan_of(dict(zip(names, lines, strict=False)), chunk=chunk)
    found = np.column_stack(list(points_of(plan).values()))
    assert found.tolist() == [list(point) for point in itertools.product(*lines)]
    assert plan.points == len(found)
    assert plan.chunks == -(-len(found) // chunk)


def test_both_ends_of_a_range_are_on_its_grid() -> None:
    found = points_of(plan_of({"height": {"low": 0.1, "high": 0.7, "steps": 7}}))["height"]
    assert (found[0], found[-1]) == (0.1, 0.7)
    assert np.diff(found) == pytest.approx(np.full(6, 0.1), abs=1e-15)


@pytest.mark.parametrize("method", ["random", "sobol"])
@pytest.mark.parametrize("chunk", [1, 7, 64, 99])
def test_sampled_points_do_not_depend_on_the_size_or_the_order_of_chunks(
    method: str, chunk: int
) -> None:
    axes = {"height": {"around": 0.1}, "speed": {"within": 1}, "spine.stiffness": [200, 240, 260]}
    sample: dict[str, Any] = {"method": method, "samples": 100, "seed": 3}
    whole = points_of(plan_of(axes, FLEXIBLE, SCOUT, chunk=100, **sample), 1)
    plan = plan_of(axes, FLEXIBLE, SCOUT, chunk=chunk, **sample)
    firsts = range(0, 100, chunk)
    for part in reversed(range(plan.chunks_each)):
        model, first, count = plan.of_chunk(plan.chunks_each + part)
        assert (model.name, first, count) == (SCOUT, firsts[part], min(chunk, 100 - first))
        for name, column in plan.at(plan.chunks_each + part).items():
            assert column.tolist() == whole[name][first : first + count].tolist()


@pytest.mark.parametrize("method", ["random", "sobol"])
@given(samples=st.integers(1, 300), more=st.integers(0, 300), seed=st.integers(0, 2**63 - 1))
@settings(max_examples=20)
def test_a_larger_sample_begins_with_the_smaller_one(
    method: str, samples: int, more: int, seed: int
) -> None:
    axes = {"height": UNIT, "speed": UNIT}
    few = points_of(plan_of(axes, method=method, samples=samples, seed=seed, chunk=50))
    many = points_of(plan_of(axes, method=method, samples=samples + more, seed=seed, chunk=77))
    for name in axes:
        assert few[name].tolist() == many[name][:samples].tolist()


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_a_seed_repeats_its_sample_and_another_draws_another(method: str) -> None:
    def drawn(seed: int, number: int = 0) -> list[float]:
        plan = plan_of({"height": UNIT}, FLEXIBLE, SCOUT, method=method, samples=32, seed=seed)
        return points_of(plan, number)["height"].tolist()

    assert drawn(5) == drawn(5)
    different = [drawn(seed, number) for seed in (0, 1, 2**63 - 1) for number in (0, 1)]
    assert len({value for column in different for value in column}) == 6 * 32


def test_random_points_are_even_and_axes_are_independent() -> None:
    count = 4000
    axes = {"height": UNIT, "speed": UNIT, "fore_pitch": UNIT}
    found = points_of(plan_of(axes, method="random", samples=count, chunk=999))
    for column in found.values():
        gaps = np.sort(column) - (np.arange(count) + 0.5) / count
        # Kolmogorov and Smirnov: 1.95 / sqrt(n) is exceeded by one sample in a thousand.
        assert np.max(np.abs(gaps)) < 1.95 / count**0.5
    related = np.corrcoef(list(found.values())) - np.eye(3)
    assert np.max(np.abs(related)) < 4 / count**0.5


def test_sobol_points_fill_every_elementary_box_once() -> None:
    """2^6 points of the first two Sobol dimensions are a net without a defect, scrambled or not."""
    found = points_of(plan_of({"height": UNIT, "speed": UNIT}, method="sobol", samples=64, chunk=9))
    for digits in range(7):
        across = np.floor(found["height"] * 2**digits)
        along = np.floor(found["speed"] * 2 ** (6 - digits))
        assert len(set(zip(across.tolist(), along.tolist(), strict=True))) == 64


def test_sobol_points_have_a_low_discrepancy() -> None:
    axes = dict.fromkeys(("height", "speed", "fore_pitch", "hind_pitch"), UNIT)

    def discrepancy(method: str) -> float:
        found = points_of(plan_of(axes, method=method, samples=512, chunk=100))
        return float(qmc.discrepancy(np.column_stack(list(found.values()))))

    assert discrepancy("sobol") < discrepancy("random") / 10


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_ranges_about_a_model_are_about_its_own_value(method: str) -> None:
    """Also where that is negative; ``within`` is an amount, ``around`` a share of it."""
    axes = {"fore_pitch_rate": {"around": 0.1}, "speed": {"within": 0.25}}
    found = points_of(plan_of(axes, method=method, samples=400))
    own = preset_apex(FLEXIBLE)
    assert own["fore_pitch_rate"] < 0
    for name, room in (("fore_pitch_rate", 0.1 * -own["fore_pitch_rate"]), ("speed", 0.25)):
        away = found[name] - own[name]
        assert np.max(np.abs(away)) <= room * (1 + 1e-12)
        assert np.max(away) > 0.95 * room
        assert np.min(away) < -0.95 * room


def test_a_grid_about_a_model_has_its_own_value_in_the_middle() -> None:
    axes = {"speed": {"around": 0.02, "steps": 3}, "fore_pitch": {"within": 0.1, "steps": 3}}
    found = points_of(plan_of(axes))
    own = preset_apex(FLEXIBLE)
    speeds = np.array([0.98, 1, 1.02]) * own["speed"]
    assert found["speed"][::3] == pytest.approx(speeds, rel=1e-15)
    assert found["fore_pitch"][:3] == pytest.approx(own["fore_pitch"] + np.array([-0.1, 0, 0.1]))


def test_every_model_has_its_own_range() -> None:
    plan = plan_of({"height": {"around": 0.5, "steps": 2}}, FLEXIBLE, SCOUT)
    for number, preset in enumerate((FLEXIBLE, SCOUT)):
        own = preset_apex(preset)["height"]
        assert points_of(plan, number)["height"] == pytest.approx([0.5 * own, 1.5 * own])


def test_the_energy_and_the_speed_of_a_gait_are_its_own_values_too() -> None:
    """290 J and 4.5 m/s, as the preset says."""
    axes = {"energy": {"around": 0.1, "steps": 3}, "mean_speed": {"within": 0.2, "steps": 2}}
    found = points_of(plan_of(axes, task="searches"))
    assert found["energy"][::2] == pytest.approx([261, 290, 319], rel=1e-11)
    assert found["mean_speed"][:2] == pytest.approx([4.3, 4.7], rel=1e-11)


@pytest.mark.parametrize("method", ["random", "sobol"])
def test_listed_values_are_drawn_evenly_and_no_others(method: str) -> None:
    values = [260.0, 200.0, 240.0, 230.0]
    plan = plan_of({"spine.stiffness": values}, method=method, samples=1024)
    drawn, counts = np.unique(points_of(plan)["spine.stiffness"], return_counts=True)
    assert drawn.tolist() == sorted(values)
    # Four standard deviations; a Sobol sequence is exact.
    assert np.max(np.abs(counts - 256)) <= (0 if method == "sobol" else 4 * (192**0.5))


@pytest.mark.parametrize("method", ["grid", "random", "sobol"])
def test_a_speed_that_keeps_the_energy_makes_up_for_what_varies(method: str) -> None:
    """Of a rigid body: m v^2 / 2 + m g h + I w^2 / 2, and at rest where there is too much."""
    steps = {"steps": 4} if method == "grid" else {}
    axes = {
        "speed": {"keeps": "energy"},
        "height": {"low": 0.1, "high": 2.0, **steps},
        "pitch_rate": {"within": 3, **steps},
        "body.mass": [20.865, 30.0],
    }
    more = {} if method == "grid" else {"samples": 32}
    found = points_of(plan_of(axes, SCOUT, method=method, chunk=5, **more))
    assert list(found) == list(axes)
    assert len(found["speed"]) == 32
    own, inertia = preset_apex(SCOUT), 1.3
    energy = 20.865 * (own["speed"] ** 2 / 2 + 9.81 * own["height"])
    energy += inertia * own["pitch_rate"] ** 2 / 2
    mass, rate = found["body.mass"], found["pitch_rate"]
    left = energy - mass * 9.81 * found["height"] - inertia * rate**2 / 2
    assert 0 < np.count_nonzero(left < 0) < 32
    expected = np.sqrt(np.maximum(2 * left / mass, 0))
    assert found["speed"] == pytest.approx(expected, rel=1e-13)


@given(
    low=st.floats(-1e6, 1e6),
    width=st.floats(0, 1e6),
    share=st.lists(st.floats(0, 1, exclude_max=True), min_size=1),
)
def test_no_point_leaves_its_range(low: float, width: float, share: list[float]) -> None:
    axis = Axis.read("height", {"low": low, "high": low + width})
    found = axis.sample(float("nan"), np.array(share))
    # Rounding of the width and of the sum.
    slack = 4 * np.spacing(max(abs(low), abs(low + width)))
    assert np.all((found >= low - slack) & (found <= low + width + slack))


@pytest.mark.parametrize(
    "content",
    [
        [1.0, 2.0],
        {"low": -1.0, "high": 2.0},
        {"low": 1.0, "high": 1.0, "steps": 4},
        {"around": 0.1, "steps": 3},
        {"within": 0.0},
    ],
)
def test_an_axis_is_written_down_as_a_file_says_it(content: Any) -> None:
    axis = Axis.read("height", content)
    assert axis.record() == content
    assert Axis.read("height", axis.record()) == axis


def test_whole_numbers_are_numbers() -> None:
    assert Axis.read("height", [1, 2]) == Axis.read("height", [1.0, 2.0])
    assert Axis.read("height", {"low": 0, "high": 2}).record() == {"low": 0.0, "high": 2.0}


def test_a_range_has_to_go_upwards() -> None:
    with pytest.raises(InputError, match=r"'height' goes from 2 down to 1; swap them"):
        Axis.read("height", {"low": 2, "high": 1})
    with pytest.raises(InputError, match="height"):
        Axis.read("height", {"around": -0.1})
