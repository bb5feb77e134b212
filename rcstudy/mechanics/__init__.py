"""The mechanics of rolling contact of layered bodies, independent of files, studies and plots.

`SOLVER_VERSION` is raised whenever a stored number may change by more than rounding; it is part of each case's hash.
"""

SOLVER_VERSION = "67"
