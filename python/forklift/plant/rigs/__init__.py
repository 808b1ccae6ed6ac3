"""Machines that others built and recorded, as examples of `forklift.plant`: textbook models and catalogues of
what such rigs in general may leave out. The recordings are public, and are not part of this package."""
