"""Reduced models of jointed structures on spectral submanifolds, shipped as FMUs."""

__version__ = "0.1.0"
