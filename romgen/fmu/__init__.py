"""Export of reduced models as FMI 2.0 units, and the proof that the units compute what the model computes.

``export_fmu`` (romgen.fmu.export) writes the native unit, ``export_pythonfmu`` (romgen.fmu.python_export) the pythonfmu
one, ``check_fmu`` (romgen.fmu.check) compares them with the Python model, ``replay`` (romgen.fmu.driver) drives a unit.
"""
