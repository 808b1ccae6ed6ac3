"""The parts of the page of a plant's diagnosis; `forklift.report.of_plant` puts them together."""
