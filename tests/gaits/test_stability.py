"""Floquet multipliers against other programs, tables, energy conservation and units."""

from __future__ import annotations

from functools import lru_cache
from math import radians

import numpy as np
import pytest
from hypothesis import assume, given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from flexspine import (
    Model,
    examine,
    find_gaits,
    floquet_multipliers,
    load_model,
    stride_map,
)
from flexspine.errors import ParameterError
from flexspine.gaits.return_map import linearize
from flexspine.hybrid.functions import section_quantities
from flexspine.hybrid.integrate import integrate
from flexspine.models.actuation import STRIDE_PHASES
from flexspine.models.simulation import DEFAULT_TOLERANCE
from flexspine.parameters import values
from tests import second_implementation as reference
from tests.conftest import reference_rows
from tests.gaits.test_return_map import Make, difference, there
from tests.models.test_reference_tables import SLIP
from tests.models.test_second_implementation import flexible, rigid

SCOUT = [[float(cell) for cell in row] for row in reference_rows("scout2.csv")]

# The published setting, written down anew from its table.
HALF = reference.Half(10.4, 0.36, 0.138, 0.138, 6340.0, 0.0, 0.36)
LEG = (6340.0, 0.0, 0.36)
BODIES: dict[str, reference.Flexible | reference.Rigid] = {
    "kamimura2015-flexible": reference.Flexible(HALF, HALF, 260.0, 0.0, 0.0, 9.81),
    "kamimura2015-rigid": reference.Rigid(20.9, 2.88, 0.276, 0.276, LEG, LEG, 9.81),
    "kamimura2015-locked": reference.Rigid(
        20.8, 2 * (0.36 + 10.4 * 0.138**2), 0.276, 0.276, LEG, LEG, 9.81
    ),
}

# Per unit of a multiplier's condition number. Differences of strides are good to 1e-9.
AGREEMENT = 1e-8

Matrix = NDArray[np.float64]
Numbers = NDArray[np.complex128]


def distances(found: Numbers, expected: Numbers) -> NDArray[np.float64]:
    """How far each expected number is from the found one that is left and nearest to it."""
    left = list(found)
    gaps = []
    for number in expected:
        nearest = min(left, key=lambda other: abs(other - number))
        left.remove(nearest)
        gaps.append(abs(nearest - number))
    return np.array(gaps)


@lru_cache
def jacobian_of_the_second_implementation(name: str) -> Matrix:
    model = load_model(name)
    return reference.stride_jacobian(BODIES[name], dict(model.apex), dict(model.touchdown))


@pytest.mark.parametrize("name", BODIES)
def test_multipliers_by_saltation_are_those_of_the_second_implementation(name: str) -> None:
    model = load_model(name)
    stability = floquet_multipliers(examine(model))
    theirs = jacobian_of_the_second_implementation(name)
    gaps = distances(np.linalg.eigvals(theirs).astype(complex), stability.multipliers)
    assert (gaps <= AGREEMENT * stability.condition_numbers).all()


@pytest.mark.parametrize("name", BODIES)
def test_multipliers_by_saltation_are_those_of_differences_of_plain_strides(name: str) -> None:
    model = load_model(name)
    stability = floquet_multipliers(examine(model))
    system = model.system
    rows = [system.states.index(symbol) for symbol in system.section.coordinates.values()]
    columns = [difference(model, coordinate)[rows] for coordinate in model.apex]
    by_difference = np.linalg.eigvals(np.column_stack(columns)).astype(complex)
    gaps = distances(by_difference, stability.multipliers)
    assert (gaps <= AGREEMENT * stability.condition_numbers).all()


def test_the_flexible_gait_is_unstable_as_published_and_the_locked_one_stable() -> None:
    unstable = floquet_multipliers(examine(load_model("kamimura2015-flexible")))
    assert unstable.spectral_radius == pytest.approx(1.33, abs=5e-3)
    assert unstable.level_spectral_radius == pytest.approx(unstable.spectral_radius, rel=1e-10)
    assert not unstable.stable
    stable = floquet_multipliers(examine(load_model("kamimura2015-locked")))
    assert stable.stable
    assert stable.level_spectral_radius < 0.99


