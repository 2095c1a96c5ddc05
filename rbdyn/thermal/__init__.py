"""Heat of a bearing: where losses arise, how heat leaves, and which temperatures follow.

- ``network``: four nodes, their steady temperatures, the heat by way out, and the gain of heat that follows temperature
- ``conductances``: oil flow, surfaces to the oil, race contacts, seats in housing and on shaft, from sizes and materials
- ``heat``: heat of each node from the power lost in each term
- ``oil_fraction``: share of oil in the cavity of a bearing under a jet, from its flow

Pure functions of floats and arrays in SI, temperatures in C. A scene without thermal network imports none of them.
"""
