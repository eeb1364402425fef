"""Figures in notebooks."""

from __future__ import annotations

from io import BytesIO

import pytest
from IPython.core.formatters import DisplayFormatter
from PIL import Image

from flexspine import load_model, plot_coordinates, plot_run, simulate, to_dataset


@pytest.mark.parametrize(
    "draw",
    [
        lambda model: plot_coordinates(model),
        lambda model: plot_run(to_dataset(simulate(model))),
    ],
    ids=["coordinates", "run"],
)
def test_a_notebook_shows_a_figure_by_itself(draw):
    figure = draw(load_model("kamimura2015-flexible"))
    data, _ = DisplayFormatter().format(figure)
    with Image.open(BytesIO(data["image/png"])) as picture:
        assert picture.format == "PNG"
        wide, high = figure.get_size_inches() * figure.dpi
        assert picture.size == (pytest.approx(wide, abs=1), pytest.approx(high, abs=1))