@pytest.mark.parametrize("row", SCOUT, ids=lambda row: f"{row[0]:g}mps-{row[1]:g}")
def test_scout2_gaits_have_the_angles_and_multipliers_of_the_table(row: list[float]) -> None:
    speed, rate, hind, fore, period, magnitude = row
    fixed = {"height": 0.35, "speed": speed, "pitch_rate": radians(rate)}
    found = find_gaits(load_model("scout2"), fixed, starts=10)
    (gait,) = [gait for gait in found if abs(gait.model.apex["pitch"]) < 1e-9]
    # To the last digit that the table gives.
    assert np.degrees(gait.model.touchdown["hind"]) == pytest.approx(hind, abs=5.1e-5)
    assert np.degrees(gait.model.touchdown["fore"]) == pytest.approx(fore, abs=5.1e-5)
    assert gait.period == pytest.approx(period, abs=5.1e-6)
    stability = floquet_multipliers(gait)
    assert stability.level_spectral_radius == pytest.approx(magnitude, abs=1e-3)
    assert stability.stable == (magnitude < 1)


def test_the_slow_scout2_gait_has_the_four_multipliers_of_the_table() -> None:
    fixed = {"height": 0.324, "speed": 1.39, "pitch_rate": radians(145.9)}
    (gait,) = find_gaits(load_model("scout2", {"gravity": 9.8}), fixed, starts=10)
    assert np.degrees(gait.model.touchdown["hind"]) == pytest.approx(15.98375, abs=5.1e-6)
    assert np.degrees(gait.model.touchdown["fore"]) == pytest.approx(13.96764, abs=5.1e-6)
    sizes = np.abs(floquet_multipliers(gait).multipliers)
    assert sizes == pytest.approx([1.6447, 1.0432, 1.0432, 1], abs=5.1e-5)


def spring_mass(mass: float, stiffness: float, length: float, gravity: float) -> Model:
    """A level rigid body with equal legs, which is the spring-mass runner."""
    legs = {
        f"{side}.leg.{name}": value
        for side in ("fore", "hind")
        for name, value in (("stiffness", stiffness / 2), ("rest_length", length))
    }
    return load_model("slip", {"body.mass": mass, "gravity": gravity, **legs})


@pytest.mark.parametrize("row", SLIP, ids=lambda row: f"{row[0]:g}kg")
def test_pronking_has_the_multiplier_of_the_spring_mass_runner(row: list[float]) -> None:
    mass, stiffness, length, gravity, angle, speed, height, multiplier = row
    model = spring_mass(mass, stiffness, length, gravity).with_values(
        apex={"speed": speed, "height": height}, touchdown={"fore": angle, "hind": angle}
    )
    stability = floquet_multipliers(examine(model))
    assert distances(stability.multipliers, np.array([multiplier, 1], complex)).max() < 5.1e-9


@pytest.mark.parametrize(
    ("height", "slope"), [(0.940267144380, -0.161308), (1.337686381370, 1.686968)]
)
def test_running_has_the_slope_of_the_spring_mass_return_map(height: float, slope: float) -> None:
    """The running set of the table: 80 kg, 20 kN/m, 22 deg, energy of 5 m/s at 1 m."""
    angle, speed = radians(22), (25 + 2 * 9.81 * (1 - height)) ** 0.5
    model = spring_mass(80.0, 20_000.0, 1.0, 9.81).with_values(
        apex={"speed": speed, "height": height}, touchdown={"fore": angle, "hind": angle}
    )
    stability = floquet_multipliers(examine(model))
    assert distances(stability.level_multipliers, np.array([slope], complex)).max() < 1e-6


def test_a_pronk_does_not_mix_bouncing_with_pitching() -> None:
    """By symmetry, height and speed do not turn a level body, nor does pitch lift it."""
    stability = floquet_multipliers(examine(load_model("slip")))
    for index, multiplier in enumerate(stability.multipliers):
        shares = stability.shares(index)
        pitching = shares["pitch"] + shares["pitch_rate"]
        bounces = min(abs(multiplier - 4.18074089), abs(multiplier - 1)) < 1e-6
        assert pitching == pytest.approx(0 if bounces else 1, abs=1e-12)


