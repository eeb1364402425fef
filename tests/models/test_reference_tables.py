"""Fixed points from outside: the spring-mass runner and Scout II. Sources in the tables."""

from __future__ import annotations

from math import radians

import pytest

from flexspine import load_model, simulate
from tests.conftest import reference_rows

SLIP = [[float(cell) for cell in row] for row in reference_rows("slip.csv")]
SCOUT = [[float(cell) for cell in row] for row in reference_rows("scout2.csv")]


@pytest.mark.parametrize("row", SLIP, ids=lambda row: f"{row[0]:g}kg")
def test_a_level_rigid_body_is_the_spring_mass_runner(row: list[float]) -> None:
    mass, stiffness, length, gravity, angle, speed, height, _ = row
    leg = {"leg.stiffness": stiffness / 2, "leg.rest_length": length}
    model = load_model(
        "slip",
        {
            "body.mass": mass,
            "gravity": gravity,
            **{f"{side}.{name}": value for side in ("fore", "hind") for name, value in leg.items()},
        },
        apex={"speed": speed, "height": height, "pitch": 0.0, "pitch_rate": 0.0},
        touchdown={"fore": angle, "hind": angle},
    )
    run = simulate(model)
    assert run.phases == ("DF", "DS", "DF")
    end = run.apexes[-1]
    assert end["height"] == pytest.approx(height, abs=1e-9)
    assert end["speed"] == pytest.approx(speed, abs=1e-9)
    assert end["pitch"] == pytest.approx(0, abs=1e-12)


def running_slip(height: float) -> dict[str, float]:
    """One stride of the running set in slip.csv: 80 kg, 20 kN/m, 22 deg, energy of 5 m/s at 1 m."""
    speed = (25 + 2 * 9.81 * (1 - height)) ** 0.5
    leg = {"leg.stiffness": 10_000.0, "leg.rest_length": 1.0}
    model = load_model(
        "slip",
        {
            "body.mass": 80.0,
            "gravity": 9.81,
            **{f"{side}.{name}": value for side in ("fore", "hind") for name, value in leg.items()},
        },
        apex={"speed": speed, "height": height},
        touchdown={"fore": radians(22), "hind": radians(22)},
    )
    return simulate(model).apexes[-1]


@pytest.mark.parametrize(
    ("height", "slope"), [(0.940267144380, -0.161308), (1.337686381370, 1.686968)]
)
def test_the_running_spring_mass_model_has_its_two_fixed_points(
    height: float, slope: float
) -> None:
    assert running_slip(height)["height"] == pytest.approx(height, abs=1e-9)
    step = 1e-5
    difference = running_slip(height + step)["height"] - running_slip(height - step)["height"]
    assert difference / (2 * step) == pytest.approx(slope, abs=1e-5)


@pytest.mark.parametrize("row", SCOUT, ids=lambda row: f"{row[0]:g}mps-{row[1]:g}")
def test_scout2_gaits_close_to_their_digits(row: list[float]) -> None:
    speed, rate, hind, fore, period, _ = row
    model = load_model(
        "scout2",
        apex={"height": 0.35, "pitch": 0.0, "speed": speed, "pitch_rate": radians(rate)},
        touchdown={"fore": radians(fore), "hind": radians(hind)},
    )
    run = simulate(model)
    assert run.outcome.completed
    end = run.apexes[-1]
    # Angles are given to 5e-5 deg = 9e-7 rad; the stride map magnifies that by some ten.
    assert end["height"] == pytest.approx(0.35, abs=1e-5)
    assert end["pitch"] == pytest.approx(0, abs=2e-5)
    assert end["speed"] == pytest.approx(speed, abs=2e-5)
    assert end["pitch_rate"] == pytest.approx(radians(rate), abs=2e-4)
    assert run.trajectory.duration == pytest.approx(period, abs=1e-5)


def test_the_slow_scout2_gait_closes_with_gravity_9_8() -> None:
    model = load_model(
        "scout2",
        {"gravity": 9.8},
        apex={"height": 0.324, "pitch": 0.0, "speed": 1.39, "pitch_rate": radians(145.9)},
        touchdown={"fore": radians(13.96764), "hind": radians(15.98375)},
    )
    end = simulate(model).apexes[-1]
    assert end["height"] == pytest.approx(0.324, abs=1e-5)
    assert end["speed"] == pytest.approx(1.39, abs=1e-5)
    assert end["pitch_rate"] == pytest.approx(radians(145.9), abs=1e-4)
