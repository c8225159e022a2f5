"""What every exported unit is made of: C99 runtime, FMI 2.0 headers, description and slave templates."""
