"""What `forklift.fit` is made of: unknowns, sensors, likelihood, problem, search, judgement; one idea a file.

Data flows `unknowns`, `sensors` → `likelihood` → `problem` → `search` → `knowledge`, `judgement`.
"""
