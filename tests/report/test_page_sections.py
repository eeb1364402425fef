"""What a page makes of records, tables, films and commands, from numbers that anybody can check."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from flexspine import load_robot, write_report
from flexspine.report.document import document
from flexspine.report.page.holdings import LARGEST_FILM
from flexspine.report.page.reading import MOST_POINTS
from tests.report.branches import branch_record
from tests.report.pages import Page, assert_needs_nothing_else


def page_of(folder: Path, **records: Any) -> Page:
    for name, record in records.items():
        text = json.dumps({"schema_version": 1, **record})
        (folder / f"{name}.json").write_text(text)
    page = Page(document(folder))
    assert_needs_nothing_else(page)
    return page


def write_csv(file: Path, columns: dict[str, list[Any]]) -> None:
    rows = [",".join(columns), *(",".join(map(str, row)) for row in zip(*columns.values()))]  # noqa: B905
    file.write_text("\n".join(rows) + "\n")


def chosen(page: Page) -> list[str | None]:
    """What the lists of a plot show at first."""
    return [each["value"] for each in page.of("option") if "selected" in each]


def test_the_page_is_written_where_it_is_asked_for(tmp_path: Path) -> None:
    (tmp_path / "summary.json").write_text('{"schema_version": 1, "distance": 3.5}')
    assert write_report(tmp_path) == tmp_path / "report.html"
    elsewhere = tmp_path / "new" / "page.htm"
    assert write_report(str(tmp_path), str(elsewhere)) == elsewhere
    assert elsewhere.read_bytes() != (tmp_path / "report.html").read_bytes()  # lists the other one
    assert "distance 3.5 m" in Page(elsewhere.read_text()).text


def test_a_branch_is_drawn_over_what_it_was_followed_in(tmp_path: Path) -> None:
    page = page_of(tmp_path, branch=branch_record())
    drawn = page.data["branch-0"]
    assert drawn["axis"] == {"title": "spine stiffness k_t (N m/rad)", "marks": [220.0]}
    panels = {panel["title"]: panel for panel in drawn["panels"]}
    forces = panels["Peak ground reaction force, per pair of legs"]
    assert [line["name"] for line in forces["lines"]] == ["fore", "hind"]
    assert forces["lines"][0]["x"] == [200, 220, 240, 260]
    assert forces["lines"][0]["y"] == [500, 460, 420, 380]
    multipliers = panels["Floquet multipliers, modulus"]
    assert (multipliers["log"], multipliers["level"]) == (True, 1)
    assert [line["y"][1] for line in multipliers["lines"]] == [1.0, 0.5, 1e-6, 1.0]
    assert panels["Leg extension"]["lines"][0]["y"] == [1.0] * 4
    assert panels["Leg extension"]["unit"] == "mm"
    np.testing.assert_allclose(panels["Touchdown angle"]["lines"][0]["y"], np.degrees(0.5))
    assert "Cost of transport" not in panels
    assert "Mean speed" not in panels
    assert "220 period doubling -1 is passed" in page.text
    assert "reached 200 and it turns at 260" in page.text


def test_columns_have_units_and_those_that_never_change_stand_apart(tmp_path: Path) -> None:
    columns = {
        "mean_speed": [4.0, 4.1, 4.2], "energy": [290.0, 290.00000000000006, 290.0],
        "peak_grf_fore": [500.0, 510.0, 520.0], "preset": ["scout2"] * 3,
    }  # fmt: skip
    write_csv(tmp_path / "gaits.csv", columns)
    page = page_of(tmp_path, summary={})
    assert "mean_speed (m/s) peak_grf_fore (N)" in page.text
    assert "the same in all of these rows column value energy (J) 290 preset scout2" in page.text
    assert chosen(page)[:2] == ["mean_speed", "peak_grf_fore"]


def test_long_texts_are_cut_short_and_lists_rounded(tmp_path: Path) -> None:
    story = "it turns at " + "a very long story " * 9
    numbers = json.dumps([1 / 3, 2 / 3, 1 / 7, 1 / 9])
    write_csv(tmp_path / "rows.csv", {"reason": [story, "b"], "list": [f'"{numbers}"', '"[1, 2]"']})
    page = page_of(tmp_path, summary={})
    assert story not in page.text
    assert story in {str(each.get("title")) for each in page.of("span")}
    assert "0.33333, 0.66667, 0.14286, 0.11111" in page.text


def test_a_long_table_is_drawn_from_end_to_end(tmp_path: Path) -> None:
    count = 5 * MOST_POINTS
    columns = {"time": list(range(count)), "size": [i % 7 for i in range(count)]}
    write_csv(tmp_path / "rows.csv", {**columns, "case": ["a", "b"] * (count // 2)})
    drawn = page_of(tmp_path, summary={}).data["table-0"]
    time = drawn["numbers"]["time"]
    assert len(time) == MOST_POINTS
    assert (time[0], time[-1]) == (0, pytest.approx(count - 1, rel=1e-5))
    assert np.ptp(np.diff(time)) <= 1
    assert set(drawn["texts"]["case"]) == {"a", "b"}


def test_what_cannot_be_drawn_has_no_plot(tmp_path: Path) -> None:
    write_csv(
        tmp_path / "one.csv", {"a": [1, 2, 3, 4], "b": [5, 5, 5, 5], "c": ["x", "y", "z", "x"]}
    )
    write_csv(tmp_path / "short.csv", {"a": [1, 2], "b": [3, 4]})
    page = page_of(tmp_path, summary={})
    assert page.data == {}
    assert not any("Plotly" in script for script in page.scripts)


def test_a_summary_tells_what_is_nested(tmp_path: Path) -> None:
    record = {
        "agrees": False, "over": {"pitch_rate": 8.0}, "peak_grf": {"fore": 7.25, "hind": 8.25},
        "level_spectral_radius": {"least": {"value": 1.5}, "largest": {"value": 2.5}},
        "lines": [{"spine_stiffness": 200.0, "fastest": 4.56}, {"spine_stiffness": 210.0}],
    }  # fmt: skip
    page = page_of(tmp_path, summary=record)
    for told in (
        "they do not agree", "over: pitch rate 8 rad/s",
        "peak ground reaction force, per pair of legs: fore 7.25 N",
        "which value least 1.5 largest 2.5",
        "spine_stiffness (N m/rad) fastest (m/s) 200 4.56 210 -",
    ):  # fmt: skip
        assert told in page.text, told


@pytest.mark.parametrize(
    ("record", "title"),
    [
        ({"branch": {}}, "A branch of gaits"),
        ({"push": {"about": "push at an apex"}}, "Surviving a push at an apex"),
        ({"summary": {"basins": []}}, "Basins of attraction of gaits"),
        ({"summary": {}}, "Results in mine"),
    ],
)
def test_the_title_tells_what_it_is(tmp_path: Path, record: dict[str, Any], title: str) -> None:
    (tmp_path / "mine").mkdir()
    page = page_of(tmp_path / "mine", **record)
    assert page.text.startswith(f"{title} {title} Results in mine/")


def gait(**parameters: float) -> dict[str, Any]:
    return {
        "preset": "kamimura2015-flexible", "model": "flexible-bounder", "family": "fore-first",
        "parameters": {"fore.mass": 10.4, "fore.leg.extension": 0.0, **parameters},
        "apex": {"height": 0.31}, "touchdown_angles": {"fore": 0.4},
    }  # fmt: skip


def test_the_preset_tells_where_numbers_of_a_gait_come_from(tmp_path: Path) -> None:
    numbers = {"spine.stiffness": 240.0, "fore.spine_offset": 0.138}
    text = page_of(tmp_path, mine=gait(**numbers)).text
    assert "Artif Life Robotics 20:270-275" in text
    for told in (
        "fore.mass 10.4 kg mass of the segment the source",
        "240 N m/rad torsional stiffness k_t changed from 260",
        "spine joint printed 0.069 m; doubled, see doubts",
        "Doubt: The lengths printed",
        "1 parameters at their default",
        "height of the centre of mass at the start of this gait",
    ):
        assert told in text, told


def test_numbers_of_an_unknown_preset_are_said_to_be_unknown(tmp_path: Path) -> None:
    text = page_of(tmp_path, mine={**gait(), "preset": "somebody's"}).text
    assert "fore.mass 10.4 kg mass of the segment not recorded" in text


def test_a_robot_tells_what_was_chosen(tmp_path: Path) -> None:
    numbers = dict(load_robot("sc618", {"friction": 0.5}).numbers)
    record = {"robot": "sc618", "cases": [], "parameters": numbers}
    text = page_of(tmp_path, summary=record).text
    assert "friction 0.5 1 of feet on the ground (Coulomb) changed from 0.8" in text
    assert "spine.stiffness 240 N m/rad on the relative angle chosen, see doubts" in text
    assert "toe_2.mass 0.1796 kg of the foot, a point the source" in text
    assert "660 kg/m3" in text


def test_the_lighter_film_is_shown_and_a_heavy_one_named(tmp_path: Path) -> None:
    (tmp_path / "animation.gif").write_bytes(b"GIF89a" + bytes(900))
    (tmp_path / "animation.mp4").write_bytes(bytes(400))
    (tmp_path / "film.gif").write_bytes(b"GIF89a" + bytes(800))
    (tmp_path / "heavy.mp4").write_bytes(bytes(LARGEST_FILM + 1))
    page = page_of(tmp_path, summary={})
    (video,) = page.of("video")
    assert str(video["src"]).startswith("data:video/mp4;base64,AAAA")
    (image,) = page.of("img")
    assert (image["alt"], str(image["src"])[:22]) == ("film.gif", "data:image/gif;base64,")
    assert "animation.gif 1 kB" in page.text
    assert "heavy.mp4 3000 kB" in page.text


def test_the_command_that_made_it_is_told(tmp_path: Path) -> None:
    assert "is not recorded" in page_of(tmp_path, summary={"seed": 7}).text
    (tmp_path / "command.txt").write_text("flexspine bound --set 'a b' --out x\n")
    text = page_of(tmp_path, summary={"seed": 7}).text
    assert "flexspine bound --set 'a b' --out x summary.json" not in text
    assert "flexspine bound --set 'a b' --out x" in text
    assert "is not recorded" not in text
    assert "summary.json seed 7" in text
    assert "command.txt" not in text
