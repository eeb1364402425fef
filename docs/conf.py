"""How the documentation site is made: ``make docs`` builds it, and fails on any warning."""

from __future__ import annotations

import sys
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_sphinx"))

from pictures import PicturesOnDisk  # noqa: E402

from flexspine import __version__  # noqa: E402

project = "flexspine"
author = "flexspine maintainers"
copyright = author
release = version = __version__

extensions = [
    "myst_nb",
    "sphinx.ext.autodoc",
    "sphinx.ext.doctest",
    "sphinx.ext.viewcode",
    "sphinx_copybutton",
    "sphinx_design",
    "sphinx_gallery.gen_gallery",
    "mathml",
    "generated_pages",
]
exclude_patterns = [
    "_build",
    "**sg_execution_times.rst",
    *(f"gallery/*.{kind}" for kind in ("ipynb", "py", "json", "zip", "md5")),
]
default_role = "py:obj"
nitpicky = False

html_theme = "furo"
html_title = f"flexspine {__version__}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_math_renderer = "mathml"
html_show_sphinx = False

myst_enable_extensions = ["amsmath", "attrs_inline", "colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3

# Pages of code are run when the site is made, each in a kernel of its own.
nb_execution_mode = "force"
nb_execution_timeout = 120
nb_execution_raise_on_error = True
nb_execution_show_tb = True
nb_merge_streams = True

autodoc_member_order = "bysource"
autodoc_typehints = "signature"
autodoc_typehints_format = "short"
autodoc_class_signature = "separated"
python_use_unqualified_type_names = True
python_maximum_signature_line_length = 88

doctest_test_doctest_blocks = "default"

sphinx_gallery_conf = {
    "examples_dirs": str(HERE.parent / "examples"),
    "gallery_dirs": "gallery",
    "filename_pattern": r"/\d\d_\w+\.py$",
    "ignore_pattern": r"__init__\.py",
    "image_scrapers": (PicturesOnDisk(),),
    "within_subsection_order": "FileNameSortKey",
    "abort_on_example_error": True,
    "parallel": True,
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "remove_config_comments": True,
    "min_reported_time": 0,
}
suppress_warnings = ["config.cache"]  # the scraper is an object, which Sphinx cannot compare
