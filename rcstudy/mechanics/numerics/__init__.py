"""Numerical methods that know nothing of contact, and the libraries beneath them."""
