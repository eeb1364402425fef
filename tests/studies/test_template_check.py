"""Our bounder is what MuJoCo's comes to with small steps and light toes, and nothing near it."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest

from flexspine import Model, load_model
from flexspine.engines.mujoco_bounder import MujocoBounder
from flexspine.errors import ParameterError, StateError
from flexspine.models.dataset import sample
from flexspine.studies import template_check
from flexspine.studies.template_check import LEVELS, Level, TemplateCheck, check_template
from tests.engines.test_mujoco_bounder import uneven

# Just fine enough to agree, and no finer.
COARSE = [Level(2e-4 / 2**k, 5e-5 / 2**k) for k in range(3)]


@pytest.fixture(scope="module")
def check() -> TemplateCheck:
    return check_template(load_model("kamimura2015-flexible"))


def halvings(differences: list[float]) -> list[float]:
    return [coarse / fine for coarse, fine in pairwise(differences)]


def test_the_published_gait_is_mujocos_to_first_order(check: TemplateCheck) -> None:
    """Period, touchdowns and peaks are also known from elsewhere."""
    assert check.agrees
    assert [stride.level for stride in check.strides] == list(LEVELS)
    last = check.strides[-1].motion
    assert last.times[-1] == pytest.approx(0.252732108498, abs=1e-11)
    assert last.peaks == pytest.approx([530.460494, 530.460494], rel=5e-5)
    assert last.com[-1, 1] == pytest.approx(0.32, abs=2e-5), "at the next apex"
    assert last.pitches[-1] == pytest.approx([0.10385204, -0.10385204], abs=2e-4)
    place, angle = [], []
    for motion in (stride.motion for stride in check.strides):
        ours = sample(check.run, np.minimum(motion.times, check.run.trajectory.duration))
        com, pitches = motion.com.T, motion.pitches.T
        place.append(np.hypot(com[0] - ours["com_x"], com[1] - ours["com_y"]).max())
        angle.append(np.abs(pitches - [ours["fore_pitch"], ours["hind_pitch"]]).max())
    times = np.array([[contact.time for contact in s.motion.contacts] for s in check.strides])
    contact = np.abs(times - [contact.time for contact in check.contacts]).max(axis=1)
    for column, found in enumerate((place, angle, list(contact))):
        assert check.differences[:, column] == pytest.approx(found, rel=1e-12)
        assert halvings(found) == pytest.approx([2, 2, 2], rel=0.1)
    assert check.orders == pytest.approx([1, 1, 1, 1], abs=0.15)


def test_toes_too_light_for_their_step_let_the_pins_give(flexible: Model) -> None:
    """As the inverse of their mass."""
    found = check_template(flexible, [Level(1e-4, 1e-6 / 4**k) for k in range(3)])
    assert found.orders == pytest.approx([-1, -1, -1, -1], abs=0.1)


def test_uneven_halves_with_dampers_are_mujocos_too() -> None:
    found = check_template(uneven(), LEVELS[:3])
    assert found.orders == pytest.approx([1, 1, 1, 1], abs=0.15)
    assert found.agrees


def test_at_one_step_differences_fall_with_the_mass_of_the_toe(flexible: Model) -> None:
    found = check_template(flexible, [Level(5e-5, 1e-3 / 10**k) for k in range(3)])
    assert found.orders == pytest.approx([1, 1, 1, 1], abs=0.1)


def test_at_one_mass_the_motion_settles_with_the_square_of_the_step(flexible: Model) -> None:
    """Not to ours: what is left is the toe's."""
    found = check_template(flexible, [Level(2e-4 / 2**k, 2e-5) for k in range(4)])
    angle, contact = found.differences[:, 1], found.differences[:, 2]
    for settling in (angle, contact):
        assert halvings(list(-np.diff(settling))) == pytest.approx([4, 4], rel=0.2)
        assert settling[-1] >= 0.7 * settling[0]
    assert found.orders is None
    assert not found.agrees


@pytest.mark.parametrize(
    "change",
    [{"fore.mass": 10.41}, {"hind.inertia": 0.3604}, {"spine.stiffness": 260.26},
     {"hind.leg.stiffness": 6346.0}],
    ids=lambda change: next(iter(change)),
)  # fmt: skip
def test_what_is_wrong_by_a_thousandth_on_one_side_is_found(
    change: dict[str, float], flexible: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        template_check,
        "MujocoBounder",
        lambda model, *level: MujocoBounder(model.with_values(change), *level),
    )
    found = check_template(flexible, COARSE)
    assert not found.agrees
    assert found.orders is not None


def test_a_leg_that_never_lands_on_one_side_is_found(
    flexible: Model, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        template_check,
        "MujocoBounder",
        lambda model, *level: MujocoBounder(model.with_values(touchdown={"hind": 1.2}), *level),
    )
    found = check_template(flexible, [Level(4e-4 / 2**k, 1e-4 / 2**k) for k in range(3)])
    assert np.isinf(found.differences[:, 2]).all()
    assert found.orders is None
    assert not found.agrees


def test_progress_is_told_level_by_level(flexible: Model) -> None:
    told: list[str] = []
    assert check_template(flexible, COARSE, progress=told.append).agrees
    assert told == [
        "exact",
        "step 0.2 ms, toes 5e-05 of the body",
        "step 0.1 ms, toes 2.5e-05 of the body",
        "step 0.05 ms, toes 1.25e-05 of the body",
    ]


@pytest.mark.parametrize(
    "levels",
    [[], LEVELS[:2], LEVELS[::-1], [LEVELS[0]] * 3,
     [Level(1e-4, 1e-5), Level(5e-5, 2e-5), Level(2e-5, 1e-5)]],
)  # fmt: skip
def test_levels_that_do_not_get_finer_are_refused(levels: list[Level], flexible: Model) -> None:
    with pytest.raises(ParameterError, match="give 3 pairs or more"):
        check_template(flexible, levels)


def test_other_models_and_starts_are_refused(flexible: Model) -> None:
    with pytest.raises(ParameterError, match="flexible ones only"):
        check_template(load_model("slip"))
    with pytest.raises(StateError, match="makes no stride"):
        check_template(flexible.with_values(touchdown={"fore": -1.2, "hind": -1.2}))
