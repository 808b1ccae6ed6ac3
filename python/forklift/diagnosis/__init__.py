"""Where a model and recordings part, and what would mend it: the engine behind `forklift.diagnose`.

It works on `forklift.plant.forklift.problem.Problem` and on hypotheses, and knows neither lifts nor
hydraulics.
"""
