"""What steered animals survive: disturbances, statistics, limits, distances."""

from __future__ import annotations

import pickle
from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from scipy.stats import binomtest

from flexspine import examine, load_model
from flexspine.control.disturbance import DISTURBANCES, Draw, Fate, draw, endure
from flexspine.control.stabilize import ANGLES, Stabilizer, stabilize
from flexspine.control.steering import Fixed
from flexspine.errors import InputError, OutputError, ParameterError, UnknownNameError
from flexspine.studies import limits as limits_module
from flexspine.studies import robustness
from flexspine.studies.limits import LIMITS, PRECISION, FeedbackDesign, Limit, find_limits, largest
from flexspine.studies.robustness import Endurance, survive, wilson
from flexspine.studies.wayfaring import Terrain, Wayfaring, distance_to_fall, walk_over

THRUST = (*ANGLES, "legs.extension")


@cache
def steered() -> Stabilizer:
    return stabilize(examine(load_model("kamimura2015-flexible")), THRUST, twice=True)


def test_a_push_changes_the_speed_by_impulse_over_mass() -> None:
    gait = steered().gait
    pushed = DISTURBANCES["push"].make(gait, Draw(5.2, 0.3, 0), 5).model
    assert pushed.apex["speed"] - gait.model.apex["speed"] == pytest.approx(5.2 / 20.8)
    assert {**pushed.apex, "speed": 0} == {**gait.model.apex, "speed": 0}


def test_steps_stand_where_they_are_drawn() -> None:
    upset = DISTURBANCES["step"].make(steered().gait, Draw(-0.02, 0.25, 0), 5)
    assert upset.model.ground is not None
    face = 1 + 0.25 * steered().gait.stride_length
    assert upset.model.ground.heights([face - 1e-3, face + 1e-3]).tolist() == [0.0, -0.02]


@pytest.mark.parametrize("kind", DISTURBANCES)
def test_small_disturbances_are_survived_and_huge_ones_are_not(kind: str) -> None:
    what = DISTURBANCES[kind]
    for sign in (1, -1) if what.signed else (1,):
        small, huge = sign * what.largest / 1000, sign * 10 * what.largest
        assert endure(steered(), what, Draw(small, 0.6, 1), 20).survived
        fate = endure(steered(), what, Draw(huge, 0.6, 1), 20)
        assert not fate.survived
        assert fate.strides < 20


def test_draws_fill_the_range_and_belong_to_their_number() -> None:
    what = DISTURBANCES["push"]
    drawn = [draw(what, 4.0, 7, k) for k in range(500)]
    sizes, places = np.array([d[0] for d in drawn]), np.array([d[1] for d in drawn])
    assert np.abs(sizes).max() <= 4.0
    assert sizes.min() < -3.9 < 3.9 < sizes.max()
    assert abs(places.mean() - 0.5) < 0.05
    assert drawn[123] == draw(what, 4.0, 7, 123)
    assert drawn[123] != draw(what, 4.0, 8, 123)
    one_sided = [draw(DISTURBANCES["rough"], 1.0, 7, k)[0] for k in range(100)]
    assert min(one_sided) >= 0.0


@pytest.mark.parametrize(("fine", "runs"), [(0, 10), (3, 10), (10, 10), (940, 1000)])
def test_the_interval_is_wilsons(fine: int, runs: int) -> None:
    expected = binomtest(fine, runs).proportion_ci(0.95, method="wilson")
    assert wilson(fine, runs) == pytest.approx((expected.low, expected.high), abs=1e-9)


def endurance(sizes: list[float], fine: str) -> Endurance:
    fates = tuple(Fate(5, 5.0, "completed" if f == "+" else "fell") for f in fine)
    return Endurance(np.array(sizes), fates)


def test_what_is_safe_and_what_is_typical() -> None:
    found = endurance([1.0, 2.0, 3.0, 4.0, 5.0, -1.0, -2.0], "+-++-++")
    assert found.safe(1) == 1.0
    assert found.typical(1) == 4.0  # one below it failed, none above it survived
    assert found.safe(-1) is None
    assert found.typical(-1) is None
    assert found.outcomes(1) == {"completed": 3, "fell": 2}
    assert endurance([1.0, 2.0], "--").safe(1) == 0.0
    assert endurance([1.0, 2.0], "--").typical(1) == 0.0
    first, second = found.bins(np.array([-2.0, 0.0, 6.0]))
    assert (first.runs, first.survived, second.runs, second.survived) == (2, 2, 5, 3)
    assert second.share == 0.6


