"""Takes the picture that an example of the gallery writes beside itself into its page."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


class PicturesOnDisk:
    """A scraper of sphinx-gallery: the PNG by the name of an example is its picture."""

    def __call__(self, _block: Any, block_vars: dict[str, Any], gallery: dict[str, Any]) -> str:
        """Move the picture to where the gallery wants it, and return what shows it.

        Other examples run at the same time; ``01_first_stride.py`` writes ``first_stride.png``.
        """
        source = Path(block_vars["src_file"])
        picture = source.with_name(f"{source.stem.partition('_')[2]}.png")
        if not picture.exists():
            return ""
        place = next(block_vars["image_path_iterator"])
        shutil.move(picture, place)
        return str(figure_rst([place], gallery["src_dir"]))

    def __repr__(self) -> str:
        return type(self).__name__
