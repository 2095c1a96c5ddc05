"""Equilibria over keys of a scene: ``points``, ``figures``, ``result``; ``run`` joins them."""
