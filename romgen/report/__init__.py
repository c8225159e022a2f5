"""Figures, their data as CSV, field files for ParaView and the single-file HTML report: the only door to matplotlib."""

from __future__ import annotations

from romgen.report.inputs import OrderTrial, Reconstruction, ReportInputs, StageCost
from romgen.report.write import ReportFiles, write_report

__all__ = ["OrderTrial", "Reconstruction", "ReportFiles", "ReportInputs", "StageCost", "write_report"]
