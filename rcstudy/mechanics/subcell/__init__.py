"""What lies between the centres of cells: edges, narrow slip zones, cusps and peaks, and what cells miss of them."""
