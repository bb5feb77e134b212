"""The mechanics of rolling contact of layered bodies: no files, no studies, no plots in here.

`SOLVER_VERSION` goes up whenever a stored number may change by more than rounding; it is part of each case's hash.
"""

SOLVER_VERSION = "30"
