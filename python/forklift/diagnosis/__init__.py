"""Where a model and recordings part, and what would mend it: the engine behind `forklift.diagnose`.

It works on `forklift.fitting.problem.LeastSquares` and on hypotheses, and knows neither lifts nor
hydraulics.
"""
