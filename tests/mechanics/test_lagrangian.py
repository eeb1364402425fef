"""Derived equations against textbook ones and against the paper's own form."""

from __future__ import annotations

import sympy as sp

from flexspine.mechanics.equations import as_latex, as_text, written_out
from flexspine.mechanics.lagrangian import AppliedForce, Lagrangian
from flexspine.models.actuation import BARE, DAMPED
from flexspine.models.bounder import lagrangian, stance_legs
from flexspine.models.flexible_bounder import FLEXIBLE_BOUNDER


def solved(system: Lagrangian) -> list[sp.Expr]:
    """The accelerations with every definition put in."""
    further, accelerations = system.accelerations()
    definitions = {**system.definitions, **further}
    result = list(accelerations)
    for symbol in reversed(list(definitions)):
        result = [expression.subs(symbol, definitions[symbol]) for expression in result]
    return result


def test_the_double_pendulum_is_the_textbook_one() -> None:
    """Equal masses and lengths, angles from the downward vertical (Goldstein, chapter 1)."""
    a, b, va, vb, g = sp.symbols("a b va vb g", real=True)
    kinetic = va**2 + vb**2 / 2 + va * vb * sp.cos(a - b)
    potential = -g * (2 * sp.cos(a) + sp.cos(b))
    one, two = solved(Lagrangian((a, b), (va, vb), kinetic, potential))
    d = a - b
    below = 3 - sp.cos(2 * d)
    textbook_one = (
        -3 * g * sp.sin(a) - g * sp.sin(a - 2 * b)
        - 2 * sp.sin(d) * (vb**2 + va**2 * sp.cos(d))
    ) / below  # fmt: skip
    textbook_two = 2 * sp.sin(d) * (2 * va**2 + 2 * g * sp.cos(a) + vb**2 * sp.cos(d)) / below
    values = {a: 0.3, b: -1.1, va: 0.7, vb: -0.4, g: 9.81}
    assert abs((one - textbook_one).subs(values)) < 1e-12
    assert abs((two - textbook_two).subs(values)) < 1e-12


def test_definitions_change_nothing_but_the_writing() -> None:
    x, v, k, s = sp.symbols("x v k s", real=True)
    plain = Lagrangian((x,), (v,), v**2 / 2, k * sp.sin(x) ** 2 / 2)
    named = Lagrangian((x,), (v,), v**2 / 2, k * s**2 / 2, definitions={s: sp.sin(x)})
    assert sp.simplify(solved(plain)[0] - solved(named)[0]) == 0


def test_dampers_and_forces_do_virtual_work() -> None:
    r, v, c, f = sp.symbols("r v c f", real=True)
    force = AppliedForce((f, 0), (3 * r, r**2))
    system = Lagrangian((r,), (v,), v**2, sp.S.Zero, c * v**2 / 2, (force,))
    assert sp.simplify(solved(system)[0] - (3 * f - c * v) / 2) == 0


def test_the_flexible_body_is_diagonal_in_mean_and_half_bend() -> None:
    """T = m_s v^2 + (J + m_s a^2 cos^2 p) t'^2 + (J + m_s a^2 sin^2 p) p'^2 for equal halves."""
    body = FLEXIBLE_BOUNDER.body(BARE)
    system = lagrangian(body)
    m, J, a, t, p, vt, vp = sp.symbols("m_s J a t p vt vp", real=True)
    letters = {str(s): s for s in system.kinetic.free_symbols | set(body.parameters.values())}
    kinetic = system.kinetic
    for symbol in reversed(list(system.definitions)):
        kinetic = kinetic.subs(symbol, system.definitions[symbol])
    names = {str(s): s for s in kinetic.free_symbols}
    equal = {names[n]: value for n, value in
             {"m_f": m, "m_h": m, "J_f": J, "J_h": J, "a_f": a, "a_h": a,
              "theta_f": t + p, "theta_h": t - p,
              "thetadot_f": vt + vp, "thetadot_h": vt - vp}.items()}  # fmt: skip
    vx, vy = letters["xdot"], letters["ydot"]
    paper = (
        m * (vx**2 + vy**2)
        + (J + m * a**2 * sp.cos(p) ** 2) * vt**2
        + (J + m * a**2 * sp.sin(p) ** 2) * vp**2
    )
    assert sp.simplify(sp.expand_trig(kinetic.subs(equal) - paper)) == 0


def test_equations_are_written_as_text_and_latex() -> None:
    body = FLEXIBLE_BOUNDER.body(DAMPED)
    lines = written_out(lagrangian(body, "DS", stance_legs(body, "DS", DAMPED)))
    text, latex = as_text(lines, unicode=False), as_latex(lines)
    assert "Equations of motion" in text
    assert r"\ddot{\theta}_{f}" in latex
    assert latex.count(r"\[") == latex.count(r"\]") > 10
