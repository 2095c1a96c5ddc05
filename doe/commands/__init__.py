"""The commands of ``doe``, one a module. Methods are imported inside them, so that help comes at once."""
