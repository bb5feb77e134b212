"""From a cube to paper: views of its cases, measures, figures and tables.

Entries: rcstudy.figures, rcstudy.tables, rcstudy.accuracy.
"""
