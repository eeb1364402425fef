"""Pareto fronts of gaits against brute force, simulation and their own certificates."""

from __future__ import annotations

from collections.abc import Iterable
from functools import partial
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest

from flexspine import (
    Gait,
    Model,
    Optimisation,
    examine,
    find_gaits,
    floquet_multipliers,
    load_gait,
    load_model,
    optimise,
    save_gait,
    trace_branch,
)
from flexspine.errors import OutputError, ParameterError
from flexspine.gaits.chart import Chart
from flexspine.gaits.newton import solve
from flexspine.gaits.problem import Problem
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.studies.descent import Place, Task
from flexspine.studies.design import Design
from flexspine.studies.objectives import COST, OBJECTIVES, PEAK_GRF, RADIUS
from flexspine.studies.optimise import BY_PHASE, CONSTANT, NoGaitError
from flexspine.studies.pareto import Front
from flexspine.studies.probes import CLEARANCE, Stride

SPEED = 4.25
RANGES = {
    "spine.stiffness": (300.0, 320.0),
    "spine.damping": (0.2, 0.3),
    "legs.extension": (0.0, 0.02),
}
WEIGHT = 2 * 10.4 * 9.81


@pytest.fixture(scope="module")
def published() -> Gait:
    return examine(load_model("kamimura2015-flexible"))


@pytest.fixture(scope="module")
def found(published: Gait) -> Optimisation:
    """Both fronts next to the published gait."""
    return optimise(published, SPEED, ranges=RANGES, shift=(-0.1, 0.1), draws=0, points=2)


def values(front: Front) -> list[tuple[float, float]]:
    return [(point.values[PEAK_GRF], point.values[COST]) for point in front.points]


def stepped(
    model: Model, kept: dict[str, float], name: str, values: Iterable[float]
) -> list[Model]:
    """Gaits at one value of a parameter after the other, with the thrust that they need."""
    found = []
    for value in values:
        model = model.with_values({name: float(value)})
        problem = Problem(model, kept, free=("legs.extension",), tolerance=DEFAULT_TOLERANCE)
        attempt = solve(problem, problem.point(model))
        assert attempt.solved, value
        model = problem.at(attempt.point)
        found.append(model)
    return found


def test_brute_force_finds_nothing_better(found: Optimisation) -> None:
    """Gaits on a grid of stiffness and damping, from one to the next by Newton."""
    kept = found.reference.quantities
    scanned: list[tuple[float, float]] = []
    start = found.reference.model
    for dampings in (np.linspace(0.02, 0.2, 10), np.linspace(0.21, 0.25, 5)):
        start = stepped(start, kept, "spine.damping", dampings)[-1]
        near = stepped(start, kept, "spine.stiffness", np.linspace(260, 300, 9))[-1]
        for model in stepped(near, kept, "spine.stiffness", np.linspace(300, 320, 9)):
            summary = examine(model).summary
            assert summary.cost_of_transport is not None
            scanned.append((max(summary.peak_grf.values()), summary.cost_of_transport))
    front = values(found.fronts[CONSTANT])
    for peak, cost in front:
        better = [one for one in scanned if one[0] < peak * (1 - 1e-6) and one[1] <= cost]
        better += [one for one in scanned if one[0] <= peak and one[1] < cost * (1 - 1e-6)]
        assert not better
    # The grid has the ends of the ranges, and with them the ends of the front.
    assert min(front)[0] == pytest.approx(min(scanned)[0], rel=1e-6)
    assert front[0][1] == pytest.approx(min(cost for _, cost in scanned), rel=1e-6)


def test_stability_is_traded_for_peak_force_as_a_scan_of_stiffness_has_it(published: Gait) -> None:
    """A conservative animal of which nothing but the stiffness varies: its gaits are a curve."""
    limits = (220.0, 280.0)
    found = optimise(
        published, SPEED, minimise=(PEAK_GRF, RADIUS), ranges={"spine.stiffness": limits},
        spines=(CONSTANT,), draws=0, points=3,
    )  # fmt: skip
    branch = trace_branch(found.reference, "spine.stiffness", bounds=limits, longest_step=0.02)
    scanned = [
        (max(each.gait.peak_grf.values()), each.stability.level_spectral_radius)
        for each in branch.points
    ]
    assert len(scanned) > 12
    points = found.fronts[CONSTANT].points
    assert len(points) == 3
    for point in points:
        peak, radius = point.values[PEAK_GRF], point.values[RADIUS]
        assert not [p for p, r in scanned if r <= radius and p < peak * (1 - 1e-4)]
        assert point.values[COST] == 0
    least = min(radius for _, radius in scanned)
    assert points[0].values[RADIUS] <= least
    assert points[0].values[RADIUS] == pytest.approx(least, rel=5e-3)
    assert points[-1].gait.model.numbers["spine.stiffness"] == 280
    assert found.told is None


