"""What lies between the centres of cells: edges, narrow slip zones, borders of stick, cusps; rows moved to an edge."""
