"""Checks against published tables, trends, measurements and friction formulas; ``../published_checks.py`` runs them."""
