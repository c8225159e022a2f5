"""Three-dimensional finite elements with contact, friction and large deflection."""
