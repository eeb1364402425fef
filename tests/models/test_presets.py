from __future__ import annotations

from pathlib import Path

import pytest

from flexspine import load_model, preset_names, simulate
from flexspine.errors import FlexspineError, InputError
from flexspine.parameters import quantities, values

OWN_FILE = """
base = "kamimura2015-flexible"
title = "My stiffer spine"
notes = ["measured on the bench"]

[parameters.spine]
stiffness = 300

[touchdown]
fore = 0.45

[provenance]
"spine.stiffness" = "bench, 2 May"
"""


def test_the_five_presets_are_there() -> None:
    assert preset_names() == [
        "kamimura2015-flexible",
        "kamimura2015-locked",
        "kamimura2015-rigid",
        "scout2",
        "slip",
    ]


@pytest.mark.parametrize("name", preset_names())
def test_every_preset_cites_its_source_and_accounts_for_every_value(name: str) -> None:
    model = load_model(name)
    assert model.source.citation
    assert model.source.notes
    for about in quantities(type(model.parameters)):
        assert model.source.of(about.name), about.name


def test_the_locked_body_has_the_inertia_of_the_flexible_one_straightened() -> None:
    """2 (J + m a^2) = 2 (0.36 + 10.4 * 0.138^2) = 1.1161 kg m^2, hips at 0.276 m."""
    model = load_model("kamimura2015-locked")
    mode = model.system.mode("DF")
    given = dict(zip(model.system.parameters, model.parameter_vector, strict=True))
    for symbol, expression in mode.definitions.items():
        given[symbol] = expression.subs(given)
    found = {str(symbol): value for symbol, value in given.items()}
    assert float(found["I"]) == pytest.approx(1.1161152)
    assert float(found["h_f"]) == pytest.approx(0.276)
    assert float(found["h_h"]) == pytest.approx(0.276)


def test_a_users_file_works_where_a_preset_does(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(OWN_FILE)
    model = load_model(file)
    assert model.name == "mine"
    assert values(model.parameters)["spine.stiffness"] == 300
    assert values(model.parameters)["fore.mass"] == 10.4
    assert model.touchdown["fore"] == 0.45
    assert model.source.of("spine.stiffness") == "bench, 2 May"
    assert "mine.toml" in model.source.of("touchdown")
    assert all(note.startswith("kamimura2015-flexible: ") for note in model.source.notes[:-1])
    assert "measured on the bench" in model.source.notes
    assert simulate(model).trajectory.events


def test_a_preset_copied_to_a_file_is_the_same_model(tmp_path: Path) -> None:
    import flexspine

    source = Path(flexspine.__file__).parent / "presets" / "scout2.toml"
    file = tmp_path / "copy.toml"
    file.write_text(source.read_text())
    assert load_model(file).parameters == load_model("scout2").parameters


def test_a_value_set_by_the_user_says_so() -> None:
    model = load_model("scout2", {"body.mass": 25}, apex={"speed": 2.0})
    assert model.source.of("body.mass") == "set by user"
    assert model.source.of("apex") == "set by user"
    assert model.source.of("body.inertia").startswith("Poulakakis")


@pytest.mark.parametrize(
    ("content", "told"),
    [
        ("model = ", "not valid TOML"),
        ("", "names no model"),
        ('model = "flexible-boundr"', "unknown model 'flexible-boundr'"),
        ('base = "scout3"', "unknown preset 'scout3'"),
        ('base = "scout2"\nmodel = "rigid-bounder"', "both"),
        ('base = "scout2"\ntypo = 1', "unknown entry 'typo'"),
        ('base = "scout2"\nparameters = 3', "not a table"),
        ('base = "scout2"\nnotes = "one"', "not a list"),
        ('base = "scout2"\n[parameters.body]\nmas = 3', "unknown parameter 'body.mas'"),
        ('base = "scout2"\n[parameters.body]\nmass = -3', "body.mass"),
        ('base = "scout2"\n[parameters.body]\nmass = "heavy"', "'heavy'"),
        ('base = "scout2"\n[apex]\nheight = nan', "height"),
        ('base = "scout2"\n[apex]\nheigt = 1', "heigt"),
        ('base = "scout2"\n[touchdown]\nfore = 2', "beyond the horizontal"),
        ('model = "rigid-bounder"', "no value"),
        ("model = 3", "not a text"),
        ('base = "scout2"\nnotes = [1, 2]', "not a list of texts"),
        ('base = "scout2"\n[parameters]\nfore = 3', "'fore' is a group"),
        ('base = "scout2"\n[touchdown]\nfore = ' + "9" * 400, "touchdown"),
        ('base = "scout2"\n[parameters.body]\nmass = ' + "9" * 400, "body.mass"),
    ],
)
def test_a_malformed_file_is_refused_in_one_line(tmp_path: Path, content: str, told: str) -> None:
    file = tmp_path / "bad.toml"
    file.write_text(content)
    with pytest.raises(InputError) as refused:
        load_model(file)
    assert told in str(refused.value)
    assert "\n" not in str(refused.value)


def test_a_byte_order_mark_does_no_harm(tmp_path: Path) -> None:
    file = tmp_path / "windows.toml"
    file.write_bytes(b"\xef\xbb\xbf" + b'base = "scout2"')
    assert load_model(file).parameters == load_model("scout2").parameters


def test_a_file_that_is_no_text_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "binary.toml"
    file.write_bytes(b"\xff\xfe\x00\x80")
    with pytest.raises(FlexspineError, match="not text"):
        load_model(file)
    with pytest.raises(FlexspineError, match="cannot read"):
        load_model(tmp_path)


def test_a_file_based_on_itself_is_refused(tmp_path: Path) -> None:
    file = tmp_path / "loop.toml"
    file.write_text(f'base = "{file}"')
    with pytest.raises(InputError, match="base"):
        load_model(file)
