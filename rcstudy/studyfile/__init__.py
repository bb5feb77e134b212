"""The text of a study file: its tree with places, the keys it may have, its grids, and the scenes these stand for."""
