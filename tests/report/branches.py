"""A branch as a record, with numbers that anybody can check."""

from __future__ import annotations

from typing import Any


def branch_record() -> dict[str, Any]:
    """Peaks fall by 2 N per N m/rad; the largest multiplier passes 1 at 220 N m/rad."""
    return {
        "schema_version": 1,
        "over": "spine.stiffness",
        "fixed": {"energy": 290.0, "height": 0.32, "mean_speed": 4.25},
        "free": ["legs.extension"],
        "symmetric": True,
        "ends": ["reached 200", "it turns at 260"],
        "landmarks": [{"kind": "period doubling", "value": 220.0, "detail": "-1 is passed"}],
        "points": [
            {
                "spine.stiffness": stiffness,
                "legs.extension": 0.001,
                "model": "flexible-bounder",
                "peak_grf": {"fore": 900 - 2 * stiffness, "hind": 910 - 2 * stiffness},
                "work": {},
                "floquet_multipliers": [[0.0, stiffness / 220], [0.3, 0.4], [0.0, 0.0]],
                "level_spectral_radius": stiffness / 220,
                "touchdown_angles": {"fore": 0.5, "hind": 0.6},
                "period": 0.35,
                "stride_length": 1.5,
                "mean_speed": 4.25,
            }
            for stiffness in (200.0, 220.0, 240.0, 260.0)
        ],
    }