@settings(max_examples=60)
@given(seed=st.integers(0, 2**32 - 1), two_segments=st.booleans())
def test_no_conservative_stride_changes_its_energy_to_first_order(
    seed: int, two_segments: bool
) -> None:
    """grad E at the end, times the derivative of the stride, is grad E at the start.

    By coordinates, by touchdown angles, which do no work, and by every parameter.
    """
    model, _ = (flexible if two_segments else rigid)(np.random.default_rng(seed), False)
    run = integrate(model.bind(DEFAULT_TOLERANCE), model.apex_state(), crossings=1)
    assume(run.outcome.completed)
    system = model.system
    rows = [system.states.index(symbol) for symbol in system.section.coordinates.values()]
    stride = linearize(run, system.parameters)
    energy = section_quantities(system)
    before, after = (energy(p.states, p.held, model.parameter_vector) for p in (run.start, run.end))
    by_state = after.by_states[0] @ stride.states[:, : len(rows)]
    gradient = before.by_states[0, rows]
    assert np.linalg.norm(by_state - gradient) <= 1e-9 * np.linalg.norm(gradient)
    by_parameters = after.by_states[0] @ stride.states[:, len(rows) :] + after.by_parameters[0]
    off = (by_parameters - before.by_parameters[0]) * model.parameter_vector
    assert np.abs(off).max() <= 1e-9 * before.values[0]


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("make", [flexible, rigid])
def test_the_energy_at_the_apex_and_its_gradient_are_those_of_the_second_implementation(
    make: Make, seed: int
) -> None:
    """What the test above conserves is the energy."""
    model, body = make(np.random.default_rng(seed), False)
    linkage, start = reference.Linkage(body), model.apex_state()
    energy = section_quantities(model.system)(start.states, start.held, model.parameter_vector)

    def theirs(name: str, step: float) -> float:
        apex = dict(model.apex)
        return linkage.energy(linkage.pack(apex | {name: apex[name] + step}))

    assert energy.values[0] == pytest.approx(theirs("height", 0.0), rel=1e-13)
    for name, symbol in model.system.section.coordinates.items():
        slope = (theirs(name, 1e-4) - theirs(name, -1e-4)) / 2e-4
        found = energy.by_states[0, model.system.states.index(symbol)]
        assert found == pytest.approx(slope, rel=1e-7, abs=1e-6), name


def test_conserved_energy_makes_one_multiplier_of_every_preset_one(preset: Model) -> None:
    stability = floquet_multipliers(examine(preset))
    assert stability.energy_identity is not None
    assert stability.energy_identity < 1e-11
    gaps = np.abs(stability.multipliers - 1) / stability.condition_numbers
    assert gaps.min() < 1e-11
    without = np.delete(stability.multipliers, int(gaps.argmin()))
    assert distances(stability.level_multipliers, without).max() < 1e-9


@pytest.mark.parametrize("name", ["kamimura2015-flexible", "kamimura2015-rigid"])
def test_a_stride_that_loses_energy_has_no_multiplier_one(name: str) -> None:
    dampers = {"fore.leg.damping": 20.0, "hind.leg.damping": 20.0}
    if name.endswith("flexible"):
        dampers["spine.damping"] = 1.0
    model = load_model(name, dampers)
    # By parameters as well: code that other tests compile.
    stride = stride_map(model, parameters=there(model, damped=True))
    assert np.abs(np.linalg.eigvals(stride.by_state) - 1).min() > 0.01


def test_what_is_no_gait_has_no_multipliers() -> None:
    stride = examine(load_model("kamimura2015-flexible", {"spine.stiffness": 100.0}))
    with pytest.raises(ParameterError, match="no gait"):
        floquet_multipliers(stride)


def test_shares_of_an_eigenvector_sum_to_one_and_name_every_coordinate(preset: Model) -> None:
    stability = floquet_multipliers(examine(preset))
    for index in range(len(stability.multipliers)):
        shares = stability.shares(index)
        assert set(shares) == set(preset.apex)
        assert sum(shares.values()) == pytest.approx(1, abs=1e-14)
        assert all(0 <= share <= 1 for share in shares.values())


