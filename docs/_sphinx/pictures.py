"""Takes the pictures that an example of the gallery writes beside itself into its page."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

from sphinx_gallery.scrapers import figure_rst


class PicturesOnDisk:
    """A scraper of sphinx-gallery: every PNG that a block of an example wrote is its picture."""

    def __call__(self, _block: Any, block_vars: dict[str, Any], gallery: dict[str, Any]) -> str:
        """Move the pictures to where the gallery wants them, and return what shows them."""
        places = block_vars["image_path_iterator"]
        taken = []
        for picture in sorted(Path(block_vars["src_file"]).parent.glob("*.png")):
            place = next(places)
            shutil.move(picture, place)
            taken.append(place)
        return figure_rst(taken, gallery["src_dir"])

    def __repr__(self) -> str:
        return type(self).__name__
