"""What the numbers of records and tables are called, and their units."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache

from flexspine.models.dataset import VARIABLES
from flexspine.models.registry import KINDS
from flexspine.parameters import quantities

# By the name in a record: words and unit.
WORDS: dict[str, tuple[str, str]] = {
    "achieved_speed": ("mean speed that came of it", "m/s"),
    "allowed_difference": ("allowed difference", "rad"),
    "angle": ("angle", "rad"),
    "apex_time": ("time of the apex", "s"),
    "asked_speed": ("speed asked for", "m/s"),
    "asked_speeds": ("speeds asked for", "m/s"),
    "best_stiffness": ("best spine stiffness", "N m/rad"),
    "bounce": ("CoM height, standard deviation", "m"),
    "clearance": ("how high feet are lifted", "m"),
    "com_amplitude": ("amplitude of the CoM's height", "m"),
    "compared": ("compared", "m/s"),
    "compared_up_to": ("compared up to", "s"),
    "contact": ("contact times", "s"),
    "contact_loss": ("energy lost to the ground, per stride", "J"),
    "cost_of_transport": ("cost of transport", ""),
    "damper_loss": ("energy lost in dampers, per stride", "J"),
    "deepest": ("deepest a foot got into the ground", "m"),
    "difference": ("difference", "rad"),
    "differences": ("differences", "rad"),
    "dissipated": ("energy lost in dampers", "J"),
    "distance": ("distance", "m"),
    "drift": ("largest drift of a standing foot", "m"),
    "duration": ("duration", "s"),
    "duty_factor": ("duty factor", ""),
    "energy": ("total energy", "J"),
    "energy_at_end": ("energy at the end", "J"),
    "energy_at_start": ("energy at the start", "J"),
    "energy_unaccounted": ("energy not accounted for", "J"),
    "error": ("tracking error", "rad"),
    "fastest": ("largest mean speed", "m/s"),
    "flight": ("share of time in flight", ""),
    "friction_demand": ("largest ratio of tangential to normal force", ""),
    "froude": ("Froude number", ""),
    "gained": ("way gained", "m"),
    "heading": ("heading, from x", "rad"),
    "height": ("height", "m"),
    "imbalance": ("energy not accounted for", "J"),
    "impact": ("mean of the largest normal force in touchdowns", "N"),
    "impulse": ("largest impulse of an impact", "N s"),
    "kinetic": ("kinetic energy", "J"),
    "landing": ("speed of feet that come down", "m/s"),
    "largest_imbalance": ("largest imbalance of energy", "J"),
    "largest_kinetic_energy": ("largest kinetic energy", "J"),
    "level_spectral_radius": ("spectral radius on the energy level", ""),
    "liftoff": ("lift-off angle", "rad"),
    "mean_error": ("tracking error (rms)", "rad"),
    "mean_speed": ("mean speed", "m/s"),
    "metres_per_fall": ("distance per fall", "m"),
    "motion_change": ("change of joint angles", "rad"),
    "net_work": ("net work", "J"),
    "normal": ("normal force on a foot that stands", "N"),
    "peak_force": ("peak force on a foot", "N"),
    "peak_grf": ("peak ground reaction force, per pair of legs", "N"),
    "peak_grf_vertical": ("peak vertical ground reaction force, per pair of legs", "N"),
    "peak_normal": ("largest normal force on a foot", "N"),
    "period": ("stride period", "s"),
    "pitch": ("pitch", "rad"),
    "place": ("place", "m"),
    "positive_work": ("positive work", "J"),
    "potential": ("potential energy", "J"),
    "push": ("push", "N s"),
    "push_backward": ("push backward", "N s"),
    "push_forward": ("push forward", "N s"),
    "push_time": ("time of the push", "s"),
    "ramp": ("steps until the speed is reached", ""),
    "relative_drift": ("relative drift", ""),
    "rest": ("rest", "rad"),
    "roll": ("roll of the trunk, standard deviation", "rad"),
    "seconds": ("duration asked for", "s"),
    "sliding": ("share of time in which a foot slides", ""),
    "slowest": ("least mean speed", "m/s"),
    "spacing": ("spacing", "m"),
    "spectral_radius": ("spectral radius", ""),
    "speed": ("steady speed", "m/s"),
    "speeds": ("range of mean speeds", "m/s"),
    "spine": ("spine", "rad"),
    "spine_range": ("spine angle", "rad"),
    "stance": ("how long a pair of legs stands", "s"),
    "step": ("step", "s"),
    "step_down": ("step down", "m"),
    "step_up": ("step up", "m"),
    "stiffnesses": ("spine stiffness", "N m/rad"),
    "stop": ("when it slows down", "s"),
    "stride_frequency": ("stride frequency", "Hz"),
    "stride_length": ("stride length", "m"),
    "strides": ("strides", ""),
    "sway": ("CoM sideways, standard deviation", "m"),
    "time": ("time", "s"),
    "torque": ("largest torque of a motor", "N m"),
    "torque_change": ("change of torques", "N m"),
    "touchdown": ("touchdown angle", "rad"),
    "turning": ("turning", "rad/s"),
    "unit": ("unit of the disturbance", ""),
    "wanted_speed": ("speed asked for", "m/s"),
    "wavelength": ("wavelength", "m"),
    "work": ("work of actuators", "J"),
    "x": ("x", "m"),
    "y": ("y", "m"),
}

# What names of columns have before and behind that of the quantity.
BEFORE = ("at_", "apex_", "gait_")
WHERE = "_at_"
BEHIND = ("_fore", "_hind", "_min", "_max", "_initial")


def unit_of(name: str) -> str:
    """Return the unit of a column or a parameter, nothing for one without, or not known."""
    known, flat = _units(), name.lower().replace(".", "_").partition(WHERE)[0]
    for each in (flat, *_shorter(flat)):
        if each in known:
            unit = known[each]
            return "" if unit == "1" else firm(unit)
    return ""


def firm(unit: str) -> str:
    """Return a unit that no end of a line takes apart."""
    return unit.replace(" ", "\u00a0")


def plain(name: str) -> str:
    """Return a name as words."""
    return name.replace("_", " ")


def _shorter(name: str) -> Iterator[str]:
    """A name without what is before it, behind it, and both."""
    bare = next((name.removeprefix(each) for each in BEFORE if name.startswith(each)), name)
    yield bare
    for each in (name, bare):
        yield next((each.removesuffix(end) for end in BEHIND if each.endswith(end)), each)


@cache
def _units() -> dict[str, str]:
    """Units by the names of parameters, of what is sampled, and of what records hold."""
    declared = {
        each.name.replace(".", "_"): each.unit
        for kind in KINDS.values()
        for each in quantities(kind.parameters)
    }
    sampled = {name: unit for name, (unit, _) in VARIABLES.items()}
    return {**declared, **sampled, **{name: unit for name, (_, unit) in WORDS.items()}}
