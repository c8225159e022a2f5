"""A reduced model as a pythonfmu slave: reads rom.json and slave.json beside it, needs numpy only.

z' = Lambda z + N zeta^E + G u, y/s = Re(T zeta^E), x = W (y/s)^E, x' = W_v (y/s)^E, zeta = (z, conj z), by the
fixed-step scheme of Cox and Matthews (2002), the same as the native unit of the same model.
"""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from pythonfmu import Boolean, Fmi2Slave, Real
from pythonfmu.enums import Fmi2Status


class Polynomial:
    """p(x) = C x^E at one point."""

    def __init__(self, table: dict[str, Any], is_complex: bool) -> None:
        values = np.array(table["coefficients"], dtype=float)
        self.coefficients = values[..., 0] + 1j * values[..., 1] if is_complex else values
        self.exponents = np.array(table["exponents"], dtype=int)
        self.n_power = 1 + int(self.exponents.max(initial=0))

    def __call__(self, x: np.ndarray) -> np.ndarray:
        """(n_out,) values for x (n_var,)."""
        powers = np.ones((len(x), self.n_power), dtype=x.dtype)
        for k in range(1, self.n_power):
            powers[:, k] = powers[:, k - 1] * x
        monomials = np.ones(len(self.exponents), dtype=x.dtype)
        for i in range(len(x)):
            monomials *= powers[i, self.exponents[:, i]]
        return self.coefficients @ monomials


def phi_functions(x: np.ndarray) -> list[np.ndarray]:
    """phi_0..phi_3, phi_k = sum_j x^j / (j + k)!: series for |x| < 1, the recurrence otherwise."""
    phi = [np.exp(x)]
    large = np.abs(x) >= 1.0
    safe = np.where(large, x, 1.0)
    small = np.where(large, 0.0, x)
    for k in range(1, 4):
        series = np.ones_like(x)
        for j in range(20, 0, -1):
            series = 1.0 + series * small / (j + k)
        recurrence = (phi[-1] - 1.0 / math.factorial(k - 1)) / safe
        phi.append(np.where(large, recurrence, series / math.factorial(k)))
    return phi