def test_where_nothing_is_lost_the_front_is_one_gait(published: Gait) -> None:
    """Without dampers a gait costs nothing, whatever force it takes."""
    found = optimise(
        published, SPEED, ranges={"spine.stiffness": (250.0, 280.0)}, spines=(CONSTANT,), draws=0
    )
    (point,) = found.fronts[CONSTANT].points
    assert point.values[COST] == 0
    assert point.gait.model.numbers["spine.stiffness"] == 280
    assert point.values[PEAK_GRF] < max(found.reference.peak_grf.values())


def test_stiffness_by_phase_is_never_worse(found: Optimisation) -> None:
    constant, phased = found.fronts[CONSTANT], found.fronts[BY_PHASE]
    assert len(constant.points) >= 2
    for peak, cost in values(constant):
        assert min(p for p, c in values(phased) if c <= cost * (1 + 1e-6)) <= peak * (1 + 1e-6)
        assert min(c for p, c in values(phased) if p <= peak * (1 + 1e-6)) <= cost * (1 + 1e-6)


def test_no_gait_of_a_front_is_better_in_both(found: Optimisation) -> None:
    for front in found.fronts.values():
        for (peak, cost), (next_peak, next_cost) in pairwise(values(front)):
            assert next_cost > cost
            assert next_peak < peak


def test_every_gait_is_one_when_simulated_from_its_file(
    found: Optimisation, tmp_path: Path
) -> None:
    for front in found.fronts.values():
        assert front.refused == ()
        for point in front.points:
            save_gait(point.gait, tmp_path / "gait.json")
            gait = load_gait(tmp_path / "gait.json")
            assert gait.doubt is None
            assert gait.residual < 1e-11
            assert gait.mean_speed == pytest.approx(SPEED, rel=1e-11)
            assert gait.energy == pytest.approx(290, rel=1e-11)
            assert gait.model.apex["height"] == 0.32
            summary = gait.summary
            assert max(summary.peak_grf.values()) == pytest.approx(point.values[PEAK_GRF], rel=1e-9)
            radius = floquet_multipliers(gait).spectral_radius
            assert radius == pytest.approx(point.values[RADIUS], abs=1e-8)
            # What actuators give and take is what the dampers turn into heat.
            lost = gait.run.trajectory.end.states[gait.model.state_names.index("dissipated_energy")]
            assert sum(work.net for work in summary.work.values()) == pytest.approx(lost, rel=1e-9)
            given = sum(work.positive for work in summary.work.values())
            cost = given / (WEIGHT * SPEED * gait.period)
            assert point.values[COST] == pytest.approx(cost, rel=1e-9)


def test_everything_is_in_its_range(found: Optimisation) -> None:
    for spine, front in found.fronts.items():
        for point in front.points:
            for name, (low, high) in found.ranges[spine].items():
                assert low <= point.gait.model.numbers[name] <= high
    shifts = [name for name in found.ranges[BY_PHASE] if "shift" in name]
    assert len(shifts) == 4
    switched = [p for p in found.fronts[BY_PHASE].points if "spine_work" in p.gait.summary.work]
    assert switched
    for point in found.fronts[CONSTANT].points:
        assert not any(point.gait.model.numbers[name] for name in shifts)


def test_what_is_told_is_what_the_fronts_have(found: Optimisation) -> None:
    constant, phased = (values(found.fronts[spine]) for spine in (CONSTANT, BY_PHASE))
    gains = [
        1 - min(p for p, c in phased if c <= cost * (1 + 1e-6)) / peak for peak, cost in constant
    ]
    assert max(gains) > 0.01
    assert found.told is not None
    assert f"lowers the least peak GRF by up to {100 * max(gains):.1f} %" in found.told
    assert f"reaches down to {min(phased)[0]:.4g} N" in found.told


class StoppedError(Exception):
    """Somebody pulls the plug."""


