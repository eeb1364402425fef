"""Floquet multipliers of a gait, with what they can be trusted for."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from flexspine.errors import ParameterError
from flexspine.gaits.gait import Gait
from flexspine.gaits.return_map import ReturnMap, linearize, section_rows
from flexspine.hybrid.compile import Array
from flexspine.hybrid.functions import section_quantities

ComplexArray = NDArray[np.complex128]

# Relative error of the Jacobian per unit of the integrator's tolerance. Against runs at 1e-16 it
# is 0.01 to 0.04 over all presets.
SAFETY = 3.0


@dataclass(frozen=True)
class Stability:
    """The linearised stride map of a gait, at fixed touchdown angles.

    ``jacobian`` (d, d) maps a deviation of the apex to that one period later, SI units, in the
    order of ``coordinates``. ``multipliers`` (d,) are its eigenvalues, largest first, ``vectors``
    (d, d) the eigenvectors as columns and ``condition_numbers`` (d,) theirs, both in natural units
    (``scales``, SI), so that they do not depend on units. ``jacobian_error`` bounds the error of
    the Jacobian in natural units. ``energy_gradient`` (d,) is that of the energy at the apex,
    ``energy_identity`` is ``|grad E' DP - grad E'| / |grad E|``; both None if energy is not
    conserved. ``crossing_rates`` tell how fast each guard was crossed, in its unit per second.
    """

    coordinates: tuple[str, ...]
    scales: Array
    jacobian: Array
    multipliers: ComplexArray
    vectors: ComplexArray
    condition_numbers: Array
    jacobian_error: float
    energy_identity: float | None
    energy_gradient: Array | None
    crossing_rates: tuple[float, ...]

    def __repr__(self) -> str:
        largest = ", ".join(f"{number:.4g}" for number in self.multipliers)
        word = "stable" if self.stable else "unstable"
        return f"<Stability: {word}, multipliers {largest}>"

    @property
    def errors(self) -> Array:
        """Error bar of each multiplier, to first order in the Jacobian's error."""
        return self.condition_numbers * self.jacobian_error

    @property
    def spectral_radius(self) -> float:
        """The largest magnitude of a multiplier."""
        return float(np.max(np.abs(self.multipliers)))

    @cached_property
    def reduced(self) -> Array:
        """The map on the energy level, in natural units; the whole map if there is none."""
        scaled = self.jacobian * self.scales / self.scales[:, None]
        if self.energy_gradient is None:
            return scaled
        basis = np.linalg.svd((self.energy_gradient * self.scales)[None])[2][1:]
        level: Array = basis @ scaled @ basis.T
        return level

    @cached_property
    def level_multipliers(self) -> ComplexArray:
        """The multipliers on the energy level: without the one that conserved energy makes 1."""
        return _sorted(np.linalg.eigvals(self.reduced).astype(complex))

    @property
    def level_spectral_radius(self) -> float:
        """The largest magnitude of a multiplier on the energy level."""
        return float(np.max(np.abs(self.level_multipliers)))

    @property
    def stable(self) -> bool:
        """Whether deviations on the energy level die out."""
        return self.level_spectral_radius < 1

    def shares(self, index: int) -> dict[str, float]:
        """Return how much each coordinate takes part in an eigenvector, largest first.

        ``index`` is that of the multiplier; shares add up to 1.
        """
        sizes = np.abs(self.vectors[:, index]) ** 2
        pairs = zip(self.coordinates, (sizes / sizes.sum()).tolist(), strict=True)
        return dict(sorted(pairs, key=lambda pair: -pair[1]))


def floquet_multipliers(gait: Gait, linear: ReturnMap | None = None) -> Stability:
    """Linearise the stride map of a gait exactly and take its eigenvalues.

    Variational equations between events, saltation at them (Leine & Nijmeijer 2004). Touchdown
    angles are held fixed. ``linear`` spares linearising its trajectory anew. Raises
    `ParameterError` for what is no gait.

    >>> from flexspine import examine, floquet_multipliers, load_model
    >>> stability = floquet_multipliers(examine(load_model("kamimura2015-flexible")))
    >>> f"{stability.level_spectral_radius:.4f}", stability.stable
    ('1.3278', False)
    """
    if gait.flaw is not None:
        raise ParameterError(
            f"there is no gait to linearise: {gait.flaw}",
            "find one first; stride_map differentiates any stride",
        )
    return linear_stability(gait, linear or linearize(gait.trajectory))


def linear_stability(gait: Gait, linear: ReturnMap) -> Stability:
    """The same of a stride that need not close, where it is looked at next to a gait."""
    section = gait.model.system.section
    jacobian = linear.by_state
    scales = np.array([gait.model.scales[name] for name in section.coordinates])
    scaled = jacobian * scales / scales[:, None]
    values, vectors = np.linalg.eig(scaled)
    order = _order(values)
    vectors = vectors[:, order].astype(complex)
    gradient, identity = _energy_identity(gait, jacobian)
    return Stability(
        coordinates=tuple(section.coordinates),
        scales=scales,
        jacobian=jacobian,
        multipliers=values[order].astype(complex),
        vectors=vectors,
        condition_numbers=_condition_numbers(vectors),
        jacobian_error=SAFETY * gait.tolerance * float(np.linalg.norm(scaled, 2)),
        energy_identity=identity,
        energy_gradient=gradient,
        crossing_rates=linear.crossing_rates,
    )


def _energy_identity(gait: Gait, jacobian: Array) -> tuple[Array | None, float | None]:
    system, start = gait.model.system, gait.trajectory.start
    if "energy" not in system.section.conserved:
        return None, None
    at = section_rows(system)
    values = section_quantities(system)(start.states, start.held, gait.model.parameter_vector)
    gradient = values.by_states[list(system.section.quantities).index("energy")][at]
    defect = np.linalg.norm(gradient @ jacobian - gradient) / np.linalg.norm(gradient)
    return gradient, float(defect)


def _condition_numbers(vectors: ComplexArray) -> Array:
    """Of eigenvalues with these right eigenvectors of length one; infinite if they coincide."""
    try:
        left = np.linalg.inv(vectors)
    except np.linalg.LinAlgError:
        return np.full(len(vectors), np.inf)
    return np.asarray(np.linalg.norm(left, axis=1))


def _sorted(values: ComplexArray) -> ComplexArray:
    return values[_order(values)]


def _order(values: ComplexArray) -> list[int]:
    """Largest first; of a conjugate pair the one with the positive imaginary part."""
    sizes = np.round(np.abs(values), 12)  # a conjugate pair may differ by rounding
    return [int(i) for i in np.lexsort((-values.imag, -sizes))]
