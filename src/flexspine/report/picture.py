"""A figure that a notebook shows by itself, whether or not pyplot was imported there."""

from __future__ import annotations

from io import BytesIO

from matplotlib.figure import Figure


class Picture(Figure):
    """A matplotlib figure; as the last value of a notebook's cell it is drawn."""

    def _repr_png_(self) -> bytes:
        """What IPython asks for, as PNG."""
        file = BytesIO()
        self.savefig(file, format="png")
        return file.getvalue()