def test_runs_repeat_whoever_does_them_and_go_on_where_they_were(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(robustness, "CHUNK", 25)
    animals = {"thrust": steered(), "angles": stabilize(steered().gait, ANGLES)}
    asked = {"largest": 8.0, "runs": 30, "strides": 6, "seed": 3}
    one = survive(animals, "push", **asked)  # type: ignore[arg-type]
    # A single piece, for which one process is started.
    few = {**asked, "runs": 25, "processes": 2}
    other = survive({"thrust": steered()}, "push", **few)  # type: ignore[arg-type]
    assert other.animals["thrust"].fates == one.animals["thrust"].fates[:25]
    assert {fate.survived for fate in other.animals["thrust"].fates} == {True, False}
    store = tmp_path / "push.jsonl"

    def stop(done: int, whole: int) -> None:
        assert whole == 60
        if done >= 30:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        survive(animals, "push", store=store, progress=stop, **asked)  # type: ignore[arg-type]
    seen: list[int] = []
    again = survive(
        animals, "push", store=store, progress=lambda done, _: seen.append(done), **asked
    )  # type: ignore[arg-type]
    assert seen[0] >= 30
    assert again.animals["angles"].fates == one.animals["angles"].fates
    assert again.animals["thrust"].fates == one.animals["thrust"].fates
    assert np.array_equal(one.animals["thrust"].sizes, one.animals["angles"].sizes)
    k = 17
    expected = endure(steered(), DISTURBANCES["push"], draw(DISTURBANCES["push"], 8.0, 3, k), 6)
    assert one.animals["thrust"].fates[k] == expected
    with pytest.raises(OutputError, match="other settings"):
        survive(animals, "push", store=store, **{**asked, "seed": 4})  # type: ignore[arg-type]
    turned = dict(reversed(animals.items()))
    with pytest.raises(OutputError, match="other settings"):
        survive(turned, "push", store=store, **asked)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("kind", "changes"),
    [
        ("shove", {}),
        ("push", {"largest": 0.0}),
        ("push", {"largest": float("nan")}),
        ("push", {"seed": -1}),
        ("push", {"runs": 0}),
        ("push", {"runs": 10**11}),
        ("step", {"largest": 5000.0}),
        ("sensing", {"largest": 1e308}),
        ("push", {"strides": 0}),
        ("push", {"processes": 0}),
    ],
)
def test_what_cannot_be_asked_for_is_refused(kind: str, changes: dict[str, float]) -> None:
    with pytest.raises(InputError):
        survive({"one": steered()}, kind, **changes)  # type: ignore[arg-type]


def test_feedback_goes_to_another_process_whole() -> None:
    other = pickle.loads(pickle.dumps(steered()))
    assert other.settings == steered().settings
    assert other.gait.residual == steered().gait.residual
    assert other.gait.model == steered().gait.model


@pytest.mark.parametrize("threshold", [0.0123, 3.3e-5, 0.0006, 0.2, 1.0])
def test_limits_are_found_from_the_safe_side(
    monkeypatch: pytest.MonkeyPatch, threshold: float
) -> None:
    def fake(_stabilizer: object, _kind: object, drawn: Draw, strides: int) -> Fate:
        fine = drawn.size <= threshold * (1 + drawn.seed)
        return Fate(strides if fine else 0, 0.0, "completed" if fine else "fell")

    monkeypatch.setattr(limits_module, "endure", fake)
    limit = Limit("acting_noise", "acting", 1, 10, ((0.0, 0), (0.0, 1)))
    found = largest(steered(), limit)
    top = DISTURBANCES["acting"].largest * limits_module.LARGEST
    if threshold > top:
        assert found >= top
    else:
        assert threshold / (1 + PRECISION) <= found <= threshold


