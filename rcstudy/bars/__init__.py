"""Error bars: estimates of the discretisation error of each scalar (entry: `estimate.py`)."""
