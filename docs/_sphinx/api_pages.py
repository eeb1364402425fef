"""The public names of the library, a page for every layer that they come from."""

from __future__ import annotations

from inspect import isclass

import flexspine

LAYERS = {
    "models": ("Animals and robots", "Presets, parameters and one run or many of them."),
    "gaits": ("Gaits", "Found, certified, followed, and their stability."),
    "control": ("Control", "Feedback, walks, oscillators and how forces are shared."),
    "engines": ("In space", "The robot in MuJoCo."),
    "studies": ("Studies", "Sweeps, maps, disturbances, searches and checks."),
    "hybrid": ("Outcomes", "How runs end, with advice."),
    "report": ("Figures and pages", "What draws results; nothing here simulates."),
    "errors": ("Errors", "All that is raised on purpose."),
}

HEAD = """# Python

All that `import flexspine` offers. Names are loaded when first used, so importing costs next to
nothing. Modules below may change from version to version; these names only as
{doc}`../versioning` says.

"""


def api_pages() -> dict[str, str]:
    """Return a page for every layer with public names, and one that leads to them."""
    pages, rows = {}, []
    for layer, (title, about) in LAYERS.items():
        names = [name for name, home in flexspine._HOMES.items() if home.split(".")[0] == layer]
        pages[f"api/{layer}.md"] = page(title, about, listed(layer, sorted(names)))
        home = "flexspine.errors" if layer == "errors" else "flexspine"
        links = ", ".join(f"{{py:obj}}`~{home}.{name}`" for name in sorted(names))
        rows.append(f"[{title}](api/{layer}.md)\n: {about} {links}\n")
    toctree = "\n".join(f"api/{layer}" for layer in LAYERS)
    pages["api.md"] = f"{HEAD}{chr(10).join(rows)}\n```{{toctree}}\n:hidden:\n{toctree}\n```\n"
    return pages


def listed(layer: str, names: list[str]) -> str:
    """Functions first, then the classes that they take and return; of errors all there are."""
    if layer == "errors":
        return ".. automodule:: flexspine.errors\n   :members:\n   :show-inheritance:"
    objects = {name: getattr(flexspine, name) for name in names}
    functions = [name for name, value in objects.items() if not isclass(value)]
    classes = [name for name, value in objects.items() if isclass(value)]
    directives = [f".. autofunction:: flexspine.{name}" for name in functions]
    directives += [f".. autoclass:: flexspine.{name}\n   :members:" for name in classes]
    return "\n\n".join(directives)


def page(title: str, about: str, body: str) -> str:
    """A page of directives in reST, which is what autodoc writes."""
    return f"# {title}\n\n{about}\n\n```{{eval-rst}}\n{body}\n```\n"
