"""The model of the guide: a body of three segments that flexspine does not know of."""

from __future__ import annotations

import runpy
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
import sympy as sp

from flexspine import (
    InputError,
    Model,
    ParameterError,
    UnknownNameError,
    load_model,
    plot_run,
    simulate,
    summarize,
    to_dataset,
    write_report,
)
from flexspine.models.actuation import Features
from flexspine.models.bounder import Body
from flexspine.models.files import write_netcdf
from flexspine.models.legs import Leg
from flexspine.models.model import Source
from flexspine.parameters import ParameterSet, quantity
from flexspine.report.branch_axis import axis_of

GUIDE = Path(__file__).parents[2] / "docs" / "own" / "two_joint_bounder.py"


def changed(parameters: Any, **changes: Any) -> Any:
    return parameters.model_copy(update=changes)


@pytest.fixture(scope="module")
def animal() -> Model:
    own = runpy.run_path(str(GUIDE))
    leg = Leg(stiffness=6340.0, rest_length=0.36)
    end = own["End"](mass=8.0, inertia=0.2, spine_offset=0.1, hip_offset=0.1, leg=leg)
    middle = own["Middle"](mass=4.8, inertia=0.02, spine_offset=0.076)
    spine = own["Joints"](stiffness=520.0)
    pitches = {"fore_pitch": 0.1, "middle_pitch": 0.0, "hind_pitch": -0.1}
    rates = {f"{name}_rate": -3.9 for name in pitches}
    return Model(
        name="two-joint",
        kind=own["TWO_JOINT_BOUNDER"],
        parameters=own["TwoJointParameters"](fore=end, middle=middle, hind=end, spine=spine),
        apex={"height": 0.32, "speed": 4.5, **pitches, **rates},
        touchdown={"fore": 0.46, "hind": 0.56},
        source=Source(title="three segments, two joints"),
    )


def test_a_letter_that_is_not_declared_is_named(animal: Model) -> None:
    def forgetful(features: Features) -> Body:
        body = animal.kind.body(features)
        names = {name: letter for name, letter in body.parameters.items() if name != "middle.mass"}
        return replace(body, parameters=names)

    with pytest.raises(InputError, match="use 'm_m', which is no state, no parameter"):
        simulate(replace(animal, kind=replace(animal.kind, name="forgetful", body=forgetful)))


def test_a_parameter_that_is_misspelt_is_named(animal: Model) -> None:
    def misspelt(features: Features) -> Body:
        body = animal.kind.body(features)
        return replace(body, parameters={**body.parameters, "midle.mass": sp.Symbol("m_x")})

    with pytest.raises(UnknownNameError, match=r"'midle.mass'; did you mean 'middle.mass'\?"):
        simulate(replace(animal, kind=replace(animal.kind, name="misspelt", body=misspelt)))


def test_its_energy_is_kept(animal: Model) -> None:
    run = simulate(animal)
    assert run.outcome.completed
    assert summarize(run).energy["relative_drift"] < 1e-13


def test_its_hips_are_as_far_from_each_other_as_it_is_long(animal: Model) -> None:
    straight = animal.with_values(apex=dict.fromkeys(("fore_pitch", "hind_pitch"), 0.0))
    data = to_dataset(simulate(straight, duration=1e-3))
    apart = data["fore_hip_x"].values[0] - data["hind_hip_x"].values[0]
    assert apart == pytest.approx(2 * (0.1 + 0.1 + 0.076), abs=1e-14)


def test_without_a_middle_and_with_one_joint_locked_it_is_the_flexible_bounder(
    animal: Model,
) -> None:
    """A middle segment of nearly nothing between two springs is one spring half as stiff."""
    published = load_model("kamimura2015-flexible")
    parts = animal.parameters
    end = changed(parts.fore, mass=10.4, inertia=0.36, spine_offset=0.138, hip_offset=0.138)
    tiny = changed(parts.middle, mass=1e-6, inertia=1e-8, spine_offset=0.0)
    spine = changed(parts.spine, stiffness=520.0)
    light = replace(
        animal,
        parameters=changed(parts, fore=end, hind=end, middle=tiny, spine=spine),
        apex={**published.apex, "middle_pitch": 0.0, "middle_pitch_rate": -3.89389870409466},
        touchdown=published.touchdown,
    )
    mine, theirs = simulate(light), simulate(published)
    assert mine.phases == theirs.phases
    ends = [run.trajectory.events[0].time for run in (mine, theirs)]
    assert ends[0] == pytest.approx(ends[1], abs=1e-5)


def test_its_data_and_figure_name_the_new_coordinate(animal: Model) -> None:
    data = to_dataset(simulate(animal))
    assert data["middle_pitch"].attrs == {"units": "rad", "long_name": "middle pitch"}
    assert data["middle_pitch_rate"].attrs["units"] == "rad/s"
    plot_run(data)


def test_its_results_become_a_page(animal: Model, tmp_path: Path) -> None:
    write_netcdf(to_dataset(simulate(animal)), tmp_path / "trajectory.nc")
    page = write_report(tmp_path).read_text(encoding="utf-8")
    for told in ("apex.middle_pitch", "middle pitch at the start", "apex.middle_pitch_rate"):
        assert told in page


@pytest.mark.parametrize(
    ("name", "label"),
    [
        ("middle_pitch", "middle pitch at the apex (°)"),
        ("spine.stiffness", "spine stiffness $k_t$ (N m/rad)"),
        ("middle.mass", "middle mass"),
    ],
)
def test_its_branches_are_drawn_over_what_it_has(name: str, label: str) -> None:
    assert axis_of(name, "two-joint-bounder").told == label


class Springs(ParameterSet):
    """Joints that may differ."""

    fore_stiffness: float = quantity("N m/rad", "of the joint in front", at_least=0, upper=1e9)
    hind_stiffness: float = quantity("N m/rad", "of the joint behind", at_least=0, upper=1e9)


@pytest.mark.parametrize(("hind", "alike"), [(300.0, True), (400.0, False)])
def test_ends_that_differ_by_any_name_are_no_mirror_images(
    animal: Model, hind: float, alike: bool
) -> None:
    springs = Springs(fore_stiffness=300.0, hind_stiffness=hind)
    other = replace(animal, parameters=changed(animal.parameters, spine=springs))
    assert other.alike is alike


def test_a_number_out_of_bounds_is_refused_in_one_line(animal: Model) -> None:
    with pytest.raises(ParameterError, match=r"'mass' = -1.0 is not usable") as raised:
        type(animal.parameters.middle)(mass=-1.0, inertia=0.02, spine_offset=0.1)
    assert "kg" in raised.value.remedy
    with pytest.raises(ParameterError, match="'stiffness' has no value"):
        type(animal.parameters.spine)()
