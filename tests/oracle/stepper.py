"""Backward differentiation formulas of variable order and step (VODE), step by step with its interpolating polynomial.

SciPy's own steppers with a banded Jacobian (LSODA) begin every interval with a non-stiff method, and leave it late or
never where a stiff solution is smooth.
"""

import warnings
from collections.abc import Callable

import numpy as np
from scipy.integrate import ode
from tables import Array

# Positions in the work arrays of VODE (Brown, Byrne, Hindmarsh 1989): the last step and the Nordsieck array; the last
# order.
_LAST_STEP, _NORDSIECK = 10, 20
_LAST_ORDER = 13


class BackwardDifferences:
    """Integrates from a time to an end, one step at a time."""

    def __init__(
        self,
        right_hand_side: Callable[[float, Array], Array],
        jacobian: Callable[[float, Array], Array],
        start: float,
        y: Array,
        end: float,
        relative: float,
        absolute: Array,
        band: int,
        first_step: float,
    ) -> None:
        self.t, self.end, self.y, self.t_old = start, end, y, start
        self.message = ""
        # Time since the start, as steps far shorter than the rounding of a late time may be needed.
        self._start = start
        self._solver = ode(lambda t, y: right_hand_side(start + t, y), lambda t, y: jacobian(start + t, y))
        self._solver.set_integrator(
            "vode", method="bdf", rtol=relative, atol=absolute, lband=band, uband=band, first_step=first_step
        )
        self._solver.set_initial_value(y, 0.0)
        self._integrator = self._solver._integrator
        self._length = end - start
        self._integrator.rwork[0] = self._length
        self._integrator.call_args[2] = 5  # one step, not beyond the end

    @property
    def is_done(self) -> bool:
        return bool(self._solver.t >= self._length)

    def step(self) -> bool:
        """One step; false if it failed."""
        solver, integrator = self._solver, self._integrator
        self.t_old = self.t
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            solver._y, solver.t = integrator.run(solver.f, solver.jac, solver._y, solver.t, self._length, (), ())
        if not integrator.success:
            self.message = integrator.messages.get(integrator.istate, "")
            return False
        self.t, self.y = self.end if self.is_done else self._start + float(solver.t), solver._y.copy()
        return True

    def interpolated(self, times: Array) -> Array:
        """The state at times within the last step, a column each."""
        integrator, n = self._integrator, len(self.y)
        order, step = int(integrator.iwork[_LAST_ORDER]), float(integrator.rwork[_LAST_STEP])
        columns = integrator.rwork[_NORDSIECK : _NORDSIECK + (order + 1) * n].reshape((n, order + 1), order="F")
        powers = ((times - self._start - self._solver.t) / step) ** np.arange(order + 1)[:, None]
        states: Array = columns @ powers
        return states
