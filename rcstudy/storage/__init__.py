"""Results on the disk: records, units and cubes as files, whole or absent (entries: rcstudy.store, rcstudy.cube)."""
