"""Batches of cases, and who solves them: this process, processes of this machine, or a cluster."""
