"""Pictures of a robot's run show what the dataset says, with units and without overlaps."""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np
import pytest
import xarray as xr
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from PIL import Image

from flexspine import animate, load_robot, plot_run, strip
from flexspine.control.trot import Trot, trot
from flexspine.errors import InputError, ParameterError
from flexspine.models.robot_run import robot_dataset
from flexspine.report.animation import frame_times
from flexspine.report.coordinates_figure import plot_coordinates, told_apart
from flexspine.report.robot_figure import plot_robot
from flexspine.report.robot_parts import RobotParts
from flexspine.report.robot_scene import RobotScene, tell_footing
from flexspine.report.style import themed
from tests.report.layout import assert_apart, text_boxes

RUNS = {
    "tracking": Trot(seconds=1.3),
    "pd": Trot(seconds=1.3, controller="pd"),
    "fallen": Trot(seconds=2.0, controller="pd", push=30.0, push_time=1.0),
}
UNITS = ("(m)", "(°)", "(N)", "(N s)", "(s)")


@pytest.fixture(scope="module")
def runs() -> dict[str, xr.Dataset]:
    return {name: robot_dataset(trot(load_robot("sc618"), RUNS[name])) for name in RUNS}


@pytest.fixture(scope="module")
def undrawn(runs: dict[str, xr.Dataset]) -> dict[str, xr.Dataset]:
    """Copies of the runs, from before anything of them is drawn."""
    return {name: run.copy(deep=True) for name, run in runs.items()}


@pytest.fixture(scope="module")
def figures(runs: dict[str, xr.Dataset], undrawn: dict[str, xr.Dataset]) -> dict[str, Figure]:
    return {name: plot_robot(runs[name]) for name in undrawn}