def test_the_same_seed_finds_the_same_and_so_does_an_interrupted_search(
    published: Gait, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("flexspine.studies.design.SEARCHES", 8)

    def search(store: Path | None, most: int = 10**6, seed: int = 1) -> list[tuple[float, ...]]:
        count = 0

        def stop(_what: str, _share: float) -> None:
            nonlocal count
            count += 1
            if count > most:
                raise StoppedError

        done = optimise(
            published, SPEED, minimise=(PEAK_GRF, RADIUS), ranges={"spine.stiffness": (250, 280)},
            spines=(CONSTANT,), points=2, draws=1, seed=seed, store=store, progress=stop,
        )  # fmt: skip
        return [tuple(point.gait.model.numbers.values()) for point in done.fronts[CONSTANT].points]

    whole = search(None)
    store = tmp_path / "pieces.jsonl"
    with pytest.raises(StoppedError):
        search(store, most=9)
    begun = store.read_text().splitlines()
    assert len(begun) > 3
    assert search(store) == whole
    assert store.read_text().splitlines()[: len(begun)] == begun
    with pytest.raises(OutputError, match="other settings"):
        search(store, seed=2)


def test_derivatives_of_parts_are_those_of_gaits_nearby(found: Optimisation) -> None:
    """Against whole gaits, solved for and simulated anew on either side."""
    point = found.fronts[BY_PHASE].points[-1]
    design = Design(found.reference.model, found.ranges[BY_PHASE])
    problem = design.problem
    at = problem.point(point.gait.model)
    place = Place(problem, Task(PEAK_GRF, {COST: 1.0}, design.ranges), at)
    chart = Chart(problem, at, place.linear)
    step = 1e-5
    for way in range(problem.surplus):
        beside = Stride(problem, at + 1e-6 * chart.basis[:, way], place.stride.probes)
        ends = []
        for side in (step, -step):
            attempt = chart.solve(side * np.eye(problem.surplus)[way], at, chart.basis)
            summary = examine(problem.at(attempt.point)).summary
            ends.append([*summary.peak_grf.values(), sum(w.net for w in summary.work.values())])
        slopes = (np.array(ends[0]) - ends[1]) / (2 * step)
        peaks = (beside.peaks - place.stride.peaks) / 1e-6
        assert peaks == pytest.approx(slopes[:2], rel=1e-4, abs=0.05)
        scale = WEIGHT * SPEED * point.gait.period
        net = [OBJECTIVES[COST].parts(each)[:, 0].sum() * scale for each in (beside, place.stride)]
        lengths = [float(s.trajectory.end.states[0]) for s in (beside, place.stride)]
        net[0] *= lengths[0] / lengths[1]
        assert (net[0] - net[1]) / 1e-6 == pytest.approx(slopes[2], rel=1e-4, abs=0.05)


def test_margins_vanish_where_gaits_end(published: Gait) -> None:
    """The published curve ends on its slow side where the fore leg would land once more."""
    branch = trace_branch(published, bounds=(3.5, 4.5))
    assert branch.ends[0].startswith("second touchdown")
    clear = []
    for point in (branch.points[0], branch.points[len(branch.points) // 2]):
        model = point.gait.model
        quantities = point.gait.quantities
        problem = Problem(model, quantities, tolerance=DEFAULT_TOLERANCE)
        clear.append(Stride(problem, problem.point(model)).margins[0])
    assert 0 < clear[0] < 1e-5
    assert clear[1] > CLEARANCE


def test_a_speed_without_gaits_is_told(published: Gait, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("flexspine.studies.optimise.find_gaits", partial(find_gaits, starts=10))
    with pytest.raises(NoGaitError, match="no gait at 9 m/s") as failure:
        optimise(published, 9.0, ranges=RANGES, draws=0)
    assert failure.value.exit_code == 1


def test_ranges_without_gaits_are_told(published: Gait) -> None:
    """Legs cannot make good what dampers take."""
    ranges = {**RANGES, "legs.extension": (0.0, 1e-6)}
    with pytest.raises(NoGaitError, match="could be led"):
        optimise(published, SPEED, ranges=ranges, draws=0, spines=(CONSTANT,))


def test_a_front_with_nothing_to_choose_is_refused(published: Gait) -> None:
    with pytest.raises(ParameterError, match="nothing to choose"):
        optimise(published, SPEED, ranges={"spine.damping": (0.1, 0.2)}, spines=(CONSTANT,))


def test_a_summary_agrees_with_the_parts_of_objectives() -> None:
    """Those of an animal with everything, hip torques too, whose work flows."""
    changes = {
        "legs.extension": 0.01, "fore.leg.stiffening": 0.1, "legs.hip_lever": 0.02,
        "spine.stiffness_shift.hind": 0.2, "spine.rest_shift.between": 0.1,
        "spine.damping": 0.5, "fore.leg.damping": 10.0, "hind.leg.damping": 20.0,
    }  # fmt: skip
    model = load_model("kamimura2015-flexible", changes)
    summary = examine(model).summary
    problem = Problem(model, {}, tolerance=DEFAULT_TOLERANCE)
    stride = Stride(problem, problem.point(model))
    peak = max(summary.peak_grf.values())
    assert OBJECTIVES[PEAK_GRF].value(stride) == pytest.approx(peak, rel=1e-12)
    assert OBJECTIVES[COST].value(stride) == pytest.approx(summary.cost_of_transport, rel=1e-9)
