"""Heat of a bearing: where losses arise, how heat leaves, and which temperatures follow.

- ``network``: conductances of oil flow, surfaces, race contacts and seats from sizes and materials; four nodes, their steady
  temperatures, and the heat by way out
- ``losses``: heat of each node from the power lost in each term, the balance about a state, and steady temperatures of many sets of inputs
- ``oil_fraction``: share of oil in the cavity of a bearing under a jet, from its flow
- ``fixed_point``: temperatures that their own heat keeps up, the gain of the loop, and the verdict where there are none
- ``start``: temperatures over time while a machine warms, with housing and shaft as nodes of their own

Pure functions of floats and arrays in SI, temperatures in C. A scene without [thermal] imports none of them; one with an oil flow
imports the oil fraction.
"""