def test_limits_of_nothing_survived_are_zero(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(limits_module, "endure", lambda *_: Fate(0, 0.0, "fell"))
    assert largest(steered(), LIMITS[0]) == 0.0


def test_limits_over_stiffness_and_speed(tmp_path: Path) -> None:
    """The step down at the limit is survived, one above is not; where no gait is, it is told."""
    limit = Limit("push_forward", "push", 1, 10, ((0.0, 0),))
    designs = [
        FeedbackDesign("thrust", THRUST, True),
        FeedbackDesign("nothing", ("spine.stiffness_shift.both",), False),
    ]
    seen: list[int] = []
    cells = find_limits(
        load_model("kamimura2015-flexible"), [260.0], [4.5, 3.0], designs=designs, limits=[limit],
        store=tmp_path / "limits.jsonl", progress=lambda done, _: seen.append(done),
    )  # fmt: skip
    assert [(c.stiffness, c.speed, c.design) for c in cells] == [
        (260.0, 4.5, "thrust"), (260.0, 4.5, "nothing"), (260.0, 3.0, "thrust"),
        (260.0, 3.0, "nothing"),
    ]  # fmt: skip
    found = cells[0].limits["push_forward"]
    push = DISTURBANCES["push"]
    assert endure(steered(), push, Draw(0.999 * found, 0.0, 0), 10).survived
    assert not endure(steered(), push, Draw(1.001 * (1 + PRECISION) * found, 0.0, 0), 10).survived
    assert cells[0].radius == pytest.approx(1.3278, abs=1e-4)
    assert cells[0].steered_radius is not None
    assert cells[0].steered_radius < 1
    assert "no feedback" in str(cells[1].reason)
    assert "second touchdown" in str(cells[2].reason)
    assert cells[2].limits == {}
    again = find_limits(
        load_model("kamimura2015-flexible"), [260.0], [4.5, 3.0], designs=designs, limits=[limit],
        store=tmp_path / "limits.jsonl", progress=lambda done, _: seen.append(done),
    )  # fmt: skip
    assert again == cells
    assert seen == [0, 1, 2, 3, 4, 4]


def test_limits_of_nothing_are_refused() -> None:
    with pytest.raises(ParameterError):
        find_limits(load_model("kamimura2015-flexible"), [], [4.5])


def test_distances_to_the_first_fall() -> None:
    fates = tuple(Fate(9, d, how) for d, how in ((3.0, "fell"), (9.0, "completed"), (1.0, "fell")))
    found = Wayfaring(Terrain("rough", {}), 9, 0, (*fates, Fate(9, 9.5, "completed")))
    assert found.arrived == 2
    assert found.outcomes == {"completed": 2, "fell": 2}
    assert found.quantile(0.25) == 1.0
    assert found.quantile(0.5) == 3.0
    assert found.quantile(0.51) is None
    # Of two that are left after 9 m one ends at 9.5 m: half of the half that is left.
    late = Wayfaring(found.terrain, 9, 0, (*fates, Fate(9, 9.5, "fell")))
    distances, going = late.going()
    assert distances.tolist() == [1.0, 3.0, 9.0, 9.5]
    assert going == pytest.approx([0.75, 0.5, 0.5, 0.0])
    assert found.metres_per_fall() == (3 + 9 + 1 + 9.5) / 2
    assert Wayfaring(found.terrain, 9, 0, fates[1:2]).metres_per_fall() is None


def test_rougher_ground_is_worse_and_feedback_better() -> None:
    gait = steered().gait

    def arrived(height: float, steering: Stabilizer | Fixed) -> int:
        return distance_to_fall(
            gait.model, steering, Terrain("rough", {"height": height}),
            stride=gait.stride_length, strides=15, runs=8, processes=1,
        ).arrived  # fmt: skip

    passive = Fixed(THRUST, steered().usual)
    assert arrived(0.003, steered()) == 8
    assert arrived(0.003, passive) < 8
    assert arrived(0.02, steered()) < 8


def test_many_runs_are_single_runs_and_seeds_decide() -> None:
    gait, terrain = steered().gait, Terrain("waves", {"amplitude": 0.01})
    many = distance_to_fall(
        gait.model, steered(), terrain, stride=gait.stride_length, strides=8, runs=3, seed=5
    )
    for number, fate in enumerate(many.fates):
        run = walk_over(
            gait.model, steered(), terrain, stride=gait.stride_length, strides=8, seed=5 + number
        )
        assert Fate.of(run) == fate
    assert len({fate.distance for fate in many.fates}) == 3


@pytest.mark.parametrize(
    ("terrain", "error"),
    [
        (Terrain("hills", {}), UnknownNameError),
        (Terrain("step", {"heigth": 0.1}), UnknownNameError),
        (Terrain("step", {"height": float("inf")}), ParameterError),
        (Terrain("none.csv", {}), InputError),
        (Terrain("none.csv", {"height": 1.0}), ParameterError),
    ],
)
def test_what_is_no_terrain_is_refused(terrain: Terrain, error: type[Exception]) -> None:
    with pytest.raises(error):
        terrain.ground(0, 1.0, 10)


def test_a_file_is_run_over_once(tmp_path: Path) -> None:
    (tmp_path / "track.csv").write_text("1,0\n1,-0.01\n")
    gait, track = steered().gait, Terrain(str(tmp_path / "track.csv"), {})
    asked = {"stride": gait.stride_length, "strides": 3}
    one = distance_to_fall(gait.model, steered(), track, runs=1, **asked)  # type: ignore[arg-type]
    assert one.arrived == 1
    with pytest.raises(ParameterError, match="the same in all 2 runs"):
        distance_to_fall(gait.model, steered(), track, runs=2, **asked)  # type: ignore[arg-type]


def test_where_the_ground_begins_and_how_high_it_is_have_nothing_to_do_with_each_other() -> None:
    drawn = [Terrain("rough", {}).ground(seed, 1.2, 5).points for seed in range(200)]
    begins, heights = ([points[k][k] for points in drawn] for k in (0, 1))
    assert abs(np.corrcoef(begins, heights)[0, 1]) < 0.2


def everywhere(make: Callable[[int], float]) -> set[float]:
    return {make(seed) for seed in range(20)}


def test_the_seed_draws_where_the_ground_begins() -> None:
    begins = everywhere(lambda seed: Terrain("step", {}).ground(seed, 1.2, 5).points[0][0])
    assert len(begins) == 20
    assert 1.0 <= min(begins) < max(begins) <= 2.2


def test_what_cannot_be_disturbed_is_refused() -> None:
    with pytest.raises(ParameterError, match="no animal"):
        survive({}, "push")
    with pytest.raises(ParameterError, match="stride = -1"):
        distance_to_fall(steered().gait.model, steered(), Terrain("rough", {}), stride=-1.0)
    with pytest.raises(ParameterError, match="'rough' is no ground"):
        steered().gait.model.on("rough")  # type: ignore[arg-type]
