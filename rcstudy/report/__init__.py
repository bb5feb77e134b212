"""From a cube to paper: views of its cases, measures, figures and tables (entries: rcstudy.figures, rcstudy.tables)."""
