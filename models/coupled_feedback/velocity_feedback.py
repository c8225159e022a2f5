"""A controller as a pythonfmu unit: the base acceleration is a burst plus a gain times the measured velocity."""

import math

from pythonfmu import Fmi2Causality, Fmi2Slave, Fmi2Variability, Real


class VelocityFeedback(Fmi2Slave):
    """a(t) = burst_level sin(2 pi burst_frequency t) for t < burst_end, plus gain times velocity."""

    author = "romgen"
    description = "Burst excitation and velocity feedback"

    def __init__(self, **kwargs):
        super().__init__(**kwargs)
        self.velocity = 0.0
        self.acceleration = 0.0
        self.gain = 0.0
        self.burst_level = 0.0
        self.burst_frequency = 100.0
        self.burst_end = 0.0
        self.register_variable(Real("velocity", causality=Fmi2Causality.input))
        self.register_variable(Real("acceleration", causality=Fmi2Causality.output))
        for name in ("gain", "burst_level", "burst_frequency", "burst_end"):
            self.register_variable(Real(name, causality=Fmi2Causality.parameter, variability=Fmi2Variability.tunable))

    def do_step(self, current_time, step_size):
        """Give the acceleration of the end of the step."""
        t = current_time + step_size
        burst = self.burst_level * math.sin(2.0 * math.pi * self.burst_frequency * t) if t < self.burst_end else 0.0
        self.acceleration = burst + self.gain * self.velocity
        return True
