"""Equilibria over keys of a scene: ``points``, ``march`` (compiled), ``figures``, ``result``; ``run`` joins them."""