@pytest.mark.parametrize("name", BODIES)
def test_each_eigenvector_is_one_of_the_second_implementation(name: str) -> None:
    """Shares come from vectors that the independent Jacobian maps to multiples of themselves."""
    model = load_model(name)
    stability = floquet_multipliers(examine(model))
    vectors = stability.vectors * stability.scales[:, None]
    theirs = jacobian_of_the_second_implementation(name)
    off = (theirs @ vectors - vectors * stability.multipliers) / stability.scales[:, None]
    assert np.abs(off).max() < AGREEMENT * np.abs(theirs).max()


def test_error_bars_hold_what_a_run_at_rounding_level_changes(preset: Model) -> None:
    usual, best = (floquet_multipliers(examine(preset, tolerance=t)) for t in (1e-12, 1e-16))
    assert usual.errors.max() < 1e-8
    gaps = distances(best.multipliers, usual.multipliers)
    assert (gaps <= usual.errors + best.errors).all()


@pytest.mark.parametrize("name", BODIES)
def test_error_bars_grow_with_the_tolerance_as_the_errors_do(name: str) -> None:
    """At the same apex, so that only the derivative is less exact."""
    model = load_model(name)
    best, loose = (floquet_multipliers(examine(model, tolerance=t)) for t in (1e-16, 1e-7))
    gaps = distances(best.multipliers, loose.multipliers)
    assert (gaps <= loose.errors + best.errors).all()


# Powers of kilogram, metre and second in each parameter, coordinate and measure.
DIMENSIONS = {
    "mass": (1, 0, 0),
    "inertia": (1, 2, 0),
    "spine_offset": (0, 1, 0),
    "hip_offset": (0, 1, 0),
    "rest_length": (0, 1, 0),
    "leg.stiffness": (1, 0, -2),
    "leg.damping": (1, 0, -1),
    "spine.stiffness": (1, 2, -2),
    "spine.damping": (1, 2, -1),
    "rest_angle": (0, 0, 0),
    "stiffening": (0, 0, 0),
    "extension": (0, 1, 0),
    "hip_lever": (0, 1, 0),
    **{f"stiffness_shift.{phase}": (0, 0, 0) for phase in STRIDE_PHASES},
    **{f"rest_shift.{phase}": (0, 0, 0) for phase in STRIDE_PHASES},
    "gravity": (0, 1, -2),
    "height": (0, 1, 0),
    "speed": (0, 1, -1),
    "pitch": (0, 0, 0),
    "pitch_rate": (0, 0, -1),
    "energy": (1, 2, -2),
    "force": (1, 1, -2),
    "period": (0, 0, 1),
}

Units = tuple[float, float, float]


def factor(name: str, units: Units) -> float:
    """What the number of a quantity is multiplied by when mass, length and time are."""
    powers = next(powers for kind, powers in DIMENSIONS.items() if name.endswith(kind))
    return float(np.prod(np.array(units) ** np.array(powers)))


@pytest.mark.parametrize("units", [(2.0, 3.0, 0.8), (0.01, 0.2, 3.0), (30.0, 5.0, 1.5)])
def test_multipliers_do_not_depend_on_units(preset: Model, units: Units) -> None:
    """The same animal in other units of mass, length and time: dimensional analysis."""
    given = values(preset.parameters)
    scaled = preset.with_values(
        {name: value * factor(name, units) for name, value in given.items()},
        apex={name: value * factor(name, units) for name, value in preset.apex.items()},
    )
    here, there = examine(preset), examine(scaled)
    assert there.phases == here.phases
    assert there.energy == pytest.approx(here.energy * factor("energy", units), rel=1e-12)
    assert there.period == pytest.approx(here.period * factor("period", units), rel=1e-11)
    for side, peak in here.peak_grf.items():
        expected = peak * factor("force", units)
        assert there.peak_grf[side] == pytest.approx(expected, rel=1e-10)
    one, other = floquet_multipliers(here), floquet_multipliers(there)
    assert (distances(other.multipliers, one.multipliers) <= 1e-11 * one.condition_numbers).all()
    assert other.condition_numbers == pytest.approx(one.condition_numbers, rel=1e-8)
    of = np.array([factor(name, units) for name in preset.apex])
    unscaled = other.jacobian * of / of[:, None]
    assert np.abs(unscaled - one.jacobian).max() < 1e-10 * np.abs(one.jacobian).max()