@pytest.fixture(params=sorted(RUNS))
def name(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.fixture
def data(runs: dict[str, xr.Dataset], name: str) -> xr.Dataset:
    return runs[name]


@pytest.fixture
def figure(figures: dict[str, Figure], name: str) -> Figure:
    return figures[name]


def labelled(figure: Figure, label: str) -> Axes:
    (axes,) = [axes for axes in figure.axes if label in axes.get_ylabel()]
    return axes


def scene_of(data: xr.Dataset, times: np.ndarray | None = None) -> RobotScene:
    with themed():
        return RobotScene(data, frame_times(data, 25, 1.0) if times is None else times, 1.0)


def assert_all_inside_and_apart(figure: Figure) -> None:
    width, height = figure.get_size_inches() * figure.dpi
    boxes = text_boxes(figure)
    assert_apart(boxes)
    for text, box in boxes:
        assert box.x0 >= -1, text
        assert box.y0 >= -1, text
        assert box.x1 <= width + 1, text
        assert box.y1 <= height + 1, text


def assert_axes_apart(figure: Figure) -> None:
    """Twin axes share their place; all others stand below each other."""
    places = {tuple(np.round(axes.get_position().extents, 6)) for axes in figure.axes}
    for (_, low, _, _), (_, _, _, high) in itertools.pairwise(sorted(places, key=lambda p: -p[1])):
        assert high <= low


def test_the_runs_are_what_the_tests_need(runs: dict[str, xr.Dataset]) -> None:
    assert runs["tracking"].outcome == runs["pd"].outcome == "completed"
    assert runs["fallen"].outcome != "completed"
    assert (runs["pd"].slides != 0).any()


def test_text_stays_inside_and_apart(figure: Figure) -> None:
    assert_all_inside_and_apart(figure)
    assert_axes_apart(figure)


def test_every_axis_has_a_unit(figure: Figure) -> None:
    labels = [text for axes in figure.axes for text in (axes.get_ylabel(), axes.get_xlabel())]
    assert sum(bool(label) for label in labels) >= 9
    for label in filter(None, labels):
        assert any(unit in label for unit in UNITS), label


@pytest.mark.parametrize("joint", ["hip_1", "knee_1", "hip_3", "knee_3"])
def test_joints_are_drawn_as_they_are_and_as_wanted(
    data: xr.Dataset, figure: Figure, joint: str
) -> None:
    axes = labelled(figure, f"{joint.replace('_', ' ')} (°)")
    real, wanted = axes.get_lines()
    shown = data.isel(time=slice(0, len(real.get_xdata())))
    np.testing.assert_array_equal(real.get_xdata(), shown.time)
    np.testing.assert_allclose(real.get_ydata(), shown.angle.sel(joint=joint) * 180 / np.pi)
    np.testing.assert_allclose(wanted.get_ydata(), shown.reference.sel(motor=joint) * 180 / np.pi)
    assert real.get_linestyle() == "-"
    assert wanted.get_linestyle() == "--"


@pytest.mark.parametrize(("label", "axis"), [("normal", "y"), ("tangential", "x")])
def test_forces_are_those_of_the_first_legs(
    data: xr.Dataset, figure: Figure, label: str, axis: str
) -> None:
    lines = labelled(figure, label).get_lines()
    for line, foot in zip(lines, ("toe_1", "toe_3"), strict=True):
        one = data.sel(foot_name=foot, axis=axis)
        stands = one.stands.values > 0
        drawn = np.asarray(line.get_ydata())
        np.testing.assert_array_equal(np.isnan(drawn), ~stands)
        np.testing.assert_array_equal(drawn[stands], one.grf.values[stands])


def test_impulses_are_marked_where_feet_hit(
    runs: dict[str, xr.Dataset], figures: dict[str, Figure]
) -> None:
    data = runs["tracking"]
    twins = [axes for axes in figures["tracking"].axes if "impulse" in axes.get_ylabel()]
    assert len(twins) == 2
    for axes, axis in zip(twins, ("y", "x"), strict=True):
        for line, foot in zip(axes.get_lines(), ("toe_1", "toe_3"), strict=True):
            got = data.event_impulse.sel(foot_name=foot, axis=axis).values
            hit = abs(got) > 1e-4
            assert hit.any()
            np.testing.assert_allclose(line.get_xdata(), data.event_time.values[hit])
            np.testing.assert_allclose(line.get_ydata(), got[hit])
            assert (abs(got) <= axes.get_ylim()[1]).all()


def test_bars_cover_the_time_a_foot_stands(data: xr.Dataset, figure: Figure) -> None:
    bars = figure.axes[0]
    step = 0.001  # s, between the samples
    assert [label.get_text() for label in bars.get_yticklabels()] == [
        "hind 1", "hind 2", "fore 1", "fore 2",
    ]  # fmt: skip
    pieces = [[p.get_extents() for p in bar.get_paths()] for bar in bars.collections]
    for row, foot in enumerate(("toe_1", "toe_2", "toe_3", "toe_4")):
        one = data.sel(foot_name=foot)
        for found, which in zip(pieces[2 * row :], ("sticks", "slides"), strict=False):
            on = (one.stands > 0) & ((one.slides != 0) == (which == "slides"))
            assert sum(p.width for p in found) == pytest.approx(
                float(on.sum()) * step, abs=step * (len(found) + 1)
            )


def test_com_and_trunk_are_drawn(data: xr.Dataset, figure: Figure) -> None:
    (height,) = labelled(figure, "CoM height").get_lines()
    np.testing.assert_array_equal(height.get_ydata(), data.com.sel(axis="y"))
    (ahead,) = labelled(figure, "ahead").get_lines()
    x, drawn = data.com.sel(axis="x").values, np.asarray(ahead.get_ydata())
    slope, start = np.polyfit(data.time.values, x, 1)
    np.testing.assert_allclose(drawn, x - start - slope * data.time.values, atol=1e-12)
    pitch, spine = figure.axes[8].get_lines()
    np.testing.assert_allclose(pitch.get_ydata(), data.trunk_pitch * 180 / np.pi)
    np.testing.assert_allclose(spine.get_ydata(), data.angle.sel(joint="spine") * 180 / np.pi)


def test_a_window_limits_the_time(runs: dict[str, xr.Dataset]) -> None:
    figure = plot_robot(runs["pd"], window=(0.5, 1.0))
    assert figure.axes[0].get_xlim() == (0.5, 1.0)
    for line in labelled(figure, "CoM height").get_lines():
        assert min(line.get_xdata()) >= 0.5
        assert max(line.get_xdata()) <= 1.0
    boxes = text_boxes(figure)
    assert any("0.5 s to 1 s of a run" in text for text, _ in boxes)
    assert_apart(boxes)
    assert_axes_apart(figure)
    with pytest.raises(ParameterError, match="no samples"):
        plot_robot(runs["pd"], window=(7.0, 8.0))


def test_of_a_long_run_the_last_four_cycles_are_shown(runs: dict[str, xr.Dataset]) -> None:
    data = runs["pd"].copy()
    data.attrs["settings"] = data.attrs["settings"].replace(
        '"gait.stance": 0.4', '"gait.stance": 0.1'
    )
    assert plot_robot(data).axes[0].get_xlim() == pytest.approx((0.5, 1.3))


def test_a_fall_is_told(runs: dict[str, xr.Dataset], figures: dict[str, Figure]) -> None:
    words = " ".join(text.get_text() for text in figures["fallen"].findobj(Text))
    assert runs["fallen"].outcome.replace("_", " ") in words


def test_a_run_that_left_all_bounds_is_drawn_up_to_there(runs: dict[str, xr.Dataset]) -> None:
    data = runs["tracking"].copy(deep=True)
    data.attrs["outcome"] = "diverged"
    data["com"][-1] = 1e6
    (height,) = labelled(plot_robot(data), "CoM height").get_lines()
    assert max(height.get_ydata()) < 1


def test_a_robot_without_controller_is_drawn(runs: dict[str, xr.Dataset]) -> None:
    figure = plot_robot(runs["pd"].drop_vars(["reference", "trunk_pitch"]))
    assert len(labelled(figure, "knee 1").get_lines()) == 1
    assert len(figure.axes[8].get_lines()) == 1


def test_legs_are_found_from_the_tree(runs: dict[str, xr.Dataset]) -> None:
    parts = RobotParts.of(runs["pd"])
    assert {leg.name: (leg.links, leg.joints, leg.side, leg.near) for leg in parts.legs} == {
        "hind_1": (("shank_1", "thigh_1"), ("hip_1", "knee_1"), "hind", True),
        "hind_2": (("shank_2", "thigh_2"), ("hip_2", "knee_2"), "hind", False),
        "fore_1": (("shank_3", "thigh_3"), ("hip_3", "knee_3"), "fore", True),
        "fore_2": (("shank_4", "thigh_4"), ("hip_4", "knee_4"), "fore", False),
    }
    assert (parts.trunk, parts.spine, parts.bends) == (("hind_trunk", "fore_trunk"), "spine", 1.0)


def test_a_run_without_samples_is_refused(data: xr.Dataset, tmp_path: Path) -> None:
    empty = data.isel(time=slice(0, 0))
    for draw in (plot_robot, lambda d: animate(d, tmp_path / "run.gif")):
        with pytest.raises(InputError, match="no samples"):
            draw(empty)
    for draw in (plot_run, strip):
        with pytest.raises(InputError, match="plot_robot"):
            draw(data)
    with pytest.raises(InputError, match="robot_dataset"):
        plot_robot(data.drop_vars("grf"))


def test_links_feet_and_forces_are_drawn_where_they_are(data: xr.Dataset) -> None:
    scene = scene_of(data, data.time.values[::37])
    drawn = 0
    for posture, nearest in zip(
        scene.postures, (data.isel(time=i) for i in range(0, data.sizes["time"], 37)), strict=True
    ):
        scene.show(posture)
        for leg in scene.parts.legs:
            one = nearest.sel(foot_name=leg.foot)
            place, force = one.foot.values, one.grf.values
            np.testing.assert_allclose(scene.robot.feet[leg.name].get_xydata()[0], place, atol=1e-9)
            arrow = scene.robot.arrows[leg.name]
            if not arrow.get_visible():
                assert np.hypot(*force) * scene.scale.arrow <= 0.0201 * scene.scale.leg
                continue
            corners = arrow.get_xy()
            tail = (corners[0] + corners[6]) / 2
            np.testing.assert_allclose(corners[3], place, atol=1e-9)
            np.testing.assert_allclose(corners[3] - tail, scene.scale.arrow * force, atol=1e-9)
            drawn += 1
        for link, lines in scene.robot.trunk.items():
            ends = [nearest.link_start.sel(link=link), nearest.link_end.sel(link=link)]
            np.testing.assert_allclose(lines[0].get_xydata(), ends, atol=1e-9)
    assert drawn >= 5


def test_legs_reach_from_foot_to_hip(data: xr.Dataset) -> None:
    scene = scene_of(data)
    lengths = {"shank": 0.25, "thigh": 0.16}
    for posture in scene.postures[::5]:
        scene.show(posture)
        for leg in scene.parts.legs:
            nodes = np.asarray(scene.robot.legs[leg.name].get_xydata())
            np.testing.assert_allclose(nodes[0], posture.feet[leg.name].place, atol=1e-3)
            apart = np.hypot(*np.diff(nodes, axis=0).T)
            np.testing.assert_allclose(apart, [*lengths.values()], atol=2e-3)
            hip = posture.links["hind_trunk" if leg.side == "hind" else "fore_trunk"]
            np.testing.assert_allclose(
                nodes[-1], hip[0] if leg.side == "hind" else hip[1], atol=1e-3
            )


def test_frames_follow_the_times_and_the_com(data: xr.Dataset) -> None:
    scene = scene_of(data)
    times = frame_times(data, 25, 1.0)
    assert [posture.time for posture in scene.postures] == pytest.approx(times)
    for posture in scene.postures[::7]:
        scene.show(posture)
        assert np.mean(scene.stage.axes.get_xlim()) == pytest.approx(posture.com[0])
        assert scene.stage.clock.get_text() == f"t = {posture.time:.3f} s"


def test_words_of_the_animation_stay_inside_and_apart(data: xr.Dataset) -> None:
    scene = scene_of(data)
    for posture in scene.postures[::7]:
        scene.show(posture)
        assert_all_inside_and_apart(scene.figure)


def test_the_footing_is_told_in_words(data: xr.Dataset) -> None:
    scene = scene_of(data)
    for posture in scene.postures:
        told = tell_footing(posture, scene.parts)
        footing = str(data.footing.sel(time=posture.time, method="pad").values)
        toes = {"toe_1": "hind 1", "toe_2": "hind 2", "toe_3": "fore 1", "toe_4": "fore 2"}
        for toe, leg in toes.items():
            assert (leg in told) == (toe in footing)
        assert ("sliding" in told) == (">" in footing or "<" in footing)


def test_nothing_of_the_robot_is_beyond_the_camera(data: xr.Dataset) -> None:
    scene = scene_of(data)
    for posture in scene.postures:
        scene.show(posture)
        (left, right), (low, high) = scene.stage.axes.get_xlim(), scene.stage.axes.get_ylim()
        for end in itertools.chain.from_iterable(posture.links.values()):
            assert left < end[0] < right
            assert low < end[1] < high


def test_an_animation_is_at_real_speed(runs: dict[str, xr.Dataset], tmp_path: Path) -> None:
    animate(runs["pd"].sel(time=slice(0, 0.5)), tmp_path / "run.gif")
    with Image.open(tmp_path / "run.gif") as image:
        assert image.n_frames == np.ceil(0.5 * 25) + 1
        assert image.size == (800, 530)


@pytest.mark.usefixtures("figure")
def test_drawing_leaves_the_data_alone(
    data: xr.Dataset, undrawn: dict[str, xr.Dataset], name: str
) -> None:
    scene_of(data)
    xr.testing.assert_identical(data, undrawn[name])


@pytest.fixture(scope="module")
def coordinates() -> Figure:
    return plot_coordinates(load_robot("sc618"))


def test_coordinates_are_all_named(coordinates: Figure) -> None:
    robot = load_robot("sc618")
    words = [text for text, _ in text_boxes(coordinates)]
    named = [f"$q_{{{n}}}$ {name}" for n, name in enumerate(robot.joints, start=2)]
    for text in ["$q_1$", *named, "$q_{11}$", "$q_{12}$", *robot.parents, *robot.feet]:
        assert words.count(text) == 1, text
    assert_all_inside_and_apart(coordinates)


def test_arcs_turn_from_the_parent_to_the_link(coordinates: Figure) -> None:
    robot = load_robot("sc618")
    q, linkage = told_apart(robot), robot.linkage
    arcs = [
        np.asarray(line.get_xydata())
        for line in coordinates.axes[0].get_lines()
        if line.get_color() == "#0072B2"
    ]
    assert len(arcs) == len(robot.parents)
    angles = linkage.angles(q)
    for number, (link, arc) in enumerate(zip(linkage.links, arcs, strict=True)):
        ways = arc - linkage.point(q, link.name, 0.0)
        first, last = np.arctan2(ways[[0, -1], 1], ways[[0, -1], 0])
        parent = 0.0 if link.parent is None else angles[linkage.place[link.parent]]
        assert np.exp(1j * first) == pytest.approx(np.exp(1j * parent))
        assert np.exp(1j * last) == pytest.approx(np.exp(1j * angles[number]))
        turned = np.unwrap(np.arctan2(ways[:, 1], ways[:, 0]))
        assert turned[-1] - turned[0] == pytest.approx(q[number])


def test_no_link_of_the_coordinates_crosses_another() -> None:
    robot = load_robot("sc618")
    q, linkage = told_apart(robot), robot.linkage
    along = np.linspace(0.1, 0.9, 50)
    bodies = {
        link.name: np.array([linkage.point(q, link.name, s * link.length) for s in along])
        for link in linkage.links
    }
    for (_, one), (_, other) in itertools.combinations(bodies.items(), 2):
        assert np.hypot(*(one[:, None] - other[None]).T).min() > 0.01
