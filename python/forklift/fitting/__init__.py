"""What `forklift.fit` is made of: sensors' likelihood, problem, search, residuals; one idea a file.

Data flows `sample`, `likelihood` → `problem` → `search` → `intervals`, `residuals`.
"""