class RomgenSlave(Fmi2Slave):
    """Co-Simulation slave with the variables of the native unit."""

    def __init__(self, **kwargs: Any) -> None:
        super().__init__(**kwargs)
        folder = Path(self.resources)
        model = json.loads((folder / "rom.json").read_text(encoding="utf-8"))
        self.modelName = model["name"]
        self._read_model(model)
        self.z = np.zeros(len(self.eigenvalues), dtype=complex)
        self.warn_on_crossing = True
        self._step_length = 0.0
        self._outputs: np.ndarray | None = None
        interface = json.loads((folder / "slave.json").read_text(encoding="utf-8"))
        self.parameters = dict(interface["parameters"])
        self.base_share = interface["base_share"]
        self.n_load = len(model["inputs"])
        self.u = np.zeros(self.n_load + (0 if self.base_share is None else 2))
        for kind, name, role, index in interface["variables"]:
            self._register(kind, name, role, index)

    def _read_model(self, model: dict[str, Any]) -> None:
        def complex_array(key: str) -> np.ndarray:
            pairs = np.array(model[key], dtype=float).reshape(-1, 2)  # also for a matrix without columns
            return pairs[..., 0] + 1j * pairs[..., 1]

        self.eigenvalues = complex_array("eigenvalues_per_s")
        m = len(self.eigenvalues)
        self.input_matrix = complex_array("input_matrix").reshape(m, len(model["inputs"]))
        self.trained_facets = np.array(model["trained_facets"])
        has_terms = len(model["normal_form"]["exponents"]) > 0
        self.normal_form = Polynomial(model["normal_form"], True) if has_terms else None
        self.chart = Polynomial(model["chart"], True)
        self.displacement = Polynomial(model["displacement_m"], False)
        self.velocity = Polynomial(model["velocity_m_per_s"], False)

    def _register(self, kind: str, name: str, role: str, index: int) -> None:
        """Make one variable; causality and units are in the model description, which is written apart."""
        getter = {
            "state": lambda: (self.z[index // 2].real, self.z[index // 2].imag)[index % 2],
            "rate": lambda: (self._rate()[index // 2].real, self._rate()[index // 2].imag)[index % 2],
            "input": lambda: self.u[index],
            "output": lambda: self._output()[index],
            "parameter": lambda: self.parameters[name],
            "constant": lambda: self.parameters[name],
            "inside": self._inside,
            "warn": lambda: self.warn_on_crossing,
        }[role]
        setter = {
            "state": lambda value: self._set_state(index, value),
            "input": lambda value: self._set_input(index, value),
            "parameter": lambda value: self._set_parameter(name, value),
            "warn": lambda value: setattr(self, "warn_on_crossing", value),
        }.get(role)
        make = Boolean if kind == "Boolean" else Real
        self.register_variable(make(name, getter=getter, setter=setter), nested=False)

    def _set_state(self, index: int, value: float) -> None:
        self._require_finite(value)
        z = self.z[index // 2]
        self.z[index // 2] = complex(z.real, value) if index % 2 else complex(value, z.imag)
        self._outputs = None

    def _set_input(self, index: int, value: float) -> None:
        self._require_finite(value)
        self.u[index] = value
        self._outputs = None

    def _set_parameter(self, name: str, value: float) -> None:
        self._require_finite(value)
        self._outputs = None
        if name != "input_gain" and not value > 0.0:
            raise ValueError(f"{name} must be positive")
        self.parameters[name] = value

    @staticmethod
    def _require_finite(value: float) -> None:
        if not math.isfinite(value):
            raise ValueError("a value is not finite")

    def _trust_ratio(self) -> float:
        return float(np.max(self.trained_facets @ np.abs(self.z)))

    def _inside(self) -> bool:
        return self._trust_ratio() <= self.parameters["trust_radius"]

    def _nonlinear(self, z: np.ndarray) -> np.ndarray:
        load = self.parameters["input_gain"] * (self.input_matrix @ self.u[: self.n_load])
        if self.normal_form is None:
            return load
        return self.normal_form(np.concatenate([z, z.conj()])) + load

    def _rate(self) -> np.ndarray:
        return self.eigenvalues * self.z + self._nonlinear(self.z)

    def _output(self) -> np.ndarray:
        """Displacements, velocities, the same in space, amplitudes, phases, trust ratio."""
        if self._outputs is None:
            y = self.chart(np.concatenate([self.z, self.z.conj()])).real
            amplitude = np.abs(self.z)
            relative = [self.displacement(y), self.velocity(y)]
            absolute = (
                [] if self.base_share is None else [r + b for r, b in zip(relative, self._base_motion(), strict=True)]
            )
            polar = [amplitude, np.angle(self.z), [self._trust_ratio()]]
            self._outputs = np.concatenate([*relative, *absolute, *polar])
        return self._outputs

    def _base_motion(self) -> list[np.ndarray]:
        """What the base adds to the displacements and the velocities."""
        share = np.array(self.base_share) * self.parameters["input_gain"]
        return [share * self.u[self.n_load], share * self.u[self.n_load + 1]]

    def _prepare(self, h: float) -> None:
        """Coefficients of one internal step length."""
        if h == self._step_length:
            return
        full, half = phi_functions(self.eigenvalues * h), phi_functions(0.5 * self.eigenvalues * h)
        self._e, self._e_half, self._q = full[0], half[0], 0.5 * h * half[1]
        self._f1 = h * (full[1] - 3.0 * full[2] + 4.0 * full[3])
        self._f2 = h * (2.0 * full[2] - 4.0 * full[3])
        self._f3 = h * (4.0 * full[3] - full[2])
        self._step_length = h

    def _internal_step(self, z: np.ndarray) -> np.ndarray:
        n0 = self._nonlinear(z)
        a = self._e_half * z + self._q * n0
        na = self._nonlinear(a)
        b = self._e_half * z + self._q * na
        nb = self._nonlinear(b)
        d = self._e_half * a + self._q * (2.0 * nb - n0)
        return self._e * z + self._f1 * n0 + self._f2 * (na + nb) + self._f3 * self._nonlinear(d)

    def do_step(self, current_time: float, step_size: float) -> bool:
        """Advance by one communication step with the input held; False, and no change, beyond the hard limit."""
        n = max(1, math.ceil(step_size / self.parameters["max_internal_step"] - 1e-9))
        self._prepare(step_size / n)
        before, was_inside = self.z, self._inside()
        for _ in range(n):
            self.z = self._internal_step(self.z)
            if not self._trust_ratio() <= self.parameters["hard_limit"]:
                self.z = before
                self.log(
                    "trust_ratio exceeds hard_limit; the state of the last communication point is kept",
                    Fmi2Status.error,
                )
                return False
        self._outputs = None
        if was_inside and not self._inside():
            status = Fmi2Status.warning if self.warn_on_crossing else Fmi2Status.ok
            self.log(f"the motion left the trained range at t = {current_time + step_size:.6g} s", status)
        return True
